"""Track limits: how far the cart may go, as a faint post on either side where it is not usual.

Models have rails for CartPole-v1's limits, so those need no post. Like the fan, posts are no part
of the model.
"""

import math
from typing import Final

import mujoco
import numpy as np

from mjcartpole.media.angle_limits import EDGE_RGBA, Points, Wedge
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.structure import cross, directions
from mjcartpole.task import CARTPOLE_V1, Task

_HALF_WIDTH: Final = 0.01
_TALL: Final = 0.5
"""Metres; as much as half of CartPole-v1's pole."""


class Posts:
    """Where a task's limits of the cart's position are, for the hinge of the first pole."""

    def __init__(self, cartpole: CartPole, task: Task) -> None:
        self._slider, self._hinge = cartpole.slider, cartpole.hinges[0]
        self._up = np.asarray(directions(cartpole).up, dtype=np.float64)
        shown = math.isfinite(task.x_limit) and task.x_limit != CARTPOLE_V1.x_limit
        self._places = (-task.x_limit, task.x_limit) if shown else ()

    def wedges(self, data: mujoco.MjData) -> list[Wedge]:
        """Return a post for either limit; none where they are CartPole-v1's, or there are none."""
        along = data.xaxis[self._slider].copy()
        middle = data.xanchor[self._hinge] - data.qpos[self._slider] * along
        return [self._post(middle + place * along, along) for place in self._places]

    def _post(self, foot: Points, along: Points) -> Wedge:
        aside, tall = _HALF_WIDTH * along, _TALL * self._up
        corners = [foot - aside, foot + aside, foot + aside + tall, foot - aside + tall]
        return Wedge(np.array(corners), cross(along, self._up), EDGE_RGBA)
