"""Which bodies of a model are the cart's, and which each pole's."""

from typing import Protocol

import mujoco
import numpy as np


class HasJoints(Protocol):
    """A compiled model whose joints have been found."""

    @property
    def model(self) -> mujoco.MjModel:
        """The compiled model."""

    @property
    def slider(self) -> int:
        """Index of the cart's joint."""

    @property
    def hinges(self) -> tuple[int, ...]:
        """Index of each pole's joint."""


def subtree(model: mujoco.MjModel, root: int) -> list[int]:
    """Return a body and all below it; parents come before their children."""
    inside = [root]
    for body in range(root + 1, model.nbody):
        if int(model.body_parentid[body]) in inside:
            inside.append(body)
    return inside


def moving_bodies(parts: HasJoints) -> list[int]:
    """Return every body that slides, the poles' included."""
    return _under(parts, parts.slider)


def cart_bodies(parts: HasJoints) -> list[int]:
    """Return every body that slides and does not turn."""
    turning = {body for hinge in parts.hinges for body in _under(parts, hinge)}
    return [body for body in moving_bodies(parts) if body not in turning]


def pole_bodies(parts: HasJoints, pole: int = 0) -> list[int]:
    """Return all bodies that turn on a pole's hinge, without those of a pole that stands on it."""
    hinge = parts.hinges[pole]
    whole = _under(parts, hinge)
    # MuJoCo counts joints from the cart outwards.
    above = [
        other
        for other in parts.hinges
        if other > hinge and int(parts.model.jnt_bodyid[other]) in whole
    ]
    upper = {body for other in above for body in _under(parts, other)}
    return [body for body in whole if body not in upper]


def farthest_from_origin(parts: HasJoints) -> float:
    """Return how far what moves stands from the world's origin when all coordinates are 0, m."""
    data = mujoco.MjData(parts.model)
    data.qpos[:] = 0.0
    mujoco.mj_kinematics(parts.model, data)
    joints = [parts.slider, *parts.hinges]
    places = np.concatenate([data.xipos[moving_bodies(parts)], data.xanchor[joints]])
    return float(np.abs(places).max())


def mass_of(model: mujoco.MjModel, bodies: list[int]) -> float:
    """Return mass of bodies together, kg."""
    return float(sum(float(model.body_mass[body]) for body in bodies))


def _under(parts: HasJoints, joint: int) -> list[int]:
    return subtree(parts.model, int(parts.model.jnt_bodyid[joint]))
