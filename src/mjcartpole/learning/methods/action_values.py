"""Action values: what all methods share whose memory is one table Q(s, a)."""

from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from mjcartpole.errors import ConfigError
from mjcartpole.learning.discretizer import is_finite
from mjcartpole.learning.methods.experience import Rng, Trajectory
from mjcartpole.learning.methods.parameters import Parameters
from mjcartpole.learning.schedules import linear
from mjcartpole.learning.tiles import Table, add_at, all_weights, pair_at, value_at
from mjcartpole.task import N_ACTIONS

Ties = Literal["first", "random"]
"""What to do between two actions of equal value: take action 0, or draw one."""

IntMemory: TypeAlias = "memoryview[int] | npt.NDArray[np.int64]"
FloatMemory: TypeAlias = "memoryview[float] | npt.NDArray[np.float64]"
"""Whole numbers, and others, that a method keeps."""


class Rates(NamedTuple):
    """What holds during one episode."""

    alpha: float
    """Step size."""
    epsilon: float
    """Probability of a random action."""


@dataclass(frozen=True, kw_only=True)
class DiscountParameters(Parameters):
    """What the future is worth."""

    gamma: float = 0.98
    """Discount per step."""

    def check_parameters(self) -> None:
        """Refuse values that make no sense (ConfigError)."""
        self._check_shares("gamma")


@dataclass(frozen=True, kw_only=True)
class StepSizeParameters(DiscountParameters):
    """How far a value moves towards its target."""

    alpha: float = 0.1
    """Step size at the start."""
    alpha_final: float = 0.01
    """Step size once decayed."""

    def check_parameters(self) -> None:
        """Refuse values that make no sense (ConfigError)."""
        super().check_parameters()
        self._check_shares("alpha", "alpha_final")


@dataclass(frozen=True, kw_only=True)
class ExplorationParameters(DiscountParameters):
    """Exploration and the first table."""

    epsilon: float = 1.0
    """Probability of a random action at the start."""
    epsilon_final: float = 0.01
    """Probability of a random action once decayed."""
    decay: float = 0.8
    """Share of the episodes over which what decays falls, linearly."""
    q_init_low: float = 10.0
    """The table starts uniformly random between this …"""
    q_init_high: float = 10.0
    """… and this."""
    ties: Ties = "first"
    """Between equal values: the first action, or a random one."""
    learn_last_step: bool = True
    """Learn from the step that ends an episode (the article's code does not)."""

    def check_parameters(self) -> None:
        """Refuse values that make no sense (ConfigError)."""
        super().check_parameters()
        self._check_shares("epsilon", "epsilon_final", "decay")
        self._check_one_of("ties", ("first", "random"))
        low, high = self.q_init_low, self.q_init_high
        if not (is_finite(low) and is_finite(high) and low <= high and is_finite(high - low)):
            raise ConfigError(
                "q_init_low and q_init_high must be finite, in order and not too far apart, "
                f"not {low!r} and {high!r}"
            )


@dataclass(frozen=True, kw_only=True)
class ActionValueParameters(ExplorationParameters, StepSizeParameters):
    """Discount, step size, exploration and the first table."""


@dataclass(frozen=True, kw_only=True)
class TiledParameters(ActionValueParameters):
    """The same for a table that may consist of several offset grids."""

    tilings: int = 1
    """Sum so many grids, each a little offset (tile coding): 1, 2, 4, … 64."""


class QTable(NamedTuple):
    """The memory of a method that learns one table."""

    q_table: Table


def draw_table(p: Any, n_rows: int, rng: Rng) -> npt.NDArray[np.float64]:
    """Return a first table, flat, drawn uniformly from `q_init_low` to `q_init_high`."""
    # Without the sum, numpy calls 0.0 to -0.0 a range that runs backwards.
    table = rng.uniform(p.q_init_low, p.q_init_high + 0.0, size=n_rows * N_ACTIONS)
    return table / all_weights(p.tiles)


def make_memory(p: Any, n_rows: int, rng: Rng) -> QTable:
    """Return a table to begin with."""
    return QTable(draw_table(p, n_rows, rng))


def begin_episode(p: Any, memory: Any, number: int, episodes: int) -> Rates:
    """Return step size and exploration of an episode, counted from 0."""
    slope = p.decay * episodes
    alpha = linear(p.alpha, p.alpha_final, slope, number)
    return Rates(alpha, linear(p.epsilon, p.epsilon_final, slope, number))


def explore(p: Any, memory: Any, number: int, episodes: int) -> Rates:
    """Return the exploration of an episode, counted from 0, of a method without a step size."""
    return Rates(0.0, linear(p.epsilon, p.epsilon_final, p.decay * episodes, number))


def greedy_values(memory: Any) -> npt.NDArray[np.float64]:
    """Return the table, shape (n_rows, 2)."""
    return np.asarray(memory.q_table).reshape(-1, N_ACTIONS)


def choose(p: Any, q: Table, s: int, epsilon: float, rng: Rng) -> int:
    """Return an action: random with probability epsilon, else the better one.

    `p.ties` 0 takes the first of two equal actions, 1 draws one; `rng` gives one number, and one
    more for a random action.
    """
    if rng.random() < epsilon:
        return int(rng.random() * N_ACTIONS)
    return prefer(p, pair_at(p.tiles, q, s), rng)


def prefer(p: Any, pair: tuple[float, float], rng: Rng) -> int:
    """Return the better action by the values of both; of equals the first, or one that is drawn."""
    left, right = pair
    if left == right and p.ties == 1:
        return int(rng.random() * N_ACTIONS)
    return 1 if right > left else 0


def act(p: Any, memory: Any, rates: Rates, s: int, rng: Rng) -> int:
    """Return the epsilon-greedy action in a state."""
    return choose(p, memory.q_table, s, rates.epsilon, rng)


def value(p: Any, q: Table, s: int, a: int) -> float:
    """Return the value of an action in a state."""
    return value_at(p.tiles, q, s, a)


def better(p: Any, q: Table, s: int) -> int:
    """Return the better action in a state, the first of equals."""
    left, right = pair_at(p.tiles, q, s)
    return 1 if right > left else 0


def best(p: Any, q: Table, s: int) -> float:
    """Return the value of the better action in a state."""
    left, right = pair_at(p.tiles, q, s)
    return max(left, right)


def move_towards(p: Any, q: Table, s: int, a: int, target: float, alpha: float) -> None:
    """Move the value of one action towards its target: Q(s, a) <- Q(s, a) + alpha (target - …)."""
    add_at(p.tiles, q, s, a, alpha * (target - value(p, q, s, a)))


def learn_no_more(p: Any, memory: Any, rates: Any, episode: Trajectory, rng: Rng) -> None:
    """Leave an episode as it was learned step by step: `after_episode` of methods that do so."""
