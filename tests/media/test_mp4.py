"""H.264 by PyAV: failures, and what stands in where it cannot be written."""

import os
import random
import subprocess
import sys
import textwrap

import av
import numpy as np
import pytest
from PIL import Image

from mjcartpole.errors import RenderError
from mjcartpole.media import mp4
from mjcartpole.media.video import write_video
from nightly import at_night

FRAME = np.full((48, 64, 3), 200, np.uint8)


def test_an_encoder_that_fails_is_a_render_error(tmp_path, monkeypatch):
    monkeypatch.setitem(mp4._LOOK, "preset", "no such preset")
    with pytest.raises(RenderError, match=r"^libx264 fails: "):
        write_video(tmp_path / "run.mp4", [FRAME] * 3)
    assert not list(tmp_path.iterdir())


def test_without_the_encoder_a_gif_is_written(tmp_path, monkeypatch, caplog):
    monkeypatch.setattr(mp4, "CODEC", "libx999")
    mp4.why_no_mp4.cache_clear()
    try:
        video = write_video(tmp_path / "run.mp4", [FRAME] * 3)
    finally:
        mp4.why_no_mp4.cache_clear()
    assert [video.path] == [tmp_path / "run.gif"] == list(tmp_path.iterdir())
    with Image.open(video.path) as image:
        assert image.n_frames == 3
    assert caplog.messages == [
        f"no mp4 (PyAV {av.__version__} was built without libx999); writing '{video.path}' instead"
    ]


@pytest.mark.long
def test_without_pyav_a_gif_is_written(tmp_path):
    code = """
        import sys, numpy
        sys.modules["av"] = None
        from mjcartpole.media.mp4 import why_no_mp4
        from mjcartpole.media.video import write_video
        frame = numpy.zeros((48, 64, 3), numpy.uint8)
        print(write_video(sys.argv[1], [frame] * 3).path.name, why_no_mp4())
    """
    command = [sys.executable, "-c", textwrap.dedent(code), str(tmp_path / "run.mp4")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.startswith("run.gif PyAV cannot be imported: ")


def test_a_name_that_ffmpeg_would_take_for_a_protocol(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_video("concat:a|b.mp4", [FRAME] * 3)
    assert os.listdir() == ["concat:a|b.mp4"]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="counts threads in /proc")
def test_no_thread_outlives_a_film(tmp_path):
    code = """
        import os, sys, time, numpy
        from mjcartpole.media.video import write_video
        frames = [numpy.full((480, 640, 3), value, numpy.uint8) for value in range(30)]
        import av
        before = len(os.listdir("/proc/self/task"))
        write_video(sys.argv[1], frames)
        until = time.monotonic() + 10
        while len(os.listdir("/proc/self/task")) > before and time.monotonic() < until:
            time.sleep(0.01)
        print(len(os.listdir("/proc/self/task")) - before)
    """
    command = [sys.executable, "-c", textwrap.dedent(code), str(tmp_path / "run.mp4")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout == "0\n"


def test_the_same_frames_are_the_same_bytes_whatever_memory_held_before(tmp_path):
    bar = np.tile(np.array([220, 240, 250], np.uint8), (20, 48, 64, 1))
    for index, frame in enumerate(bar):
        frame[:, index : index + 8] = (200, 90, 40)
    noise, films = random.Random(0), set()
    for _ in range(at_night(30, fast=8)):
        # Freed at once: the encoder gets it.
        [noise.randbytes(noise.randrange(200, 120_000)) for _ in range(60)]
        write_video(tmp_path / "run.mp4", bar)
        films.add((tmp_path / "run.mp4").read_bytes())
    assert len(films) == 1
