"""Double Q-learning: two tables, each valuing what the other thinks best.

Van Hasselt (2010), "Double Q-learning", NeurIPS 23; Sutton and Barto (2018), section 6.7. A coin
decides which table learns; if it is the first,

    Q1(s, a)  <-  Q1(s, a) + alpha (r + gamma Q2(s', argmax_a' Q1(s', a')) - Q1(s, a))

The maximum of one noisy table is too high on average, since it chooses by the same luck that it
then takes for value; what the other table says of that action is not. It acts by the mean of both.
After a terminated step the target is `r`; a truncated episode would have gone on, so it bootstraps.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mjcartpole.learning.methods.action_values import (
    Rates,
    TiledParameters,
    begin_episode,
    better,
    draw_table,
    learn_no_more,
    move_towards,
    prefer,
    value,
)
from mjcartpole.learning.methods.experience import Rng, Transition
from mjcartpole.learning.methods.parameters import numbers_class
from mjcartpole.learning.tiles import Table, pair_at
from mjcartpole.task import N_ACTIONS

__all__ = ["after_episode", "begin_episode"]


@dataclass(frozen=True, kw_only=True)
class Parameters(TiledParameters):
    """Those of action values; a table that learns from half of the steps moves twice as far."""

    alpha: float = 0.2
    """Step size at the start."""
    alpha_final: float = 0.02
    """Step size once decayed."""


Numbers = numbers_class(Parameters, __name__)
after_episode = learn_no_more


class Memory(NamedTuple):
    """Both tables."""

    q_table: Table
    second: Table


def make_memory(p: Any, n_rows: int, rng: Rng) -> Memory:
    """Return two tables to begin with."""
    return Memory(draw_table(p, n_rows, rng), draw_table(p, n_rows, rng))


def act(p: Any, memory: Memory, rates: Rates, s: int, rng: Rng) -> int:
    """Return the epsilon-greedy action by both tables."""
    if rng.random() < rates.epsilon:
        return int(rng.random() * N_ACTIONS)
    first, second = pair_at(p.tiles, memory.q_table, s), pair_at(p.tiles, memory.second, s)
    return prefer(p, (first[0] + second[0], first[1] + second[1]), rng)


def after_step(p: Any, memory: Memory, rates: Rates, step: Transition, rng: Rng) -> None:
    """Let one table learn from one step."""
    if step.over and not p.learn_last_step:
        return
    q, other = memory.q_table, memory.second
    if rng.random() < 0.5:
        q, other = other, q
    target = step.r
    if not step.terminated:
        target += p.gamma * value(p, other, step.s_next, better(p, q, step.s_next))
    move_towards(p, q, step.s, step.a, target, rates.alpha)


def greedy_values(memory: Memory) -> npt.NDArray[np.float64]:
    """Return the mean of both tables, shape (n_rows, 2)."""
    mean: npt.NDArray[np.float64] = np.add(memory.q_table, memory.second) / 2
    return mean.reshape(-1, N_ACTIONS)
