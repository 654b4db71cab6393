"""Planning: value iteration on the known equations, before the first episode; episodes are played.

Bellman (1957); Sutton and Barto (2018), section 4.4. States are the nodes of a grid, and the value
of a state between them is interpolated, which keeps the iteration a contraction (Gordon, 1995,
"Stable function approximation in dynamic programming"):

    Q(s, a)  <-  r + gamma sum_i w_i(s') max_a' Q(s_i, a')

where the nodes s_i around the next state s' have the weights w_i. After a step that the rules end
it is `r`. There is no time limit.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from mjcartpole.errors import ConfigError
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.methods.action_values import (
    DiscountParameters,
    QTable,
    Rates,
    better,
    greedy_values,
    learn_no_more,
)
from mjcartpole.learning.methods.experience import Dynamics, Rng, Transition, Vector
from mjcartpole.learning.methods.parameters import numbers_class
from mjcartpole.packages import check_installed
from mjcartpole.task import N_ACTIONS

__all__ = ["after_episode", "greedy_values"]

MOST_WEIGHTS = 2**25
"""Of all next states; they take 12 bytes each."""


@dataclass(frozen=True, kw_only=True)
class Parameters(DiscountParameters):
    """Discount, and when to stop."""

    interpolated: ClassVar[bool] = True

    gamma: float = 0.99
    """Discount per step."""
    tolerance: float = 0.01
    """Stop once a sweep changes no value by more than this …"""
    sweeps: int = 10_000
    """… or after so many sweeps over all nodes."""

    def check_parameters(self) -> None:
        """Refuse values that make no sense (ConfigError)."""
        super().check_parameters()
        self._check_positive("tolerance")
        self._check_whole("sweeps", 1)


Numbers = numbers_class(Parameters, __name__)
after_episode = learn_no_more


def make_memory(p: Any, n_rows: int, rng: Rng) -> QTable:
    """Return an empty table."""
    return QTable(np.zeros(n_rows * N_ACTIONS))


def plan(p: Any, memory: QTable, discretizer: Discretizer, dynamics: Dynamics) -> None:
    """Fill the table by value iteration."""
    check_installed("method planning", "scipy")
    from scipy.sparse import csr_array  # noqa: PLC0415 - it takes a quarter of a second

    q = np.asarray(memory.q_table)
    _check_size(discretizer)
    nodes = nodes_of(discretizer)
    outcomes = [dynamics(nodes, action) for action in range(N_ACTIONS)]
    states, rewards, terminated = (
        np.stack(each, axis=1).reshape(-1, *each[0].shape[1:])
        for each in zip(*outcomes, strict=True)
    )
    rows, weights = around(discretizer, states)
    weights *= p.gamma * ~terminated[:, None]
    ends = np.arange(0, rows.size + 1, rows.shape[1])
    follow = csr_array((weights.ravel(), rows.ravel(), ends), shape=(q.size, len(nodes)))
    values = np.zeros(len(nodes))
    for _ in range(p.sweeps):
        q[:] = rewards + follow @ values
        before, values = values, greedy_values(memory).max(axis=1)
        if not np.abs(values - before).max() > p.tolerance:
            break


def nodes_of(discretizer: Discretizer) -> Vector:
    """Return the states of all nodes, row by row, shape (rows, d).

    Where a dimension is ignored they are in the middle of its range.
    """
    ends = zip(discretizer.bins, discretizer.low, discretizer.high, strict=True)
    axes = [np.linspace(a, b, n) if n > 1 else np.array([(a + b) / 2]) for n, a, b in ends]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))


def around(discretizer: Discretizer, states: Vector) -> tuple[npt.NDArray[np.int32], Vector]:
    """Return rows and weights of the nodes around each state, both of shape (n, 2^d).

    States have the shape (n, dimensions), of which d have more than one node.
    """
    rows, weights = np.zeros((len(states), 1), np.int32), np.ones((len(states), 1))
    for axis in discretizer.grid.dimensions:
        n, low, high = discretizer.bins[axis], discretizer.low[axis], discretizer.high[axis]
        place = np.clip((states[:, axis] - low) / (high - low), 0.0, 1.0)[:, None] * (n - 1)
        before = np.minimum(place.astype(np.int32), n - 2)
        behind = place - before
        rows = np.hstack([rows * n + before, rows * n + before + 1], dtype=np.int32)
        weights = np.hstack([weights * (1.0 - behind), weights * behind])
    return rows, weights


def begin_episode(p: Any, memory: QTable, number: int, episodes: int) -> Rates:
    """Return that nothing moves, and nothing is tried out."""
    return Rates(0.0, 0.0)


def act(p: Any, memory: QTable, rates: Rates, s: int, rng: Rng) -> int:
    """Return the better action in a state, the first of equals."""
    return better(p, memory.q_table, s)


def after_step(p: Any, memory: QTable, rates: Rates, step: Transition, rng: Rng) -> None:
    """Learn nothing."""


def _check_size(discretizer: Discretizer) -> None:
    weights = N_ACTIONS * discretizer.n_rows * 2 ** len(discretizer.grid.dimensions)
    if weights > MOST_WEIGHTS:
        raise ConfigError(
            f"planning on bins {discretizer.bins} takes {weights:,} weights; the most is "
            f"{MOST_WEIGHTS:,}; take fewer bins, or 1 where a dimension matters little"
        )
