"""The palette: colours of everything that is written or plotted, red, green, blue, 0 to 255."""

from typing import Final

Colour = tuple[int, int, int]

INK: Final[Colour] = (38, 44, 54)
FAINT: Final[Colour] = (118, 126, 138)
LINE: Final[Colour] = (205, 210, 217)
GRID: Final[Colour] = (226, 229, 233)
PAPER: Final[Colour] = (252, 252, 253)
MISSING: Final[Colour] = (205, 208, 212)
"""Where there is no number."""

ACTION: Final[Colour] = (0, 146, 118)
"""Of the chosen action, in the strip and at the cart: far from those of pole, cart and stops."""
UNCHOSEN: Final[Colour] = (200, 206, 214)

CURVES: Final[tuple[Colour, ...]] = (
    (0, 114, 178), (213, 94, 0), (0, 158, 115), (204, 121, 167), (230, 159, 0), (86, 180, 233)
)  # fmt: skip
"""Okabe and Ito's, told apart by every kind of eye."""
