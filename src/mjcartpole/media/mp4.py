"""Frames into an mp4: H.264 by PyAV, whose wheel brings FFmpeg's libraries and x264."""

import contextlib
import functools
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from mjcartpole.errors import RenderError
from mjcartpole.files import brief
from mjcartpole.media.frames import Frame

if TYPE_CHECKING:
    import av
    from av.video.stream import VideoStream

CODEC: Final = "libx264"

# Visually lossless; slower presets would make files smaller, and drawing wait. x264's macroblock
# tree would as well, but reads memory that nobody wrote, so that no two films are the same bytes.
_LOOK: Final = {"preset": "veryfast", "crf": "22", "mbtree": "0"}
# The colours are converted and labelled as BT.709, so that players need not guess.
_LABELS: Final = {
    "color_range": "tv",
    "colorspace": "bt709",
    "color_primaries": "bt709",
    "color_trc": "bt709",
}
_MOST_TICKS: Final = 65_535


@functools.cache
def why_no_mp4() -> str:
    """Return why no mp4 can be written here, in one clause; empty if one can."""
    try:
        import av  # noqa: PLC0415 - it takes a moment, and only an mp4 needs it

        av.Codec(CODEC, "w")
    except ImportError as error:
        return f"PyAV cannot be imported: {brief(error)}"
    except ValueError:
        return f"PyAV {av.__version__} was built without {CODEC}"
    return ""


def even(size: tuple[int, int]) -> tuple[int, int]:
    """Return the size that H.264 keeps: it stores colours for blocks of 2 by 2 pixels."""
    width, height = size
    return width - width % 2, height - height % 2


def write_mp4(path: Path, frames: Iterator[Frame], fps: float) -> int:
    """Write frames as H.264 with 4:2:0 colours, with the index first; returns their number.

    PyAV itself and not imageio's plugin, which keeps the codec's options and the colours'
    conversion to itself. Pictures have one size, and lose their last row or column if that is odd;
    the file's name needs no suffix.

    Raises:
        RenderError: The encoder fails.
        OSError: The file cannot be written.
    """
    import av  # noqa: PLC0415 - see `why_no_mp4`

    count, stream = 0, None
    try:
        with _container(path) as container:
            for picture in _converted(frames):
                stream = stream or _stream(container, picture, fps)
                container.mux(stream.encode(picture))
                count += 1
            if stream is not None:
                container.mux(stream.encode(None))
    except av.FFmpegError as error:
        if isinstance(error, OSError):
            raise
        raise RenderError(f"{CODEC} fails: {error.strerror}") from error
    return count


def _converted(frames: Iterator[Frame]) -> "Iterator[av.VideoFrame]":
    """Yield frames as H.264 takes them."""
    import av  # noqa: PLC0415
    from av.video.reformatter import ColorRange, Colorspace, VideoReformatter  # noqa: PLC0415

    converter = VideoReformatter()
    for frame in frames:
        width, height = even((frame.shape[1], frame.shape[0]))
        pixels = np.ascontiguousarray(frame[:height, :width])
        # One thread: a pool of them would outlive the film, and be lost in a fork.
        yield converter.reformat(
            av.VideoFrame.from_ndarray(pixels, format="rgb24"),
            format="yuv420p",
            dst_colorspace=Colorspace.ITU709,
            dst_color_range=ColorRange.MPEG,
            threads=1,
        )


@contextlib.contextmanager
def _container(path: Path) -> "Iterator[av.container.OutputContainer]":
    """Yield an mp4 to be filled; afterwards it is complete, or closed as it is."""
    import av  # noqa: PLC0415

    # faststart: the index comes first, so that a browser can play before it has all.
    # file: for FFmpeg a bare name could mean a protocol, such as concat:.
    container = av.open(f"file:{path}", "w", format="mp4", options={"movflags": "+faststart"})
    try:
        yield container
    except BaseException:
        # Closing fails as well where the disk is full; what came first says why.
        with contextlib.suppress(av.FFmpegError):
            container.close()
        raise
    container.close()


def _stream(
    container: "av.container.OutputContainer", picture: "av.VideoFrame", fps: float
) -> "VideoStream":
    """Add the one stream of a film of pictures like this one."""
    rate = 1 / Fraction(1 / fps).limit_denominator(_MOST_TICKS)
    stream = container.add_stream(CODEC, rate, options={**_LOOK, **_LABELS})
    stream.width, stream.height = picture.width, picture.height
    stream.pix_fmt = picture.format.name
    return stream
