import os
import signal
import subprocess
import sys
import textwrap

import av
import numpy as np
import pytest
from PIL import Image

from mjcartpole.errors import FileError, RenderError
from mjcartpole.media.video import Video, write_video
from nightly import few

AVCOL_RANGE_MPEG = AVCOL_SPC_BT709 = AVCOL_PRI_BT709 = AVCOL_TRC_BT709 = 1
"""FFmpeg's numbers."""

BACKGROUND, BAR = (220, 240, 250), (200, 90, 40)


def frames(count, width=64, height=48):
    """Pictures with a bar that moves to the right."""
    for index in range(count):
        frame = np.full((height, width, 3), BACKGROUND, dtype=np.uint8)
        frame[:, index % width : index % width + 8] = BAR
        yield frame


def read(path):
    """A video's stream, and its frames, shape (n, height, width, 3)."""
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        pictures = [frame.to_ndarray(format="rgb24") for frame in container.decode(stream)]
    return stream, np.array(pictures)


def count_and_seconds(path):
    """How many frames a video has, and how long it lasts."""
    with av.open(str(path)) as container:
        frames = list(container.decode(video=0))
    return len(frames), float((frames[-1].pts + frames[-1].duration) * frames[-1].time_base)


def test_a_video_is_h264_with_the_right_size_rate_and_length(tmp_path):
    path = tmp_path / "run.mp4"
    assert write_video(path, frames(25, 66, 50)) == Video(path, 25, 66, 50, 50)
    stream, pictures = read(path)
    assert (stream.codec.name, stream.pix_fmt, stream.average_rate) == ("h264", "yuv420p", 50)
    assert (stream.color_range, stream.colorspace) == (AVCOL_RANGE_MPEG, AVCOL_SPC_BT709)
    assert (stream.color_primaries, stream.color_trc) == (AVCOL_PRI_BT709, AVCOL_TRC_BT709)
    assert count_and_seconds(path) == (25, 0.5)
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


@pytest.mark.parametrize("fps", [12, 12.5, 25, 60])
def test_another_rate(tmp_path, fps):
    path = tmp_path / "slow.mp4"
    write_video(path, frames(30), fps=fps)
    count, seconds = count_and_seconds(path)
    assert (count, seconds) == (30, pytest.approx(30 / fps, abs=0.01))


def shown(path):
    """What Pillow sees of an animation: its frames in RGB, and how long each is shown, in ms."""
    pictures, durations = [], []
    with Image.open(path) as image:
        assert image.info["loop"] == 0
        for index in range(image.n_frames):
            image.seek(index)
            pictures.append(np.asarray(image.convert("RGB")))
            durations.append(image.info["duration"])
    return pictures, durations


@pytest.mark.parametrize(("name", "worst"), [("run.gif", 10), ("run.webp", 0)])
@pytest.mark.parametrize(("width", "height"), [(64, 48), (65, 47), (1, 1)])
def test_an_animation_shows_every_frame(tmp_path, name, worst, width, height):
    path = tmp_path / name
    expected = list(frames(70, width, height))
    assert write_video(path, expected, fps=25) == Video(path, 70, width, height, 25)
    pictures, durations = shown(path)
    assert durations == [40] * 70
    for before, after in zip(expected, pictures, strict=True):
        assert np.abs(before.astype(int) - after).max() <= worst


def test_ffmpeg_counts_the_same_frames(tmp_path):
    path = tmp_path / "run.gif"
    write_video(path, [*frames(20), *[next(frames(1))] * 5], fps=50)
    count, seconds = count_and_seconds(path)
    assert (count, seconds) == (25, pytest.approx(0.5, abs=0.001))


@pytest.mark.parametrize("name", ["run.gif", "run.webp"])
def test_an_animation_keeps_frames_that_do_not_change(tmp_path, name):
    path = tmp_path / name
    write_video(path, [next(frames(1))] * 6, fps=50)
    assert shown(path)[1] == [20] * 6


@pytest.mark.parametrize("fps", [7, 12.5, 24, 29.97, 30, 48])
@pytest.mark.parametrize(("name", "tick"), [("run.gif", 10), ("run.webp", 1)])
def test_rounded_times_add_up(tmp_path, name, tick, fps):
    write_video(tmp_path / name, frames(60, 16, 16), fps=fps)
    durations = shown(tmp_path / name)[1]
    assert sum(durations) == pytest.approx(60_000 / fps, abs=tick / 2)
    assert max(durations) - min(durations) <= tick
    assert min(durations) >= 20


@pytest.mark.parametrize(("name", "most"), [("run.gif", 50), ("run.webp", 90)])
def test_what_is_too_fast_is_thinned_out_and_reported(tmp_path, caplog, name, most):
    path = tmp_path / name
    done = write_video(path, frames(120, 16, 16), fps=120)
    assert done == Video(path, most, 16, 16, most)
    assert sum(shown(path)[1]) == 1000
    assert f"shows at most {most} frames per second: 120 is thinned out" in caplog.text


