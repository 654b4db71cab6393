"""SARSA: learns the values of the actions that it takes, explorations included.

Rummery and Niranjan (1994); Sutton and Barto (2018), section 6.4:

    Q(s, a)  <-  Q(s, a) + alpha (r + gamma Q(s', a') - Q(s, a))

The next action a' is drawn before the update, and is then the one that is taken. After a terminated
step the target is `r`; a truncated episode would have gone on, so it bootstraps.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from mjcartpole.learning.methods.action_values import (
    Rates,
    TiledParameters,
    begin_episode,
    choose,
    draw_table,
    greedy_values,
    learn_no_more,
    move_towards,
    value,
)
from mjcartpole.learning.methods.experience import Rng, Transition
from mjcartpole.learning.methods.limits import NoAction
from mjcartpole.learning.methods.parameters import numbers_class
from mjcartpole.learning.tiles import Table

__all__ = ["after_episode", "begin_episode", "greedy_values"]


@dataclass(frozen=True, kw_only=True)
class Parameters(TiledParameters):
    """Those of action values."""


Numbers = numbers_class(Parameters, __name__)
after_episode = learn_no_more


class Memory(NamedTuple):
    """The table, and the action that was drawn for the next step."""

    q_table: Table
    next_action: NoAction
    """Shape (1,); -1 at the start of an episode."""


def make_memory(p: Any, n_rows: int, rng: Rng) -> Memory:
    """Return a table to begin with, and no action."""
    return Memory(draw_table(p, n_rows, rng), np.array([-1], np.int64))


def act(p: Any, memory: Memory, rates: Rates, s: int, rng: Rng) -> int:
    """Return the action that was learned from, or at the start of an episode a new one."""
    if memory.next_action[0] >= 0:
        return memory.next_action[0]
    return choose(p, memory.q_table, s, rates.epsilon, rng)


def after_step(p: Any, memory: Memory, rates: Rates, step: Transition, rng: Rng) -> None:
    """Draw the next action, and learn from the one before."""
    q, target = memory.q_table, step.r
    if not step.terminated:
        a_next = choose(p, q, step.s_next, rates.epsilon, rng)
        target += p.gamma * value(p, q, step.s_next, a_next)
        memory.next_action[0] = a_next
    if step.over:
        memory.next_action[0] = -1
    if p.learn_last_step or not step.over:
        move_towards(p, q, step.s, step.a, target, rates.alpha)
