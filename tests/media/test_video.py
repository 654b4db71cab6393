"""Videos: what is written is what was drawn, in every format."""

import av
import numpy as np
import pytest
from PIL import Image

from films import frames
from mjcartpole.errors import FileError, RenderError
from mjcartpole.media.video import Video, write_video

AVCOL_RANGE_MPEG = AVCOL_SPC_BT709 = AVCOL_PRI_BT709 = AVCOL_TRC_BT709 = 1
"""FFmpeg's numbers."""


def read(path):
    """What a video's stream says of itself, and its frames, shape (n, height, width, 3)."""
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        colours = stream.color_range, stream.colorspace, stream.color_primaries, stream.color_trc
        said = stream.codec.name, stream.pix_fmt, stream.average_rate, colours
        pictures = [frame.to_ndarray(format="rgb24") for frame in container.decode(stream)]
    return said, np.array(pictures)


def count_and_seconds(path):
    """How many frames a video has, and how long it lasts."""
    with av.open(str(path)) as container:
        frames = list(container.decode(video=0))
    return len(frames), float((frames[-1].pts + frames[-1].duration) * frames[-1].time_base)


def test_a_video_is_h264_with_the_right_size_rate_and_length(tmp_path):
    path = tmp_path / "run.mp4"
    assert write_video(path, frames(25, 66, 50)) == Video(path, 25, 66, 50, 50)
    said, pictures = read(path)
    bt709 = AVCOL_RANGE_MPEG, AVCOL_SPC_BT709, AVCOL_PRI_BT709, AVCOL_TRC_BT709
    assert said == ("h264", "yuv420p", 50, bt709)
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
