"""Frames into a video file, streaming: memory does not grow with the length."""

import contextlib
import itertools
import logging
import os
import queue
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Final, NoReturn

from mjcartpole.errors import RenderError
from mjcartpole.files import atomic_write
from mjcartpole.media.frames import Frame, check_frame
from mjcartpole.media.mp4 import even, why_no_mp4, write_mp4
from mjcartpole.media.pictures import check_folder, replacing_folder, write_pictures

Writer = Callable[[Path, Iterator[Frame], float], int]
"""Writes frames, so many per second, into a file or folder; returns their number."""

FORMATS: Final = (".mp4", ".gif", ".webp")
"""What `write_video` writes, by the file's suffix; a path without one is a folder of png."""

DEFAULT_FPS: Final = 50
"""Frames per second of real time, since a control step takes 0.02 s."""

_LEAST_FPS: Final = 0.01
_MOST_FPS: Final = 1000
_ENDING: Final = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
_FRAMES_AHEAD: Final = 4
"""How many frames may wait for the encoder."""

_log = logging.getLogger("mjcartpole")


@dataclass(frozen=True)
class Video:
    """What was written.

    Attributes:
        path: The file, or the folder of pictures; not the one asked for where mp4 became gif.
        frames: How many it holds.
        width: Pixels; one less than the frames' where the codec takes no odd number.
        height: Pixels; likewise.
        fps: Frames per second; less than asked for where the format has a limit.
    """

    path: Path
    frames: int
    width: int
    height: int
    fps: float


def write_video(
    path: str | os.PathLike[str], frames: Iterable[Frame], *, fps: float = DEFAULT_FPS
) -> Video:
    """Write frames as a video: H.264 for `.mp4`, an endless loop for `.gif` and `.webp`.

    A path without a suffix, or one that ends with `/`, is a folder for 000000.png, 000001.png, ….
    The file or folder appears when it is complete; if anything goes wrong, what was there stays.
    Whatever differs from what was asked for is in the result, and a line in the log.

    Args:
        path: Where to.
        frames: Pictures of shape (height, width, 3), uint8, all of one size. H.264 stores
            colours for blocks of 2 by 2 pixels: of odd sizes the last row or column is cut off.
        fps: Frames per second.

    Raises:
        RenderError: An unknown format, no frames, frames that do not fit, or a failing encoder.
        FileError: The file cannot be written, or a folder holds other things than pictures.
    """
    suffix = check_path(path)
    if not _LEAST_FPS <= fps <= _MOST_FPS:
        raise RenderError(
            f"fps {fps!r} makes no sense; use {_LEAST_FPS} to {_MOST_FPS} frames per second"
        )
    target = Path(path)
    if suffix == ".mp4" and (why := why_no_mp4()):
        suffix, target = ".gif", target.with_suffix(".gif")
        _log.warning("no mp4 (%s); writing '%s' instead", why, target)
    with _cleaned_up_by_signals():
        first, stream = _peek(frames)
        return _write(target, suffix, _checked(stream, first.shape), first.shape[1::-1], fps)


def check_path(path: str | os.PathLike[str]) -> str:
    """The suffix of the format that a path stands for; empty for a folder of pictures.

    Raises:
        RenderError: No such format can be written.
        FileError: It is a folder that holds other things than pictures.
    """
    text = os.fspath(path)
    suffix = "" if text.endswith(("/", os.sep)) else Path(path).suffix.lower()
    if suffix and suffix not in FORMATS:
        raise RenderError(
            f"'{text}' is no video format that can be written; use {', '.join(FORMATS)}, "
            "or a folder (no suffix) for numbered png"
        )
    if not suffix:
        check_folder(Path(path))
    return suffix


