"""Experience: what a method learns from."""

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from mjcartpole.learning.discretizer import Floats, Ints

Rng: TypeAlias = np.random.Generator


class Transition(NamedTuple):
    """One step."""

    s: int
    """Row of the state."""
    a: int
    """Action."""
    r: float
    """Reward."""
    s_next: int
    """Row of the state after it."""
    terminated: bool
    """Whether the rules ended the episode: nothing comes after it."""
    over: bool
    """Whether the episode ended at all, by the rules or by the time limit."""


class Trajectory(NamedTuple):
    """One episode. Its arrays may be longer than it was."""

    states: Ints
    """Rows, from the first state to the last: steps + 1 of them."""
    actions: Ints
    """What was done in each but the last."""
    rewards: Floats
    """What it gave."""
    steps: int
    terminated: bool
    """Whether the rules ended it."""


Vector: TypeAlias = npt.NDArray[np.float64]
Dynamics: TypeAlias = Callable[[Vector, int], tuple[Vector, Vector, npt.NDArray[np.bool_]]]
"""What methods learn from that need no episode: from states, shape (n, 2 + 2 poles), and an action
to the next states, their rewards and whether the rules end the episode there, both shape (n,)."""
