import re
import subprocess
import sys
import textwrap
import tracemalloc

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

from mjcartpole.errors import FileError, RenderError
from mjcartpole.media import video
from mjcartpole.media.video import write_video

BACKGROUND, BAR = (220, 240, 250), (200, 90, 40)


def frames(count, width=64, height=48):
    """Pictures with a bar that moves to the right."""
    for index in range(count):
        frame = np.full((height, width, 3), BACKGROUND, dtype=np.uint8)
        frame[:, index % width : index % width + 8] = BAR
        yield frame


def read(path):
    """What ffmpeg says of a video's stream, and its frames, shape (n, height, width, 3)."""
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-hide_banner", "-i", str(path)]
    raw = [*command, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    done = subprocess.run(raw, capture_output=True, check=True, timeout=60)
    stream = next(line for line in done.stderr.decode().splitlines() if "Video: h264" in line)
    width, height = map(int, re.search(r", (\d+)x(\d+)", stream).groups())
    return stream, np.frombuffer(done.stdout, np.uint8).reshape(-1, height, width, 3)


def test_a_video_is_h264_with_the_right_size_rate_and_length(tmp_path):
    path = tmp_path / "run.mp4"
    assert write_video(path, frames(25, 66, 50)) == 25
    stream, pictures = read(path)
    assert "yuv420p(tv, bt709" in stream
    assert " 50 fps" in stream
    assert imageio_ffmpeg.count_frames_and_secs(str(path)) == (25, 0.5)
    assert pictures.shape == (25, 50, 66, 3)
    assert list(tmp_path.iterdir()) == [path]


def test_colours_and_order_of_frames_survive(tmp_path):
    path = tmp_path / "run.mp4"
    write_video(path, frames(20))
    _, pictures = read(path)
    for before, after in zip(frames(20), pictures, strict=True):
        assert np.abs(before.astype(int) - after.astype(int)).mean() < 6


def test_the_index_comes_first(tmp_path):
    path = tmp_path / "run.mp4"
    write_video(path, frames(5))
    content = path.read_bytes()
    assert 0 < content.index(b"moov") < content.index(b"mdat")


@pytest.mark.parametrize("fps", [12, 25])
def test_another_rate(tmp_path, fps):
    path = tmp_path / "slow.mp4"
    write_video(path, frames(fps), fps=fps)
    assert imageio_ffmpeg.count_frames_and_secs(str(path)) == (fps, pytest.approx(1.0, abs=0.01))


def test_a_gif_loops_forever_at_its_rate(tmp_path):
    path = tmp_path / "run.gif"
    assert write_video(path, frames(10), fps=25) == 10
    with Image.open(path) as image:
        assert (image.format, image.size, image.n_frames) == ("GIF", (64, 48), 10)
        assert image.info["loop"] == 0
        assert image.info["duration"] == 40
        image.seek(9)
        last = np.asarray(image.convert("RGB"))
    assert np.abs(last.astype(int) - list(frames(10))[9]).max() < 10


def test_a_gif_keeps_frames_that_do_not_change(tmp_path):
    path = tmp_path / "still.gif"
    still = next(frames(1))
    write_video(path, [still] * 6, fps=50)
    with Image.open(path) as image:
        total = 0
        for index in range(image.n_frames):
            image.seek(index)
            total += image.info["duration"]
    assert total == 6 * 20


def test_the_folder_is_made(tmp_path):
    path = tmp_path / "new" / "folder" / "run.mp4"
    write_video(path, frames(2))
    assert path.is_file()


@pytest.mark.parametrize("name", ["run.avi", "run", "run.mp4.txt"])
def test_an_unknown_format_is_refused(tmp_path, name):
    with pytest.raises(RenderError, match=r"use \.mp4"):
        write_video(tmp_path / name, frames(2))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ([], "at least one frame"),
        ([np.zeros((48, 64), np.uint8)], r"shape \(48, 64\)"),
        ([np.zeros((48, 64, 4), np.uint8)], r"shape \(48, 64, 4\)"),
        ([np.zeros((48, 64, 3))], "float64"),
        ([*frames(1), *frames(1, 32, 32)], "frame 1 is 32x32 pixels, the first one 64x48"),
    ],
    ids=["none", "grey", "alpha", "floats", "two sizes"],
)
@pytest.mark.parametrize("name", ["run.mp4", "run.gif"])
def test_frames_that_do_not_fit_are_refused(tmp_path, name, wrong, message):
    with pytest.raises(RenderError, match=message):
        write_video(tmp_path / name, list(wrong))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("width", "height", "better"), [(65, 48, "66x48"), (64, 47, "64x48"), (65, 47, "66x48")]
)
def test_odd_sizes_are_for_gif_only(tmp_path, width, height, better):
    with pytest.raises(RenderError, match=f"even .* not {width}x{height}; use {better}"):
        write_video(tmp_path / "run.mp4", frames(2, width, height))
    assert write_video(tmp_path / "run.gif", frames(2, width, height)) == 2


@pytest.mark.parametrize("fps", [0, -5])
def test_a_rate_that_makes_no_sense_is_refused(tmp_path, fps):
    with pytest.raises(RenderError, match="fps"):
        write_video(tmp_path / "run.mp4", frames(2), fps=fps)


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError, SystemExit])
@pytest.mark.parametrize("name", ["run.mp4", "run.gif"])
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


def test_a_folder_that_cannot_be_written_is_a_file_error(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(FileError, match="file"):
        write_video(tmp_path / "file" / "run.mp4", frames(2))


def test_an_encoder_that_fails_is_a_render_error(tmp_path, monkeypatch):
    script = tmp_path / "ffmpeg"
    script.write_text("#!/bin/sh\necho first >&2\necho 'disk on fire' >&2\nexit 3\n")
    script.chmod(0o755)
    monkeypatch.setattr(video, "_ffmpeg", lambda: str(script))
    folder = tmp_path / "out"
    with pytest.raises(RenderError, match="ffmpeg failed: disk on fire"):
        write_video(folder / "run.mp4", frames(300, 320, 240))
    assert not list(folder.iterdir())


def test_an_encoder_that_is_not_there_is_a_render_error(tmp_path, monkeypatch):
    monkeypatch.setattr(video, "_ffmpeg", lambda: str(tmp_path / "nowhere"))
    with pytest.raises(RenderError, match="ffmpeg cannot be run"):
        write_video(tmp_path / "run.mp4", frames(2))
    assert not list(tmp_path.iterdir())


def test_memory_does_not_grow_with_the_length(tmp_path):
    tracemalloc.start()
    try:
        write_video(tmp_path / "run.mp4", frames(200, 160, 120))
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 40 * 160 * 120 * 3


def test_writing_is_silent(tmp_path):
    code = f"""
        import numpy
        from mjcartpole.media.video import write_video
        frame = numpy.zeros((50, 66, 3), numpy.uint8)
        write_video({str(tmp_path / "run.mp4")!r}, [frame] * 3)
        write_video({str(tmp_path / "run.gif")!r}, [frame] * 3)
    """
    command = [sys.executable, "-W", "error", "-c", textwrap.dedent(code)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