def _write(
    target: Path, suffix: str, frames: Iterator[Frame], size: tuple[int, int], fps: float
) -> Video:
    if not suffix:
        with replacing_folder(target) as folder:
            count = _in_background(write_pictures, folder, frames, fps)
        return Video(target, count, *size, fps)
    write, most = _writer(suffix)
    if suffix == ".mp4":
        size = _size_for_h264(*size)
    shown = _shown_fps(fps, most, suffix)
    with atomic_write(target) as temporary:
        count = _in_background(write, temporary, frames, fps)
    return Video(target, count, *size, shown)


def _writer(suffix: str) -> tuple[Writer, float]:
    """Return who writes a format, and how many frames per second it shows at most."""
    if suffix == ".mp4":
        return write_mp4, _MOST_FPS
    # Imported late: an mp4 needs no Pillow.
    from mjcartpole.media import animation  # noqa: PLC0415

    if suffix == ".gif":
        return animation.write_gif, animation.GIF_MOST_FPS
    return animation.write_webp, animation.WEBP_MOST_FPS


def _size_for_h264(width: int, height: int) -> tuple[int, int]:
    size = even((width, height))
    if min(size) == 0:
        raise RenderError(f"H.264 needs at least 2x2 pixels, not {width}x{height}")
    if size != (width, height):
        _log.warning(
            "H.264 needs an even width and height: %dx%d is cut to %dx%d", width, height, *size
        )
    return size


def _shown_fps(fps: float, most: float, suffix: str) -> float:
    if fps > most:
        _log.warning("%s shows at most %d frames per second: %g is thinned out", suffix, most, fps)
    return min(fps, most)


def _peek(frames: Iterable[Frame]) -> tuple[Frame, Iterator[Frame]]:
    stream = iter(frames)
    first = next(stream, None)
    if first is None:
        raise RenderError("a video needs at least one frame; none came")
    check_frame(first, "frame 0", first.shape, "frames of a video")
    return first, itertools.chain([first], stream)


def _checked(frames: Iterator[Frame], shape: tuple[int, ...]) -> Iterator[Frame]:
    for index, frame in enumerate(frames):
        check_frame(frame, f"frame {index}", shape, "frames of a video")
        yield frame


class _StoppedError(Exception):
    """The frames have ended early."""


def _in_background(write: Writer, path: Path, frames: Iterator[Frame], fps: float) -> int:
    """Encode in a thread, while this one draws the next frame (OpenGL may need this one)."""
    waiting: queue.Queue[Frame | _StoppedError | None] = queue.Queue(_FRAMES_AHEAD)
    with ThreadPoolExecutor(1, "mjcartpole-video") as executor:
        writing = executor.submit(write, path, _taken(waiting), fps)
        end: _StoppedError | None = _StoppedError()
        try:
            for frame in frames:
                # A copy: whoever draws may use one array for all frames.
                if not _put(waiting, frame.copy(), writing):
                    break
            end = None
        finally:
            _put(waiting, end, writing)
    return writing.result()


def _taken(waiting: "queue.Queue[Frame | _StoppedError | None]") -> Iterator[Frame]:
    while (item := waiting.get()) is not None:
        if isinstance(item, _StoppedError):
            raise item
        yield item


def _put(
    waiting: "queue.Queue[Frame | _StoppedError | None]",
    item: Frame | _StoppedError | None,
    writing: "Future[int]",
) -> bool:
    """Hand something to the encoder; False if that has ended."""
    while not writing.done():
        with contextlib.suppress(queue.Full):
            waiting.put(item, timeout=0.1)
            return True
    return False


@contextlib.contextmanager
def _cleaned_up_by_signals() -> Iterator[None]:
    """Have `kill` and a closed terminal clean up as Ctrl-C does, where nobody else has a say."""

    def stop(number: int, _: FrameType | None) -> NoReturn:
        raise SystemExit(128 + number)

    main = threading.current_thread() is threading.main_thread()
    ending = [number for number in _ENDING if main and signal.getsignal(number) is signal.SIG_DFL]
    for number in ending:
        signal.signal(number, stop)
    try:
        yield
    finally:
        for number in ending:
            signal.signal(number, signal.SIG_DFL)
