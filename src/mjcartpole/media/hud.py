"""The strip of numbers in a picture with an overlay.

Blocks of two lines: the step and the return so far, the state with its units (one block more for
every two further poles), the two action values. The strip is kept from frame to frame, and only
what changes is written again.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from mjcartpole.media.palette import ACTION, FAINT, INK, LINE, PAPER, UNCHOSEN, Colour
from mjcartpole.media.text import Lettering, Pixels
from mjcartpole.task import state_names, wrapped

_SMALLEST_FONT: Final = 10
_FONT_PER_HEIGHT: Final = 1 / 32
_FONT_PER_WIDTH: Final = 1 / 40
_LARGEST_SHARE: Final = 0.25
"""Of the picture's height; where the strip would take more, there is no text."""


@dataclass(frozen=True)
class Moment:
    """What an overlay shows.

    Attributes:
        step: Control steps done.
        total: Return so far.
        state: `(x, x_dot, theta, theta_dot, …)`; m, m/s, rad, rad/s.
        action: 0 pushes to the left (-x), 1 to the right; None shows no arrow.
        values: The action values of the current cell, of action 0 and of action 1; None shows
            none.
    """

    step: int
    total: float
    state: Sequence[float] | npt.NDArray[np.float64]
    action: int | None = None
    values: tuple[float, float] | None = None


@dataclass(frozen=True)
class _Line:
    """A label, and the fields behind it with the widest text that each has room for."""

    label: str
    fields: tuple[tuple[str, str], ...]
    has_bar: bool = False


_Block = tuple[_Line, ...]
_PROGRESS: Final = (
    _Line("step", (("step", "00000"),)),
    _Line("return", (("return", "00000"),)),
)
_VALUES: Final = (
    _Line("left", (("value0", "-00.00"),), has_bar=True),
    _Line("right", (("value1", "-00.00"),), has_bar=True),
)
_CART: Final = ("+0.00 m", "+0.00 m/s")
_POLE: Final = ("+00.0°", "+000°/s")


def _blocks(poles: int) -> list[_Block]:
    """What the strip says, block by block."""
    names = state_names(poles)
    labels = ["cart", "pole"] if poles == 1 else ["cart", *(f"pole {n + 1}" for n in range(poles))]
    state = [
        _Line(label, tuple(zip(names[2 * row : 2 * row + 2], _POLE if row else _CART, strict=True)))
        for row, label in enumerate(labels)
    ]
    return [_PROGRESS, *(tuple(state[row : row + 2]) for row in range(0, len(state), 2)), _VALUES]


def _in_five_signs(total: float) -> str:
    """Return a return as exactly as its field has room for."""
    texts = (f"{total:g}", f"{total:.2f}", f"{total:.1f}", f"{total:.0f}")
    return next((text for text in texts if len(text) <= 5), texts[-1])


