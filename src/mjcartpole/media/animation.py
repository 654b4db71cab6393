"""Frames into an animated picture, GIF or WebP, one at a time.

Pillow's own writers collect every frame before they write the first. Here Pillow compresses single
pictures, and the few bytes around them are written here, so that memory does not grow with the
length. Of each frame only the rectangle that has changed is stored.
"""

import io
import itertools
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import numpy as np

from mjcartpole.errors import RenderError
from mjcartpole.media.frames import Frame
from mjcartpole.media.pillow import GifImagePlugin, Image

Box = tuple[int, int, int, int]
"""Left, top, right, bottom in pixels; the last two are outside."""

GIF_MOST_FPS: Final = 50
"""GIF counts in hundredths of a second, and browsers slow down anything shorter than two."""

WEBP_MOST_FPS: Final = 90
"""WebP counts in milliseconds; browsers slow down what is not longer than ten."""

_GIF_MOST_PIXELS: Final = 65_535
_WEBP_MOST_PIXELS: Final = 16_383
_WEBP_MOST_BYTES: Final = 2**32 - 2
_ROUNDING: Final = 1e-6
"""More than what a quotient of two frame rates can be off by, in frames."""
_SEEN: Final = 25
_SEEN_EVERY: Final = 4


def write_gif(path: Path, frames: Iterator[Frame], fps: float) -> int:
    """Write an endless GIF of pictures of one size, (height, width, 3); returns how many are in it.

    A frame's end is rounded to GIF's ticks of 10 ms, so that the length is right in total; what
    comes faster than 50 frames per second is thinned out to that.

    Raises:
        RenderError: The pictures are too large for the format.
    """
    seen = list(itertools.islice(frames, _SEEN))
    _check_size(seen[0], _GIF_MOST_PIXELS, "GIF")
    palette = _common_palette(seen[::_SEEN_EVERY])
    count = 0
    with path.open("wb") as file:
        for before, frame, ticks in _paced(itertools.chain(seen, frames), fps, GIF_MOST_FPS, 100):
            box = changed_box(before, frame)
            picture = Image.fromarray(_cut(frame, box))
            indexed = picture.quantize(palette=palette, dither=Image.Dither.NONE)
            if before is None:
                header, _ = GifImagePlugin.getheader(indexed, info={"loop": 0})
                file.writelines(header)
            file.writelines(GifImagePlugin.getdata(indexed, box[:2], duration=10 * ticks))
            count += 1
        file.write(b";")
    return count


def write_webp(path: Path, frames: Iterator[Frame], fps: float) -> int:
    """Write an endless WebP without loss, of pictures of one size; returns how many are in it.

    A frame's end is rounded to milliseconds, so that the length is right in total; what comes
    faster than 90 frames per second is thinned out to that.

    Raises:
        RenderError: The pictures, or all of them together, are too large for the format.
    """
    count = 0
    with path.open("wb") as file:
        for before, frame, milliseconds in _paced(frames, fps, WEBP_MOST_FPS, 1000):
            if before is None:
                _check_size(frame, _WEBP_MOST_PIXELS, "WebP")
                file.write(_webp_header(frame.shape[1], frame.shape[0]))
            file.write(_webp_frame(frame, changed_box(before, frame, grid=2), milliseconds))
            count += 1
        length = file.tell() - 8
        if length > _WEBP_MOST_BYTES:
            raise RenderError("a WebP file holds at most 4 GB; use .mp4, or fewer frames")
        file.seek(4)
        file.write(struct.pack("<I", length))
    return count


def changed_box(before: Frame | None, frame: Frame, *, grid: int = 1) -> Box:
    """The smallest rectangle outside of which two frames are equal; one pixel if they are equal.

    Without a frame before, all has changed. Left and top are multiples of the grid.
    """
    height, width = frame.shape[:2]
    if before is None:
        return 0, 0, width, height
    different = before != frame
    rows = np.flatnonzero(different.reshape(height, -1).any(axis=1))
    if not len(rows):
        return 0, 0, 1, 1
    top, bottom = int(rows[0]), int(rows[-1]) + 1
    columns = np.flatnonzero(different[top:bottom].any(axis=0).any(axis=1))
    left, right = int(columns[0]), int(columns[-1]) + 1
    return left - left % grid, top - top % grid, right, bottom


def _cut(frame: Frame, box: Box) -> Frame:
    left, top, right, bottom = box
    return np.ascontiguousarray(frame[top:bottom, left:right])


def _paced(
    frames: Iterator[Frame], fps: float, most_fps: int, ticks_per_second: int
) -> Iterator[tuple[Frame | None, Frame, int]]:
    """Frames with the one shown before and the time that each is shown, in ticks."""
    before = None
    shown_fps = min(fps, most_fps)
    shown = 0
    for index, frame in enumerate(frames):
        if int(index * shown_fps / fps + _ROUNDING) < shown:
            continue
        start, end = (round(ticks_per_second * n / shown_fps) for n in (shown, shown + 1))
        yield before, frame, end - start
        before = frame
        shown += 1


def _check_size(frame: Frame, most: int, name: str) -> None:
    height, width = frame.shape[:2]
    if max(width, height) > most:
        raise RenderError(
            f"{name} takes at most {most} pixels in width and height, not {width}x{height}"
        )


def _common_palette(frames: list[Frame]) -> Image.Image:
    """One palette for all frames, made from the first ones: no flicker, and no second pass."""
    return Image.fromarray(np.concatenate(frames)).quantize(dither=Image.Dither.NONE)


def _webp_header(width: int, height: int) -> bytes:
    """The file's head, whose length is filled in at the end: animated, endless."""
    animated = 0x02
    extended = struct.pack("<I", animated) + _u24(width - 1) + _u24(height - 1)
    endless = struct.pack("<IH", 0, 0)
    return b"RIFF\0\0\0\0WEBP" + _chunk(b"VP8X", extended) + _chunk(b"ANIM", endless)


def _webp_frame(frame: Frame, box: Box, milliseconds: int) -> bytes:
    left, top, right, bottom = box
    still = io.BytesIO()
    Image.fromarray(_cut(frame, box)).save(still, "WEBP", lossless=True, quality=0, method=0)
    picture = still.getvalue()[12:]  # A still picture's own head is RIFF, its length, WEBP.
    numbers = (left // 2, top // 2, right - left - 1, bottom - top - 1, milliseconds)
    replace_what_was_there = b"\x02"
    return _chunk(b"ANMF", b"".join(map(_u24, numbers)) + replace_what_was_there + picture)


def _chunk(name: bytes, content: bytes) -> bytes:
    return name + struct.pack("<I", len(content)) + content + b"\0" * (len(content) % 2)


def _u24(number: int) -> bytes:
    return number.to_bytes(3, "little")
