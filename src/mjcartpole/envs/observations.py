"""Observations: the state, or one that has cosine and sine in place of an angle."""

from collections.abc import Callable
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from mjcartpole.errors import check_known
from mjcartpole.physics.simulation import Simulation
from mjcartpole.task import Task

Observed = npt.NDArray[np.float32]

Observation = Literal["state", "trig"]
"""`state`: x, x_dot, and of each pole theta, theta_dot. `trig`: x, x_dot, and of each pole
cos theta, sin theta, theta_dot, which do not jump where a pole turns right round."""


def observation_space(task: Task, poles: int, kind: Observation = "state") -> spaces.Box:
    """Return the space of one environment's observations.

    Raises:
        ConfigError: There is no such kind.
    """
    check_known("observation", kind, get_args(Observation))
    bound = task.observation_bound(poles)
    if kind == "trig":
        bound = np.array([*bound[:2], *[1.0, 1.0, np.inf] * poles], np.float32)
    return spaces.Box(-bound, bound, dtype=np.float32)


def observed(states: npt.NDArray[np.float64], task: Task, kind: Observation) -> Observed:
    """Return the observations of states, float32, one for each row."""
    seen = with_cosines(states) if kind == "trig" else task.seen(states)
    return seen.astype(np.float32)


def observer(simulation: Simulation, task: Task, kind: Observation) -> Callable[[], Observed]:
    """Return what observes a simulation."""
    return lambda: observed(simulation.state, task, kind)


def with_cosines(states: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return states, shape (..., 2 + 2 poles), with cosines and sines: shape (..., 2 + 3 poles).

    >>> with_cosines(np.array([1.0, 2.0, 0.0, 3.0]))
    array([1., 2., 1., 0., 3.])
    """
    found = np.empty((*states.shape[:-1], states.shape[-1] * 3 // 2 - 1))
    found[..., :2], angles = states[..., :2], states[..., 2::2]
    found[..., 2::3], found[..., 3::3] = np.cos(angles), np.sin(angles)
    found[..., 4::3] = states[..., 3::2]
    return found
