"""Angle limits: within which the pole may lean, as a faint fan at its hinge.

It is a decoration of the picture, not of the model: any cart-pole has it, an edited one has it in
the right place, and the physics knows nothing of it.
"""

import math
from dataclasses import dataclass
from typing import Final

import mujoco
import numpy as np
import numpy.typing as npt

from mjcartpole.physics.bodies import pole_bodies
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.structure import cross
from mjcartpole.task import CARTPOLE_V1, Task

Points = npt.NDArray[np.float64]

_COLOUR: Final = (0.42, 0.52, 0.62)
_INSIDE: Final = 0.14
_EDGE: Final = 0.55
_EDGE_ANGLE: Final = 0.008
_SLICE: Final = 0.11
_LENGTH: Final = 1.06
"""The fan's radius in lengths of the pole, so that its rim shows behind the tip."""

_CORNERS: Final = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, 8).T


@dataclass(frozen=True)
class Wedge:
    """A part of the fan.

    Attributes:
        corners: The hinge, then the rim; in the world, m, shape (n, 3).
        normal: The hinge's axis, about which the rim goes from its first to its last corner,
            shape (3,).
        rgba: Colour and opacity, 0 to 1, shape (4,).
    """

    corners: Points
    normal: Points
    rgba: npt.NDArray[np.float32]


class Fan:
    """Where a task's limits of one pole's angle are, for one state after the other."""

    def __init__(self, cartpole: CartPole, pole: int = 0, task: Task = CARTPOLE_V1) -> None:
        model = cartpole.model
        self._joint = cartpole.hinges[pole]
        self._body = int(model.jnt_bodyid[self._joint])
        self._geoms = np.flatnonzero(np.isin(model.geom_bodyid, pole_bodies(cartpole, pole)))
        self._aabb = model.geom_aabb[self._geoms]
        self._spans = _spans(task.theta_limit)

    def wedges(self, data: mujoco.MjData) -> list[Wedge]:
        """Return the fan's parts; none where the pole has no length to be seen, or no limit.

        It lies in the plane in which the pole's centre of mass moves, so that perspective shows
        both alike.
        """
        anchor, axis = data.xanchor[self._joint], data.xaxis[self._joint]
        arm = data.xipos[self._body] - anchor
        centre = anchor + axis * (axis @ arm)
        arm = arm - axis * (axis @ arm)
        length = float(np.linalg.norm(arm))
        if length < 1e-6 or not len(self._geoms) or not self._spans:
            return []
        along = arm / length
        radius = _LENGTH * self._reach(data, centre, along)
        arms = radius * np.array([along, cross(axis, along)])
        theta = float(data.qpos[self._joint])
        wedges = []
        for angles, rgba in self._spans:
            turned = angles - theta
            rim = np.array([np.cos(turned), np.sin(turned)]).T @ arms
            wedges.append(Wedge(np.concatenate([[centre], centre + rim]), axis.copy(), rgba))
        return wedges

    def _reach(self, data: mujoco.MjData, centre: Points, along: Points) -> float:
        """How far the pole's geoms go from the hinge, m."""
        corners = box_corners(self._aabb, data.geom_xpos[self._geoms], data.geom_xmat[self._geoms])
        return max(0.0, float(((corners - centre) @ along).max()))


def box_corners(aabb: Points, position: Points, turn: Points) -> Points:
    """Corners in the world of boxes around geoms, shape (n, 8, 3).

    Of each box, `aabb` has centre and half sizes in the geom's frame, shape (n, 6); the geoms have
    positions, shape (n, 3), and rotation matrices, shape (n, 9).
    """
    local = aabb[:, None, :3] + _CORNERS * aabb[:, None, 3:]
    corners: Points = local @ turn.reshape(-1, 3, 3).transpose(0, 2, 1) + position[:, None]
    return corners


def _spans(limit: float) -> list[tuple[Points, npt.NDArray[np.float32]]]:
    """Return angles and colour of each part; none for a pole that may lean to any side."""
    if not limit < math.pi:
        return []
    edge = limit + _EDGE_ANGLE
    return [
        (_arc(-limit, limit), _rgba(_INSIDE)),
        (_arc(-edge, -limit), _rgba(_EDGE)),
        (_arc(limit, edge), _rgba(_EDGE)),
    ]


def _arc(start: float, end: float) -> Points:
    return np.linspace(start, end, 2 + int((end - start) / _SLICE))


def _rgba(opacity: float) -> npt.NDArray[np.float32]:
    return np.array([*_COLOUR, opacity], dtype=np.float32)


EDGE_RGBA: Final = _rgba(_EDGE)
"""What a limit is drawn in."""
