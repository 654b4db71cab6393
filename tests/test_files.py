"""Files are written whole or not at all."""

import os
import signal
import subprocess
import sys
import time

import pytest

from mjcartpole.errors import FileError, RunError
from mjcartpole.files import (
    atomic_write,
    check_free,
    check_writable,
    free_path,
    is_temporary,
    is_there,
    make_folder,
    read_bytes,
    remove_leftovers,
    write_whole,
)
from nightly import at_night


def test_writes_and_replaces(tmp_path):
    path = tmp_path / "deep" / "file.txt"
    write_whole(path, "one")
    write_whole(path, "twö")
    assert path.read_text(encoding="utf-8") == "twö"
    assert [entry.name for entry in path.parent.iterdir()] == ["file.txt"]


def test_a_failing_body_leaves_the_old_file(tmp_path):
    path = tmp_path / "file.txt"
    path.write_text("old")

    def fail():
        with atomic_write(path) as temporary:
            temporary.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    assert path.read_text() == "old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["file.txt"]


def test_the_temporary_name_keeps_the_suffix(tmp_path):
    with atomic_write(tmp_path / "video.mp4") as temporary:
        assert temporary.suffix == ".mp4"
        assert temporary.parent == tmp_path


def test_a_folder_in_the_way_is_named(tmp_path):
    with pytest.raises(FileError, match="it is a folder"):
        write_whole(tmp_path, "text")


def test_a_file_where_a_folder_is_needed(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(FileError, match="cannot make the folder"):
        make_folder(tmp_path / "file" / "sub")


@pytest.mark.skipif(not os.path.exists("/proc/version"), reason="needs a folder nobody can write")
def test_an_unwritable_folder_is_refused():
    with pytest.raises(FileError, match="cannot"):
        write_whole("/proc/nobody/file.txt", "text")
    with pytest.raises(FileError, match="cannot"):
        check_writable(make_folder("/proc"))


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
def test_a_full_disk_leaves_the_old_file(tmp_path):
    path = tmp_path / "file.txt"
    path.write_text("old")

    def fill():
        with atomic_write(path), open("/dev/full", "w") as full:
            full.write("x" * 10)
            full.flush()

    with pytest.raises(FileError, match="No space left"):
        fill()
    assert path.read_text() == "old"


WRITER = """
import sys
from mjcartpole.files import write_whole
print("ready", flush=True)
number = 0
while True:
    number = 1 - number
    write_whole(sys.argv[1], str(number) * 200_000)
"""


@pytest.mark.long
def test_a_kill_leaves_the_old_file_or_the_new_one(tmp_path):
    path = tmp_path / "file.txt"
    write_whole(path, "0" * 200_000)
    for attempt in range(0, 8, at_night(1, fast=3)):
        writer = subprocess.Popen(
            [sys.executable, "-c", WRITER, str(path)], stdout=subprocess.PIPE, text=True
        )
        assert writer.stdout.readline() == "ready\n"
        time.sleep(0.003 * attempt)
        writer.send_signal(signal.SIGKILL)
        writer.communicate()
        assert path.read_text() in {"0" * 200_000, "1" * 200_000}


@pytest.mark.parametrize(
    "name", ["file.txt", "file", "checkpoint-previous.bin", "two.dots.txt", "a-b_c.json"]
)
def test_what_a_killed_writer_leaves_is_known_and_removed(name, tmp_path):
    (tmp_path / "sub").mkdir()
    for other in (name, ".hidden", ".lock", ".file-12345678", "file-12345678.txt"):
        (tmp_path / other).write_text("kept")
    (tmp_path / ".file-12345678").unlink()
    with atomic_write(tmp_path / name) as temporary:
        assert is_temporary(temporary.name)
        copy = temporary.read_bytes()
    temporary.write_bytes(copy)  # As a kill would have left it.
    assert not is_temporary(name)
    remove_leftovers(tmp_path)
    left = sorted(path.name for path in tmp_path.iterdir())
    assert left == sorted({name, ".hidden", ".lock", "file-12345678.txt", "sub"})


def test_the_probe_of_a_folder_leaves_nothing(tmp_path):
    check_writable(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_free_path_is_counted_past_all_that_is_there(tmp_path):
    film = tmp_path / "alpha0.1.mp4"
    assert free_path(film) == film
    film.write_bytes(b"")
    assert free_path(film).name == "alpha0.1-2.mp4"
    (tmp_path / "alpha0.1-2.gif").write_bytes(b"")
    (tmp_path / "alpha0.1-3.mp4").symlink_to(tmp_path / "nowhere")
    assert free_path(film, (".gif",)).name == "alpha0.1-4.mp4"


def test_only_what_is_there_is_refused(tmp_path):
    (tmp_path / "empty").mkdir()
    check_free([tmp_path / "empty", tmp_path / "nothing"])
    (tmp_path / "empty" / "file").write_bytes(b"")
    for path in (tmp_path / "empty", tmp_path / "empty" / "file"):
        with pytest.raises(FileError, match="--overwrite"):
            check_free([tmp_path / "nothing", path])


def test_a_file_is_read_up_to_its_limit(tmp_path):
    path = tmp_path / "file.txt"
    path.write_bytes(b"12345")
    (tmp_path / "link").symlink_to(path)
    assert read_bytes(path, 5) == b"12345"
    assert read_bytes(tmp_path / "link", 5, follow=True) == b"12345"
    with pytest.raises(FileError, match="has 5 bytes, and no more than 4 are read"):
        read_bytes(path, 4)


@pytest.mark.parametrize(
    ("make", "what"),
    [
        (lambda path: None, "No such file"),
        (lambda path: path.mkdir(), "it is a folder where"),
        (lambda path: path.symlink_to(__file__), "it is a link, which may lead anywhere, where"),
        (lambda path: path.symlink_to(path.name), "it is a link"),
        (os.mkfifo, "it is a device or a pipe where"),
    ],
)
def test_what_is_no_file_is_not_even_opened(make, what, tmp_path):
    make(tmp_path / "thing")
    with pytest.raises(RunError, match=what):
        read_bytes(tmp_path / "thing", 10**6, refusal=RunError)


def test_a_link_that_a_person_names_is_followed_but_to_files_only():
    with pytest.raises(FileError, match="it is a device or a pipe where"):
        read_bytes("/dev/zero", 10**6, follow=True)


def test_what_is_there(tmp_path):
    (tmp_path / "broken").symlink_to(tmp_path / "nothing")
    assert is_there(tmp_path)
    for path in (tmp_path / "nothing", tmp_path / "broken", tmp_path / "no\0path"):
        assert not is_there(path)
