"""Action preferences: what methods share that learn a softmax policy, and the values of states.

Sutton and Barto (2018), sections 13.1 and 13.4. In state s an action a has probability

    pi(a | s) = exp h(s, a) / sum_b exp h(s, b)

and a state's value v(s) is the baseline that an action has to do better than. Preferences are laid
out as action values are; a policy file has them in their place, since it takes the larger one.
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mjcartpole.errors import ConfigError
from mjcartpole.learning.discretizer import is_finite
from mjcartpole.learning.methods.action_values import StepSizeParameters
from mjcartpole.learning.methods.experience import Rng
from mjcartpole.learning.schedules import linear
from mjcartpole.learning.tiles import Table
from mjcartpole.task import N_ACTIONS


class Rates(NamedTuple):
    """Step sizes during one episode."""

    alpha: float
    """Of the preferences."""
    alpha_values: float
    """Of the values of states."""


@dataclass(frozen=True, kw_only=True)
class PreferenceParameters(StepSizeParameters):
    """Discount, step sizes, and the first values; at first both actions are equally likely."""

    alpha: float = 0.01
    """Step size of the preferences at the start."""
    alpha_final: float = 0.01
    """Step size of the preferences once decayed."""
    alpha_values: float = 0.1
    """Step size of the values of states at the start."""
    alpha_values_final: float = 0.01
    """Step size of the values of states once decayed."""
    decay: float = 0.5
    """Share of the episodes over which step sizes fall, linearly."""
    v_init: float = 10.0
    """Values of states start here."""

    def check_parameters(self) -> None:
        """Refuse values that make no sense (ConfigError)."""
        super().check_parameters()
        self._check_shares("alpha_values", "alpha_values_final", "decay")
        if not is_finite(self.v_init):
            raise ConfigError(f"v_init must be a finite number, not {self.v_init!r}")


def begin_episode(p: Any, memory: Any, number: int, episodes: int) -> Rates:
    """Return the step sizes of an episode, counted from 0."""
    slope = p.decay * episodes
    alpha = linear(p.alpha, p.alpha_final, slope, number)
    return Rates(alpha, linear(p.alpha_values, p.alpha_values_final, slope, number))


def first_preferences(n_rows: int) -> npt.NDArray[np.float64]:
    """Return preferences, flat, by which both actions are equally likely."""
    return np.zeros(n_rows * N_ACTIONS)


def first_values(p: Any, n_rows: int) -> npt.NDArray[np.float64]:
    """Return the values of states to begin with, shape (n_rows,)."""
    return np.full(n_rows, p.v_init)


def probability_of_right(h: Table, s: int) -> float:
    """Return the probability of action 1."""
    ahead = h[2 * s + 1] - h[2 * s]
    if ahead >= 0:
        return 1 / (1 + math.exp(-ahead))
    odds = math.exp(ahead)  # The other way round it would overflow.
    return odds / (1 + odds)


def act(p: Any, memory: Any, rates: Rates, s: int, rng: Rng) -> int:
    """Return an action that is drawn by the preferences."""
    return 1 if rng.random() < probability_of_right(memory.preferences, s) else 0


def prefer_right(h: Table, s: int, change: float) -> None:
    """Raise the preference of action 1, and lower the other's as much.

    The gradient of ln pi(a | s) does so by a - pi(1 | s).
    """
    h[2 * s] -= change
    h[2 * s + 1] += change


def greedy_values(memory: Any) -> npt.NDArray[np.float64]:
    """Return the preferences, shape (n_rows, 2)."""
    return np.asarray(memory.preferences).reshape(-1, N_ACTIONS)
