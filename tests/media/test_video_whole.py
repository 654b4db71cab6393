"""A video is there whole, or not at all: interrupted, killed, without room; in flat memory."""

import os
import signal
import subprocess
import sys
import textwrap

import pytest

from films import frames
from mjcartpole.errors import FileError
from mjcartpole.media.video import write_video
from nightly import few


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError, SystemExit])
@pytest.mark.parametrize("name", ["run.mp4", "run.gif", "run.webp"])
def test_an_interrupted_video_leaves_the_old_file(tmp_path, name, error):
    path = tmp_path / name
    path.write_bytes(b"old")

    def interrupted():
        yield from frames(10)
        raise error

    with pytest.raises(error):
        write_video(path, interrupted())
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_an_interrupted_folder_keeps_the_old_pictures(tmp_path):
    folder = tmp_path / "pictures"
    write_video(folder, frames(3))

    def interrupted():
        yield from frames(10)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_video(folder, interrupted())
    assert len(list(folder.iterdir())) == 3
    assert list(tmp_path.iterdir()) == [folder]


ENDLESS = """
    import sys, time, numpy
    from mjcartpole.media.video import write_video

    def frames():
        while True:
            yield numpy.zeros((48, 64, 3), numpy.uint8)
            print("drawn", flush=True)
            time.sleep(0.01)

    write_video(sys.argv[1], frames())
"""


@pytest.mark.long
@pytest.mark.skipif(os.name == "nt", reason="kill ends a process without a word there")
@pytest.mark.parametrize("name", few(["run.mp4", "run.gif", "run.webp", "run"], "run.mp4"))
@pytest.mark.parametrize(
    "number",
    few([signal.SIGTERM, signal.SIGINT, getattr(signal, "SIGHUP", 1)], signal.SIGTERM),
)
def test_a_killed_process_leaves_nothing(tmp_path, name, number):
    command = [sys.executable, "-c", textwrap.dedent(ENDLESS), str(tmp_path / name)]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True) as process:
        for _ in range(40):
            assert process.stdout.readline() == "drawn\n"
        process.send_signal(number)
        errors = process.communicate(timeout=20)[1]
    if number != signal.SIGINT:
        assert (process.returncode, errors) == (128 + number, "")
    assert process.returncode != 0
    assert not list(tmp_path.iterdir())


def test_others_keep_their_say_about_sigterm(tmp_path):
    asked = []
    before = signal.signal(signal.SIGTERM, lambda *_: asked.append(1))
    try:
        told = (signal.raise_signal(signal.SIGTERM) or frame for frame in frames(2))
        write_video(tmp_path / "run.gif", told)
    finally:
        signal.signal(signal.SIGTERM, before)
    assert len(asked) == 2
    write_video(tmp_path / "run.gif", frames(2))
    assert signal.getsignal(signal.SIGTERM) == before


@pytest.mark.parametrize("name", ["run.mp4", "run.gif", "run.webp", "run", "run/"])
def test_a_folder_that_cannot_be_written_is_a_file_error(tmp_path, name):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(FileError, match="file"):
        write_video(f"{tmp_path}/file/{name}", frames(2))


FULL = """
    import resource, sys, numpy
    from mjcartpole.errors import MjCartPoleError
    from mjcartpole.media.video import write_video

    noise = numpy.random.default_rng(0)
    frames = [noise.integers(0, 255, (240, 320, 3), numpy.uint8) for _ in range(5)]
    resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]),) * 2)
    try:
        write_video(sys.argv[1], frames * 40)
    except MjCartPoleError as error:
        print(type(error).__name__, error)
"""


@pytest.mark.long
@pytest.mark.skipif(os.name == "nt", reason="limits the size of files")
@pytest.mark.parametrize("most", few([30, 100_000], 100_000))
@pytest.mark.parametrize("name", few(["run.mp4", "run.gif", "run.webp", "run"], "run.mp4"))
def test_where_there_is_no_room_the_old_file_stays(tmp_path, name, most):
    path = tmp_path / name
    write_video(path, frames(2))
    before = {file: file.read_bytes() for file in tmp_path.rglob("*.*")}
    command = [sys.executable, "-W", "error", "-c", textwrap.dedent(FULL), str(path), str(most)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == f"FileError cannot write '{path}': File too large\n"
    assert {file: file.read_bytes() for file in tmp_path.rglob("*.*")} == before
    assert len(list(tmp_path.iterdir())) == 1


GROWING = """
    import resource, sys, numpy
    from mjcartpole.media.video import write_video

    def frames(count):
        frame = numpy.full((120, 160, 3), 220, numpy.uint8)
        for index in range(count):
            frame[40:80] = 220
            frame[40:80, index % 150 : index % 150 + 10] = 90
            yield frame

    write_video(sys.argv[1], frames(100))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    write_video(sys.argv[1], frames(int(sys.argv[2])))
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
"""


@pytest.mark.long
@pytest.mark.skipif(sys.platform != "linux", reason="counts in Linux's kilobytes")
@pytest.mark.parametrize(
    "count", [400, pytest.param(20_000, marks=pytest.mark.slow)], ids=["short", "long"]
)
@pytest.mark.parametrize("name", few(["run.mp4", "run.gif", "run.webp", "run"], "run.mp4"))
def test_memory_does_not_grow_with_the_length(tmp_path, name, count):
    command = [sys.executable, "-c", textwrap.dedent(GROWING), str(tmp_path / name), str(count)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=300)
    assert int(done.stdout) < 4_000  # kilobytes; all frames would be 23 MB or 1.1 GB


@pytest.mark.long
def test_writing_is_silent(tmp_path):
    code = f"""
        import numpy
        from mjcartpole.media.video import write_video
        frame = numpy.zeros((50, 66, 3), numpy.uint8)
        write_video({str(tmp_path / "run.mp4")!r}, [frame] * 3)
        write_video({str(tmp_path / "run.gif")!r}, [frame] * 3)
        write_video({str(tmp_path / "run.webp")!r}, [frame] * 3)
        write_video({str(tmp_path / "run")!r}, [frame] * 3)
    """
    command = [sys.executable, "-W", "error", "-c", textwrap.dedent(code)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
