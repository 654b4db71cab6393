"""What happens, written into the picture: a strip with numbers, and an arrow at the cart."""

import math
from typing import Final

import numpy as np

from mjcartpole.errors import RenderError
from mjcartpole.media.hud import Moment, Strip
from mjcartpole.media.palette import ACTION, Colour
from mjcartpole.media.pillow import Image, ImageDraw
from mjcartpole.media.scene import Box, Scene
from mjcartpole.media.text import Pixels

_SHORTEST_ARROW: Final = 14
_MOST_ARROWS: Final = 100
_OVERSAMPLING: Final = 4
_ARROW_WIDTH: Final = 0.54
# Along and across an arrow that points to +x and is 1 long.
_ARROW: Final = np.array(
    [(-0.5, -0.08), (0, -0.08), (0, -0.27), (0.5, 0), (0, 0.27), (0, 0.08), (-0.5, 0.08)]
)


class Overlay:
    """Writes moments into a renderer's frames.

    >>> with open_renderer(cartpole) as renderer:  # doctest: +SKIP
    ...     overlay = Overlay(renderer.scene)
    ...     frame = overlay.draw(renderer.render(moment.state), moment)
    """

    def __init__(self, scene: Scene) -> None:
        """Lay out the strip for a scene's pictures."""
        self._scene = scene
        self._strip = Strip(scene.width, scene.height, scene.cartpole.poles)
        self._top: int | None = None
        self._arrows: dict[tuple[int, int], Pixels] = {}

    def draw(self, frame: Pixels, moment: Moment) -> Pixels:
        """Write a moment into the frame that the scene's renderer has drawn last, and return it.

        Raises:
            RenderError: The frame has another size than the scene's pictures.
        """
        if frame.shape != (self._scene.height, self._scene.width, 3):
            raise RenderError(
                f"the overlay is for pictures of {self._scene.width}x{self._scene.height} pixels, "
                f"not for an array of shape {frame.shape}"
            )
        cart = self._scene.cart_box()
        strip = self._strip.show(moment)
        if self._top is None:
            self._top = self._place(cart, len(strip))
        frame[self._top : self._top + len(strip)] = strip
        if moment.action is not None and cart is not None:
            self._draw_arrow(frame, cart, moment.action)
        return frame

    def _place(self, cart: Box | None, height: int) -> int:
        """The strip's first row: below the cart, unless the pole hangs there."""
        whole = self._scene.height
        moving = self._scene.moving_box()
        if cart is None or moving is None:
            return whole - height
        # The box of all that moves goes farther to the side on which the pole is.
        above, below = cart[1] - moving[1], moving[3] - cart[3]
        return whole - height if above >= below else 0

    def _draw_arrow(self, frame: Pixels, cart: Box, action: int) -> None:
        left, top, right, bottom = cart
        sign = 1 if action == 1 else -1
        across, down = (sign * self._scene.push_direction()).tolist()
        # Steps of a few degrees, so that a moving camera needs few arrows.
        degrees = 3 * round(math.degrees(math.atan2(down, across)) / 3)
        # Below the cart, as large as the cart, or as there is room for between it and the strip.
        floor = self._top if self._top else self._scene.height
        length = min(round(1.2 * (right - left)), self._scene.width // 4)
        length = max(length, self._scene.height // 16)
        length = max(min(length, int((floor - bottom) / _ARROW_WIDTH) - 4), _SHORTEST_ARROW)
        arrow = self._arrow(degrees, length)
        height, width = arrow.shape
        start = min(max((left + right - width) // 2, 0), frame.shape[1] - width)
        _blend(frame, arrow, start, min(bottom + (bottom - top) // 2, floor - height), ACTION)

    def _arrow(self, degrees: int, length: int) -> Pixels:
        """How much of each pixel an arrow covers, 0 to 255, shape (height, width)."""
        if len(self._arrows) > _MOST_ARROWS:
            self._arrows.clear()
        if (degrees, length) not in self._arrows:
            self._arrows[degrees, length] = _draw_arrow(degrees, length)
        return self._arrows[degrees, length]


def _blend(frame: Pixels, cover: Pixels, left: int, top: int, colour: Colour) -> None:
    """Paint a colour where something covers a part of the frame; cut at the frame's edges."""
    height, width = cover.shape
    rows, columns = slice(max(0, top), top + height), slice(max(0, left), left + width)
    part = frame[rows, columns]
    cover = cover[rows.start - top :, columns.start - left :][: part.shape[0], : part.shape[1]]
    share = cover[..., None].astype(np.uint16)
    part[:] = (part * (255 - share) + np.array(colour, np.uint16) * share + 127) // 255


def _draw_arrow(degrees: int, length: int) -> Pixels:
    """An arrow in a square, clockwise from pointing right; shape (height, width)."""
    turn = math.radians(degrees)
    along, across = (math.cos(turn), math.sin(turn)), (-math.sin(turn), math.cos(turn))
    corners = _ARROW @ np.array([along, across]) * length
    low, high = np.floor(corners.min(axis=0)), np.ceil(corners.max(axis=0))
    width, height = (int(side) + 2 for side in high - low)
    image = Image.new("L", (width * _OVERSAMPLING, height * _OVERSAMPLING))
    points = (corners - low + 1) * _OVERSAMPLING
    ImageDraw.Draw(image).polygon(points.ravel().tolist(), fill=255)
    return np.array(image.reduce(_OVERSAMPLING))
