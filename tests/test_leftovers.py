"""What killed writers leave goes; what lives, and what is somebody else's, stays."""

import os
import signal
import subprocess
import sys
import textwrap

import pytest

from mjcartpole import leftovers
from mjcartpole.files import atomic_write, check_writable, is_temporary, write_whole
from mjcartpole.media.pictures import replacing_folder
from nightly import few

pytestmark = pytest.mark.skipif(os.name == "nt", reason="nothing is cleared there")

FILMING = """
    import sys, time, numpy
    from mjcartpole.media.video import write_video

    def frames():
        while True:
            yield numpy.zeros((48, 64, 3), numpy.uint8)
            print("drawn", flush=True)
            time.sleep(0.01)

    write_video(sys.argv[1], frames())
"""


def start_filming(path):
    command = [sys.executable, "-c", textwrap.dedent(FILMING), str(path)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    for _ in range(20):
        assert process.stdout.readline() == "drawn\n"
    return process


def kill(process):
    process.send_signal(signal.SIGKILL)
    process.communicate()


def names(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.long
@pytest.mark.parametrize("name", few(["k.mp4", "k.gif", "k", "concat:k.mp4"], "k.mp4"))
def test_what_a_killed_film_leaves_goes_with_the_next_one_and_a_living_one_stays(name, tmp_path):
    killed, living = start_filming(tmp_path / name), start_filming(tmp_path / "living.gif")
    try:
        assert len(names(tmp_path)) == 2
        kill(killed)
        assert len(names(tmp_path)) == 2
        write_whole(tmp_path / "other.txt", "text")
        left = names(tmp_path)
        assert len(left) == 2
        assert left[0].endswith(".gif")
        assert left[1] == "other.txt"
    finally:
        kill(living)
    check_writable(tmp_path)
    assert names(tmp_path) == ["other.txt"]


def test_what_is_somebody_elses_stays(tmp_path):
    outside = tmp_path / "outside"
    outside.write_text("kept")
    folder = tmp_path / "folder"
    folder.mkdir()
    for name in (".k-20240101.mp4", ".backup-deadbeef", ".mjcartpole", ".mjcartpole-settings.json"):
        (folder / name).write_text("kept")
    (folder / ".mjcartpole-00000001").symlink_to(outside)
    os.mkfifo(folder / ".mjcartpole-00000002")
    (folder / ".mjcartpole-00000003" / "sub").mkdir(parents=True)
    before = names(folder)
    write_whole(folder / "new", "text")
    assert names(folder) == sorted([*before, "new"])
    assert outside.read_text() == "kept"


def test_a_temporary_name_is_short_and_known_whatever_the_target_is_called(tmp_path):
    for name in ("n" * 251 + ".txt", "con:cat|é x.txt", "-o.txt"):
        with atomic_write(tmp_path / name) as temporary:
            assert is_temporary(temporary.name)
            assert temporary.suffix == ".txt"
        assert (tmp_path / name).exists()


def test_a_folder_that_was_put_aside_comes_back(tmp_path):
    target = tmp_path / "frames"
    with replacing_folder(target) as temporary:
        (temporary / "000000.png").write_bytes(b"old")
    # As a kill between the two renamings leaves it.
    target.rename(leftovers.name_aside(tmp_path / ".mjcartpole-01234567", target))
    check_writable(tmp_path)
    assert names(tmp_path) == ["frames"]
    with replacing_folder(target) as temporary:
        (temporary / "000001.png").write_bytes(b"new")
    assert names(target) == ["000001.png"]
    (tmp_path / ".mjcartpole-01234567.old-frames").mkdir()
    check_writable(tmp_path)
    assert names(tmp_path) == ["frames"]


def test_one_that_is_cleared_before_it_is_held_is_made_again(tmp_path):
    made = []

    def make(path):
        path.touch(exist_ok=False)
        made.append(path)
        if len(made) == 1:
            path.unlink()

    with leftovers.temporary_beside(tmp_path / "x.txt", make) as temporary:
        assert temporary == made[1]
        check_writable(tmp_path)
        assert temporary.exists()
