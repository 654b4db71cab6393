"""Several pictures in one: films side by side, a contact sheet, the moments before a fall."""

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from mjcartpole.errors import RenderError
from mjcartpole.media.frames import check_frame
from mjcartpole.media.palette import FAINT, INK, LINE, PAPER, Colour
from mjcartpole.media.text import Lettering, Pixels

_SEPARATOR: Final = 2
"""Pixels between pictures: even, so that even pictures give an even whole, as H.264 wants."""

_SMALLEST_FONT: Final = 10
_FONT_PER_WIDTH: Final = 1 / 30
_MOST_COLUMNS: Final = 5


def side_by_side(
    streams: Sequence[Iterable[Pixels]], labels: Sequence[str], *, columns: int | None = None
) -> Iterator[Pixels]:
    """Films in a grid, each under its label, row by row; one new array per frame.

    It lasts as long as the longest film; one that has ended stands still at its last frame,
    paler. Frames are drawn one at a time: nothing is kept but the last one of each film. They have
    one size, (height, width, 3); a label that is too long is shortened in its middle. Without
    `columns`, the films in a row, the grid is about as wide as it is high.

    Raises:
        RenderError: No stream, not as many labels, an empty stream, or frames of several sizes.
    """
    films = [iter(stream) for stream in streams]
    shown = [next(film, None) for film in films]
    grid = _Grid(_of_one_size(shown), labels, _columns(len(shown), columns, square=True), INK)
    playing = [True] * len(films)
    current = [frame for frame in shown if frame is not None]
    while any(playing):
        yield grid.fill(_of_one_size(current))
        for index, film in enumerate(films):
            frame = next(film, None) if playing[index] else None
            if frame is not None:
                current[index] = frame
            elif playing[index]:
                playing[index] = False
                current[index] = _pale(current[index])


def sheet(
    frames: Sequence[Pixels], captions: Sequence[str], *, columns: int | None = None
) -> Pixels:
    """A contact sheet: frames of one size as one picture, row by row, each over its caption.

    Captions are such as `time_label(step)`. A row has `columns` frames, or five, or fewer where
    there are fewer.

    Returns:
        A picture of shape (rows * (height + caption), columns * width and separators, 3).

    Raises:
        RenderError: No frame, not as many captions, or frames of several sizes.
    """
    checked = _of_one_size(frames)
    across = _columns(len(frames), columns, square=False)
    return _Grid(checked, captions, across, FAINT, is_below=True).fill(checked)


def equally_spaced(total: int, count: int) -> list[int]:
    """Indices of `count` of `total` frames, or of all where there are fewer: first to last."""
    if count < 1 or total < 1:
        raise RenderError(f"no {count} frames can be chosen out of {total}; use 1 or more")
    return [round(place) for place in np.linspace(0, total - 1, min(count, total)).tolist()]


def last_seconds(
    total: int, *, seconds: float = 1.0, speed: float = 0.25, steps_per_second: float = 50.0
) -> npt.NDArray[np.float64]:
    """Where each frame of the slow ending of an episode of `total` states, one per step, lies.

    So many seconds of the end are shown, or all of a shorter episode, at a speed of control steps
    per frame: 0.25 shows it four times as slowly as one frame each.

    Returns:
        Places, in control steps since the start and not whole ones, the last state's among them;
        for `state_at`.
    """
    start = max(0.0, total - 1 - seconds * steps_per_second)
    return np.append(start + played(total - start, speed=speed)[:-1], total - 1.0)


def played(total: float, *, speed: float = 1.0) -> npt.NDArray[np.float64]:
    """Where in an episode of `total` states each frame lies when it is played at a speed.

    Returns:
        Places in control steps, from 0 to the last state's at most; for `state_at`.

    Raises:
        RenderError: The speed is no positive number.
    """
    if not 0 < speed < math.inf:
        raise RenderError(f"speed {speed!r} makes no sense; 0.25 is four times slower, 1 as it was")
    # A little more, so that rounding does not lose the last frame.
    return np.arange(0.0, (total - 1) / speed * (1 + 1e-12) + 1e-9) * speed


