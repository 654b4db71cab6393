"""n-step SARSA: learns from n rewards that came, and values only what comes after them.

Sutton and Barto (2018), section 7.2:

    G_t = r_t + gamma r_t+1 + ... + gamma^(n-1) r_t+n-1 + gamma^n Q(s_t+n, a_t+n)
    Q(s_t, a_t)  <-  Q(s_t, a_t) + alpha (G_t - Q(s_t, a_t))

With n = 1 it is SARSA, and has its bits. At the end of an episode what is left is learned, the
latest step first, so that one sum serves all. After a terminated step nothing comes; a truncated
episode would have gone on, so it bootstraps.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from mjcartpole.learning.methods.action_values import (
    FloatMemory,
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
from mjcartpole.learning.methods.limits import Actions, NoAction, NoSteps, States
from mjcartpole.learning.methods.parameters import numbers_class
from mjcartpole.learning.methods.sarsa import act
from mjcartpole.learning.tiles import Table

__all__ = ["act", "after_episode", "begin_episode", "greedy_values"]

MOST_STEPS = 10_000
"""Of memory; more than a pole balances in training."""


@dataclass(frozen=True, kw_only=True)
class Parameters(TiledParameters):
    """Those of action values, and n."""

    n_steps: int = 8
    """Rewards that a target consists of before it bootstraps; 1 is SARSA."""

    def check_parameters(self) -> None:
        """Refuse values that make no sense (ConfigError)."""
        super().check_parameters()
        self._check_whole("n_steps", 1, MOST_STEPS)


Numbers = numbers_class(Parameters, __name__)
after_episode = learn_no_more


class Memory(NamedTuple):
    """The table, the action that was drawn for the next step, and the last n steps."""

    q_table: Table
    next_action: NoAction
    """Shape (1,); -1 at the start of an episode."""
    steps_done: NoSteps
    """Of the episode so far; shape (1,)."""
    states: States
    """Of step t at t modulo n, shape (n_steps,); so the other two."""
    actions: Actions
    rewards: FloatMemory


def make_memory(p: Any, n_rows: int, rng: Rng) -> Memory:
    """Return a table to begin with, and no steps."""
    none, n = np.zeros(1, np.int64), p.n_steps
    ring = np.zeros(n, np.int64)
    return Memory(draw_table(p, n_rows, rng), none - 1, none, ring, ring.copy(), np.zeros(n))


def after_step(p: Any, memory: Memory, rates: Rates, step: Transition, rng: Rng) -> None:
    """Draw the next action, and learn from the step that is n - 1 steps old, or at the end all."""
    q, n, t = memory.q_table, p.n_steps, memory.steps_done[0]
    slot = t % n
    memory.states[slot], memory.actions[slot], memory.rewards[slot] = step.s, step.a, step.r
    a_next, target, kept = -1, 0.0, min(t + 1, n)
    if not step.terminated:
        a_next = choose(p, q, step.s_next, rates.epsilon, rng)
        target = value(p, q, step.s_next, a_next)
    memory.steps_done[0], memory.next_action[0] = t + 1, a_next
    if step.over:
        memory.steps_done[0], memory.next_action[0] = 0, -1
        if not p.learn_last_step:
            target, kept, slot = value(p, q, step.s, step.a), kept - 1, (slot - 1) % n
    if step.over or kept == n:
        _learn(p, memory, rates.alpha, target, slot, kept, step.over)


def _learn(
    p: Any, memory: Memory, alpha: float, target: float, slot: int, kept: int, over: bool
) -> None:
    """Sum rewards from the latest step back, and learn the oldest, or if it is over each."""
    for age in range(kept):
        target = memory.rewards[slot] + p.gamma * target
        if over or age == kept - 1:
            s, a = memory.states[slot], memory.actions[slot]
            move_towards(p, memory.q_table, s, a, target, alpha)
        slot = (slot if slot > 0 else p.n_steps) - 1