@pytest.mark.parametrize(("name", "most"), [("run.gif", 65_535), ("run.webp", 16_383)])
def test_a_picture_too_large_for_the_format_is_refused(tmp_path, name, most):
    with pytest.raises(RenderError, match=f"at most {most} pixels .* not {most + 1}x1"):
        write_video(tmp_path / name, [np.zeros((1, most + 1, 3), np.uint8)])
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("path", ["pictures", "pictures/", "deep/er"])
def test_a_folder_of_numbered_pictures(tmp_path, path):
    folder = tmp_path / path
    done = write_video(f"{tmp_path}/{path}", frames(12))
    assert done == Video(folder, 12, 64, 48, 50)
    files = sorted(folder.iterdir())
    assert [file.name for file in files] == [f"{index:06d}.png" for index in range(12)]
    for before, file in zip(frames(12), files, strict=True):
        with Image.open(file) as image:
            assert np.array_equal(image, before)
    assert len(list(folder.parent.iterdir())) == 1


def test_a_folder_of_pictures_is_replaced_whole(tmp_path):
    folder = tmp_path / "pictures"
    write_video(folder, frames(12))
    write_video(folder, frames(3))
    assert len(list(folder.iterdir())) == 3
    assert list(tmp_path.iterdir()) == [folder]


def test_a_folder_that_holds_something_else_is_not_touched(tmp_path):
    (tmp_path / "thesis.txt").write_text("years of work")
    with pytest.raises(FileError, match=r"holds 'thesis\.txt', which is no numbered picture"):
        write_video(tmp_path, frames(3))
    assert [entry.name for entry in tmp_path.iterdir()] == ["thesis.txt"]


def test_the_folder_is_made(tmp_path):
    path = tmp_path / "new" / "folder" / "run.mp4"
    write_video(path, frames(2))
    assert path.is_file()


@pytest.mark.parametrize("name", ["run.avi", "run.png", "run.mp4.txt"])
def test_an_unknown_format_is_refused(tmp_path, name):
    with pytest.raises(RenderError, match=r"use \.mp4, \.gif, \.webp, or a folder"):
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
@pytest.mark.parametrize("name", ["run.mp4", "run.gif", "run.webp", "run"])
def test_frames_that_do_not_fit_are_refused(tmp_path, name, wrong, message):
    with pytest.raises(RenderError, match=message):
        write_video(tmp_path / name, list(wrong))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("width", "height", "kept"), [(65, 48, (64, 48)), (64, 47, (64, 46)), (65, 47, (64, 46))]
)
def test_odd_sizes_lose_a_row_or_column_and_it_is_reported(tmp_path, caplog, width, height, kept):
    path = tmp_path / "run.mp4"
    done = write_video(path, frames(6, width, height))
    assert (done.width, done.height) == kept
    assert f"{width}x{height} is cut to {kept[0]}x{kept[1]}" in caplog.text
    _, pictures = read(path)
    for before, after in zip(frames(6, width, height), pictures, strict=True):
        cut = before[: kept[1], : kept[0]].astype(int)
        assert np.abs(cut - after).mean() < 6  # not scaled: the bar's edges are where they were


def test_a_single_column_is_too_small_for_h264(tmp_path):
    with pytest.raises(RenderError, match="at least 2x2 pixels, not 1x48"):
        write_video(tmp_path / "run.mp4", frames(2, 1, 48))


@pytest.mark.parametrize("fps", [0, -5, 0.009, 1001, float("nan"), float("inf")])
def test_a_rate_that_makes_no_sense_is_refused(tmp_path, fps):
    with pytest.raises(RenderError, match="fps"):
        write_video(tmp_path / "run.mp4", frames(2), fps=fps)


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


@pytest.mark.skipif(os.name == "nt", reason="kill ends a process without a word there")
@pytest.mark.parametrize("name", ["run.mp4", "run.gif", "run.webp", "run"])
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


@pytest.mark.parametrize("name", ["run.mp4", "run.gif", "run.webp", "run"])
def test_one_array_may_hold_all_frames(tmp_path, name):
    array = next(frames(1))

    def drawn():
        for frame in frames(20):
            array[:] = frame
            yield array

    write_video(tmp_path / name, drawn())
    write_video(tmp_path / "other" / name, frames(20))
    for one, other in zip(
        sorted((tmp_path / name).glob("*")) or [tmp_path / name],
        sorted((tmp_path / "other" / name).glob("*")) or [tmp_path / "other" / name],
        strict=True,
    ):
        assert one.read_bytes() == other.read_bytes()


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


@pytest.mark.skipif(os.name == "nt", reason="limits the size of files")
@pytest.mark.parametrize("most", [30, 100_000], ids=["at once", "on the way"])
@pytest.mark.parametrize("name", ["run.mp4", "run.gif", "run.webp", "run"])
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


@pytest.mark.skipif(sys.platform != "linux", reason="counts in Linux's kilobytes")
@pytest.mark.parametrize(
    "count", [1000, pytest.param(20_000, marks=pytest.mark.slow)], ids=["short", "long"]
)
@pytest.mark.parametrize(
    "name", few(["run.mp4", "run.gif", "run.webp", "run"], "run.mp4", "run.gif")
)
def test_memory_does_not_grow_with_the_length(tmp_path, name, count):
    command = [sys.executable, "-c", textwrap.dedent(GROWING), str(tmp_path / name), str(count)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=300)
    assert int(done.stdout) < 4_000  # kilobytes; all frames would be 57 MB or 1.1 GB


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
