"""Kinds of physics, as compiled code sees them: plain numbers, and arrays as their addresses."""

from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from mjcartpole.disturbances.effects import Effects
from mjcartpole.learning import fitted

Floats = npt.NDArray[np.float64]

State: TypeAlias = tuple[float, float, float, float]
"""`(x, x_dot, theta, theta_dot)`; of several poles, the largest sizes of the last two."""


class Rules(NamedTuple):
    """A `Task` as compiled code sees it, but for its reward."""

    x_limit: float
    theta_limit: float
    low: float
    width: float
    """Starting values lie in [low, low + width)."""
    time_limit: int
    turns: bool
    """Whether angles count from -pi to pi."""


class MujocoPhysics(NamedTuple):
    """A `Simulation`, which must outlive this, as compiled code sees it.

    Arrays are addresses here: Numba would count the references to each whenever this is passed on,
    which costs as much as a tenth of a step.
    """

    model: int
    """Of the mjModel."""
    data: int
    """Of the mjData, whose arrays follow."""
    qpos: int
    qvel: int
    ctrl: int
    applied: int
    """Forces beside the motor's."""
    joints: int
    """int64 indices of the cart's, then of each pole's, shape (1 + poles,)."""
    n_joints: int
    """How many joints these are."""
    left: float
    right: float
    """Controls of the two actions."""
    timestep: float
    substeps: int
    explicit: bool
    """Whether positions move by the old velocities (integrator `gym`)."""
    seen: int
    """Memory for the observation, shape (2 + 2 poles,)."""
    moved: int
    """Memory for positions, shape (1 + poles,)."""
    start: int
    """Where each joint starts, shape (1 + poles,); what is drawn is added."""


class GymPhysics(NamedTuple):
    """Gymnasium's CartPole-v1."""

    left: float
    right: float
    """N."""
    start: float
    """Angle at the start, rad; what is drawn is added."""


class Disturbed(NamedTuple):
    """Another physics, and what reality adds."""

    inner: Any
    effects: Effects
    memory: int
    """Of `actuate` and `sense`."""
    seen: int
    """Memory for the observation, and the last actions behind it."""
    rng: np.random.Generator


Physics: TypeAlias = MujocoPhysics | GymPhysics | fitted.Fitted | Disturbed