def state_at(states: npt.ArrayLike, place: float) -> npt.NDArray[np.float64]:
    """The state at a place between control steps: on a straight line from one row to the next.

    The place is in control steps since the first state.
    """
    table: npt.NDArray[np.float64] = np.asarray(states, dtype=np.float64)
    place = min(max(place, 0.0), len(table) - 1.0)
    before = min(int(place), max(len(table) - 2, 0))
    share = place - before
    if share == 0.0:
        return np.array(table[before])
    following: npt.NDArray[np.float64] = (1 - share) * table[before] + share * table[before + 1]
    return following


def time_label(step: float, control_step: float = 0.02) -> str:
    """The time of a control step, for people."""
    return f"{step * control_step:.2f} s"


class _Grid:
    """Places for pictures, with a label over or under each."""

    def __init__(
        self,
        frames: Sequence[Pixels],
        labels: Sequence[str],
        columns: int,
        colour: Colour,
        *,
        is_below: bool = False,
    ) -> None:
        if len(labels) != len(frames):
            raise RenderError(f"{len(frames)} pictures need as many labels, not {len(labels)}")
        height, width = frames[0].shape[:2]
        self._frame = height, width
        self._columns = columns
        text = Lettering(max(_SMALLEST_FONT, round(width * _FONT_PER_WIDTH)))
        # Even, as the separators are.
        self._label = 2 * round(0.8 * text.height)
        self._offset = 0 if is_below else self._label
        rows = math.ceil(len(frames) / columns)
        self._pitch = height + self._label + _SEPARATOR, width + _SEPARATOR
        size = rows * self._pitch[0] - _SEPARATOR, columns * self._pitch[1] - _SEPARATOR
        self._paper = np.full((*size, 3), PAPER, np.uint8)
        for row in range(1, rows):
            self._paper[row * self._pitch[0] - _SEPARATOR : row * self._pitch[0]] = LINE
        for column in range(1, columns):
            self._paper[:, column * self._pitch[1] - _SEPARATOR : column * self._pitch[1]] = LINE
        for index, label in enumerate(labels):
            self._write(text, index, label, height if is_below else 0, colour)

    def _corner(self, index: int) -> tuple[int, int]:
        row, column = divmod(index, self._columns)
        return row * self._pitch[0], column * self._pitch[1]

    def _write(self, text: Lettering, index: int, label: str, down: int, colour: Colour) -> None:
        line = text.fitted(label, self._frame[1] - 2 * (text.size // 2), colour)
        top, left = self._corner(index)
        top += down + (self._label - text.height) // 2
        left += (self._frame[1] - line.shape[1]) // 2
        self._paper[top : top + line.shape[0], left : left + line.shape[1]] = line

    def fill(self, frames: Sequence[Pixels]) -> Pixels:
        """A new picture with frames in the places."""
        picture = self._paper.copy()
        height, width = self._frame
        for index, frame in enumerate(frames):
            top, left = self._corner(index)
            top += self._offset
            picture[top : top + height, left : left + width] = frame
        return picture


def _of_one_size(frames: Sequence[Pixels | None]) -> list[Pixels]:
    """The frames, if there are some, all are there and all have one size."""
    if not frames:
        raise RenderError("a picture of several needs at least one; none came")
    for index, frame in enumerate(frames):
        if frame is None:
            raise RenderError(f"film {index} has no frame; each needs at least one")
    checked = [frame for frame in frames if frame is not None]
    for index, frame in enumerate(checked):
        check_frame(frame, f"picture {index}", checked[0].shape, "in a grid")
    return checked


def _columns(count: int, columns: int | None, *, square: bool) -> int:
    if columns is None:
        return min(count, math.ceil(math.sqrt(count)) if square else _MOST_COLUMNS) or 1
    if columns < 1:
        raise RenderError(f"{columns} columns make no sense; use 1 or more")
    return min(columns, count) or 1


def _pale(frame: Pixels) -> Pixels:
    """A frame halfway to paper."""
    return ((frame.astype(np.uint16) + np.array(PAPER, np.uint16)) // 2).astype(np.uint8)
