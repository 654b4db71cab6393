"""How much work goes into a picture: `draft`, `normal` or `high`.

`normal` is what the model's own `<visual><quality>` says, so that an edit there shows. `draft`
takes from it whatever costs time, `high` draws everything several times as large and reduces it.
"""

from dataclasses import dataclass
from typing import Final, Literal, get_args

import mujoco

from mjcartpole.errors import RenderError, check_known

Quality = Literal["draft", "normal", "high"]
"""Names of the levels, from the fastest to the finest."""

DEFAULT_QUALITY: Final[Quality] = "normal"

_LARGEST_BUFFER: Final = 4096 * 2304
"""Pixels that OpenGL may hold at several samples each: about 300 MB."""


@dataclass(frozen=True)
class Level:
    """What a quality means to those who draw.

    Attributes:
        plain: Leave out multisampling, shadows and reflections, whatever the file says.
        enlargement: OpenGL draws this many times as wide and high, and reduces.
        oversampling: The sketch draws this many times as wide and high, and reduces.
    """

    plain: bool
    enlargement: int
    oversampling: int

    def prepare(self, model: mujoco.MjModel) -> None:
        """Change a model's own visual settings to this level's."""
        if self.plain:
            model.vis.quality.offsamples = 0
            model.vis.quality.shadowsize = 0

    def fit(self, width: int, height: int) -> "Level":
        """This level for pictures of some size: very large ones are not enlarged further."""
        pixels = width * height * self.enlargement**2
        return self if pixels <= _LARGEST_BUFFER else Level(self.plain, 1, self.oversampling)


_LEVELS: Final = {
    "draft": Level(plain=True, enlargement=1, oversampling=2),
    "normal": Level(plain=False, enlargement=1, oversampling=4),
    "high": Level(plain=False, enlargement=2, oversampling=8),
}


def level_of(quality: Quality) -> Level:
    """The level of a name.

    Raises:
        RenderError: There is no such quality.
    """
    check_known("quality", quality, get_args(Quality), RenderError)
    return _LEVELS[quality]
