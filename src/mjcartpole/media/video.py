"""Frames into a video file, streaming: memory does not grow with the length."""

import contextlib
import itertools
import os
import subprocess
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import IO, Final

import numpy as np
import numpy.typing as npt

from mjcartpole.errors import RenderError
from mjcartpole.files import replacing

Frame = npt.NDArray[np.uint8]
"""A picture of shape (height, width, 3): red, green, blue."""

FORMATS: Final = (".mp4", ".gif")
"""What `write_video` writes, by the file's suffix."""

DEFAULT_FPS: Final = 50
"""Frames per second of real time, since a control step takes 0.02 s."""

_GIF_COLOURS: Final = 64
# GIF counts in hundredths of a second, and browsers slow down anything shorter than two.
_SHORTEST_GIF_FRAME: Final = 2


def write_video(
    path: str | os.PathLike[str], frames: Iterable[Frame], *, fps: int = DEFAULT_FPS
) -> int:
    """Write frames as a video: H.264 for `.mp4`, an endless loop for `.gif`.

    The file appears when it is complete; if anything goes wrong, what was there stays.

    Args:
        path: Where to; the suffix chooses the format.
        frames: Pictures of shape (height, width, 3), uint8, all of one size. H.264 stores
            colours for blocks of 2 by 2 pixels, so both sizes have to be even.
        fps: Frames per second.

    Returns:
        The number of frames written.

    Raises:
        RenderError: An unknown format, no frames, frames that do not fit, or a failing encoder.
        FileError: The file cannot be written.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in FORMATS:
        raise RenderError(f"'{path}' is no video format that can be written; use .mp4 (or .gif)")
    if fps < 1:
        raise RenderError(f"fps {fps!r} makes no sense; use a number of frames per second from 1")
    first, stream = _peek(frames)
    checked = _checked(stream, first.shape)
    with replacing(path) as temporary:
        if suffix == ".gif":
            return _write_gif(temporary, checked, fps)
        return _write_mp4(temporary, checked, first.shape, fps)


def _peek(frames: Iterable[Frame]) -> tuple[Frame, Iterator[Frame]]:
    stream = iter(frames)
    first = next(stream, None)
    if first is None:
        raise RenderError("a video needs at least one frame; none came")
    return first, itertools.chain([first], stream)


def _checked(frames: Iterator[Frame], shape: tuple[int, ...]) -> Iterator[Frame]:
    for index, frame in enumerate(frames):
        if frame.ndim != 3 or frame.shape[2] != 3 or frame.dtype != np.uint8:
            raise RenderError(
                f"frame {index} is an array of shape {frame.shape} and {frame.dtype}; "
                "needed are (height, width, 3) and uint8"
            )
        if frame.shape != shape:
            raise RenderError(
                f"frame {index} is {frame.shape[1]}x{frame.shape[0]} pixels, the first one "
                f"{shape[1]}x{shape[0]}; all frames of a video have one size"
            )
        yield frame


def _write_mp4(path: Path, frames: Iterator[Frame], shape: tuple[int, ...], fps: int) -> int:
    if len(shape) == 3 and (shape[0] % 2 or shape[1] % 2):
        raise RenderError(
            f"H.264 needs an even width and height, not {shape[1]}x{shape[0]}; "
            f"use {shape[1] + shape[1] % 2}x{shape[0] + shape[0] % 2}"
        )
    count = 0
    with _encoder(path, shape, fps) as pipe:
        for frame in frames:
            pipe.write(np.ascontiguousarray(frame).data)
            count += 1
    return count


@contextlib.contextmanager
def _encoder(path: Path, shape: tuple[int, ...], fps: int) -> Iterator[IO[bytes]]:
    """Yield ffmpeg's input; afterwards the file is complete, or ffmpeg is gone."""
    with tempfile.TemporaryFile() as messages:
        process = _start(_command(path, shape, fps), messages)
        assert process.stdin is not None
        try:
            # ffmpeg closes its input when it fails; its exit code and message say why.
            with contextlib.suppress(BrokenPipeError):
                yield process.stdin
        except BaseException:
            process.kill()
            raise
        finally:
            with contextlib.suppress(BrokenPipeError):
                process.stdin.close()
            process.wait()
        if process.returncode != 0:
            messages.seek(0)
            raise RenderError(f"ffmpeg failed: {_last_line(messages.read())}")


def _start(command: list[str], messages: IO[bytes]) -> subprocess.Popen[bytes]:
    try:
        return subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=messages,
            # Ctrl-C is for this process, which then ends ffmpeg itself.
            start_new_session=True,
        )
    except OSError as error:
        raise RenderError(f"ffmpeg cannot be run ('{command[0]}'): {error.strerror}") from error


def _command(path: Path, shape: tuple[int, ...], fps: int) -> list[str]:
    height, width = shape[:2]
    source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", str(fps)]
    # The colours are converted and labelled as BT.709, so that players need not guess.
    labels = "colorspace=bt709:color_primaries=bt709:color_trc=bt709:range=tv"
    colours = [
        "-vf",
        f"scale=out_color_matrix=bt709:out_range=tv,format=yuv420p,setparams={labels}",
    ]
    codec = ["-c:v", "libx264", "-preset", "veryfast", "-crf", "18"]
    # faststart: the index comes first, so that a browser can play before it has all.
    target = ["-movflags", "+faststart", "-f", "mp4", str(path)]
    quiet = ["-hide_banner", "-loglevel", "error", "-nostdin", "-y"]
    return [_ffmpeg(), *quiet, *source, "-i", "-", "-an", *colours, *codec, *target]


def _ffmpeg() -> str:
    # Imported late: training without a video must not wait for it.
    from imageio.plugins import ffmpeg  # noqa: PLC0415

    try:
        return str(ffmpeg.get_exe())  # type: ignore[no-untyped-call]
    except RuntimeError as error:
        raise RenderError(f"no ffmpeg was found: {error}; pip install 'imageio[ffmpeg]'") from error


def _last_line(messages: bytes) -> str:
    lines = messages.decode(errors="replace").strip().splitlines()
    return lines[-1] if lines else "it gave no reason"


def _write_gif(path: Path, frames: Iterator[Frame], fps: int) -> int:
    from PIL import Image  # noqa: PLC0415

    count = 0

    def images() -> Iterator[Image.Image]:
        nonlocal count
        palette: Image.Image | None = None
        for frame in frames:
            count += 1
            image = Image.fromarray(frame)
            # The first frame's palette for all: no flicker, a smaller file, and one pass.
            palette = palette or image.quantize(_GIF_COLOURS, dither=Image.Dither.NONE)
            yield image.quantize(palette=palette, dither=Image.Dither.NONE)

    stream = images()
    duration = 10 * max(round(100 / fps), _SHORTEST_GIF_FRAME)
    # Pillow closes a file that it opened only after some kinds of errors.
    with path.open("wb") as file:
        next(stream).save(
            file, "GIF", save_all=True, append_images=stream, duration=duration, loop=0
        )
    return count
