"""Crisp text as small arrays, by the scalable font that comes with Pillow.

No system font is needed. Letters are drawn once and kept, so that a number that changes with
every frame costs a few copies.
"""

import bisect
import functools

import numpy as np
import numpy.typing as npt

from mjcartpole.media.palette import INK, PAPER, Colour
from mjcartpole.media.pillow import Image, ImageDraw, ImageFont

Pixels = npt.NDArray[np.uint8]


class Lettering:
    """Text of one size on paper of one colour.

    Attributes:
        size: Of the font, in pixels.
        height: Of a line, in pixels.
    """

    def __init__(self, size: int, paper: Colour = PAPER) -> None:
        self.size = size
        self._paper = paper
        self._font = ImageFont.load_default(size)
        self._top, bottom = self._font.getbbox("Ag|")[1], self._font.getbbox("Ag|")[3]
        self.height = int(bottom - self._top)
        self._letter = functools.cache(self._draw_letter)

    def width(self, number: str) -> int:
        """Pixels that a number takes."""
        return sum(self._letter(letter, INK).shape[1] for letter in number)

    def number(self, target: Pixels, number: str, colour: Colour = INK) -> None:
        """Write a number at the right end of a row; what has no room on the left is left out.

        Digits stand in cells of equal width, so that nothing jumps from frame to frame. The row is
        paper, shape (height, width, 3); any text will do, without kerning.
        """
        right = target.shape[1]
        for letter in reversed(number):
            cell = self._letter(letter, colour)
            left = right - cell.shape[1]
            if left < 0:
                return
            target[:, left:right] = cell
            right = left

    def line(self, text: str, colour: Colour = INK) -> Pixels:
        """A word or a line, with the font's own spacing, shape (height, width, 3)."""
        width = max(1, self._length(text))
        image = Image.new("RGB", (width, self.height), self._paper)
        ImageDraw.Draw(image).text((0, -self._top), text, font=self._font, fill=colour)
        return np.array(image)

    def fitted(self, text: str, width: int, colour: Colour = INK) -> Pixels:
        """A line no wider than some pixels; a longer text is shortened in its middle."""
        if self._length(text) > width:
            shorter = [_shortened(text, keep) for keep in range(len(text))]
            fits = bisect.bisect_right(shorter, width, key=self._length)
            text = shorter[max(0, fits - 1)]
        return self.line(text, colour)[:, :width]

    def _length(self, text: str) -> int:
        return round(self._font.getlength(text))

    def _draw_letter(self, letter: str, colour: Colour) -> Pixels:
        """One letter of a number. The font has no minus: it is the bar of the plus."""
        if letter != "-":
            return self.line(letter, colour)
        plus = self.line("+", colour)
        ink = np.abs(plus.astype(int) - self._paper).sum(axis=2)
        # The bar's rows are those in which the ink begins farthest to the left.
        is_bar = ink[:, np.flatnonzero(ink.any(axis=0))[1]] > ink.max() // 4
        plus[~is_bar] = self._paper
        return plus


def _shortened(text: str, keep: int) -> str:
    """A text without its middle: so many of its letters are left."""
    head, tail = (keep + 1) // 2, keep // 2
    return f"{text[:head]}...{text[len(text) - tail :]}"