class Strip:
    """The strip of a picture of some size.

    Attributes:
        pixels: Shape (height, width, 3); of height 0 where there is no room for any text.
    """

    def __init__(self, width: int, height: int, poles: int = 1) -> None:
        self._names, self._blocks = state_names(poles), _blocks(poles)
        size = round(min(height * _FONT_PER_HEIGHT, width * _FONT_PER_WIDTH))
        self._text = Lettering(max(_SMALLEST_FONT, size))
        self._pitch = round(1.25 * self._text.height)
        self._pad = max(4, self._text.height // 2)
        self._bar_width = 4 * self._text.size
        self._fields: dict[str, Pixels] = {}
        self._bars: list[Pixels] = []
        self._shown: dict[str, tuple[str, Colour]] = {}
        self.pixels = self._lay_out(width)
        if len(self.pixels) > _LARGEST_SHARE * height or self._needed > width:
            self.pixels = self.pixels[:0]

    def show(self, moment: Moment) -> Pixels:
        """The strip for a moment; the array is the strip's own, and changes with the next one."""
        if not len(self.pixels):
            return self.pixels
        self._write("step", f"{moment.step:d}")
        self._write("return", _in_five_signs(moment.total))
        x, x_dot, *of_poles = (float(value) for value in moment.state)
        self._write("x", f"{x:+.2f} m")
        self._write("x_dot", f"{x_dot:+.2f} m/s")
        for index, value in enumerate(of_poles):
            if index % 2:
                text = f"{math.degrees(value):+.0f}°/s"
            else:
                text = f"{math.degrees(wrapped(value)):+.1f}°"
            self._write(self._names[2 + index], text)
        for action in (0, 1):
            self._show_value(action, moment)
        return self.pixels

    def _show_value(self, action: int, moment: Moment) -> None:
        """Write an action's value; its bar is as long as the value is to the larger of both."""
        is_chosen = moment.action == action
        bar = self._bars[action]
        bar[:] = PAPER
        if moment.values is None:
            self._write(f"value{action}", "")
            return
        value = float(moment.values[action])
        self._write(f"value{action}", _short(value), INK if is_chosen else FAINT)
        largest = max(abs(float(other)) for other in moment.values)
        share = abs(value) / largest if 0 < largest < math.inf else 0.0
        bar[:, : round(share * bar.shape[1])] = ACTION if is_chosen else UNCHOSEN

    def _write(self, name: str, text: str, colour: Colour = INK) -> None:
        if self._shown.get(name) == (text, colour):
            return
        self._shown[name] = text, colour
        field = self._fields[name]
        field[:] = PAPER
        self._text.number(field, text, colour)

    def _lay_out(self, width: int) -> Pixels:
        """Place the blocks from left to right, in a further row where one has no room left."""
        free = width - 2 * self._pad - sum(self._block_width(block) for block in self._blocks)
        # Where it is narrow, the bars are the first to give way.
        gap = max(self._text.size, min(free // 2, 6 * self._text.size))
        self._bar_width = max(self._bar_width + min(0, free - 2 * gap), self._text.size)
        widths = [self._block_width(block) for block in self._blocks]
        self._needed = max(widths) + 2 * self._pad
        places, left, row = [], self._pad, 0
        for block_width in widths:
            if left > self._pad and left + block_width > width - self._pad:
                left, row = self._pad, row + 1
            places.append((left, self._pad + 2 * row * self._pitch))
            left += block_width + gap
        height = 2 * self._pad + (2 * row + 1) * self._pitch + self._text.height
        strip = np.full((height, width, 3), PAPER, np.uint8)
        strip[: max(1, self._text.size // 12)] = LINE
        for block, (left, top) in zip(self._blocks, places, strict=True):
            self._place_block(strip, block, left, top)
        return strip

    def _place_block(self, strip: Pixels, block: _Block, left: int, top: int) -> None:
        text = self._text
        for index, line in enumerate(block):
            row = strip[top + index * self._pitch :][: text.height]
            label = text.line(line.label, FAINT)
            part = row[:, left : left + label.shape[1]]
            part[:] = label[:, : part.shape[1]]
            start = left + self._label_width(block)
            for (name, _), width in zip(line.fields, self._field_widths(block), strict=True):
                self._fields[name] = row[:, start : start + width]
                start += width
            if line.has_bar:
                inset = text.height // 4
                start += text.size // 2
                self._bars.append(row[inset:-inset, start : start + self._bar_width])

    def _label_width(self, block: _Block) -> int:
        widths = [self._text.line(line.label).shape[1] for line in block]
        return int(max(widths))

    def _field_widths(self, block: _Block) -> list[int]:
        """Widths of the columns of fields, each with a gap on its left."""
        columns = zip(*(line.fields for line in block), strict=True)
        gap = self._text.size * 2 // 3
        return [gap + max(self._text.width(text) for _, text in column) for column in columns]

    def _block_width(self, block: _Block) -> int:
        bar = self._text.size // 2 + self._bar_width if block[0].has_bar else 0
        return self._label_width(block) + sum(self._field_widths(block)) + bar


def _short(value: float) -> str:
    """A number in at most six letters, if that is possible."""
    size = abs(value)
    return f"{value:.2f}" if size < 100 else f"{value:.1f}" if size < 1000 else f"{value:.3g}"
