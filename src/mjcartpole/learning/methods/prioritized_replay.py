"""Prioritized experience replay: steps are remembered, and those that surprised are relearned.

Schaul, Quan, Antonoglou and Silver (2016), "Prioritized Experience Replay", ICLR, proportional
variant, here on a table. Step i is replayed with a probability that grows with its last error:

    P(i) = p_i^omega / sum_k p_k^omega,    p_i = |delta_i| + floor
    Q(s, a)  <-  Q(s, a) + alpha w_i delta_i,    w_i = (N P(i))^-beta

with delta the error of one-step Q-learning; the weights w undo what the choice distorts, wholly
once beta has grown to 1. The paper divides them by the largest, so that no step becomes too long;
here alpha w is at most 1, beyond which a table cannot go. With omega = 0 replay is uniform (Lin,
1992, doi:10.1007/BF00992699). A new step has the largest priority there was. After a terminated
step the target is `r`; a truncated episode would have gone on, so it bootstraps.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from mjcartpole.learning.methods.action_values import (
    FloatMemory,
    TiledParameters,
    act,
    best,
    draw_table,
    greedy_values,
    learn_no_more,
    move_towards,
    value,
)
from mjcartpole.learning.methods.action_values import begin_episode as begin_rates
from mjcartpole.learning.methods.experience import Rng, Transition
from mjcartpole.learning.methods.limits import Actions, Flags, States, StepCounts
from mjcartpole.learning.methods.parameters import numbers_class
from mjcartpole.learning.methods.sum_tree import (
    check_tree,
    find_leaf,
    make_tree,
    set_leaf,
    weight_of,
)
from mjcartpole.learning.schedules import linear
from mjcartpole.learning.tiles import Table

__all__ = ["act", "after_episode", "greedy_values"]

RAREST = 1e-100
"""How likely a step is at least that is drawn, for the sake of a power that floats still hold."""


@dataclass(frozen=True, kw_only=True)
class Parameters(TiledParameters):
    """Those of action values, and what is remembered and replayed."""

    replay_size: int = 1_000
    """Steps that are remembered, the latest ones."""
    replays: int = 2
    """Remembered steps that are learned from after each new one."""
    omega: float = 0.6
    """How much priorities count: 0 replays all alike, 1 in proportion to the error."""
    beta: float = 0.4
    """How much of the distortion is undone at the start; all of it at the end."""
    floor: float = 0.01
    """Added to each error, so that no step is never replayed."""

    def check_parameters(self) -> None:
        """Refuse values that make no sense (ConfigError)."""
        super().check_parameters()
        self._check_whole("replay_size", 1, 1_000_000)
        self._check_whole("replays", 1, 1_000)
        self._check_shares("omega", "beta")
        self._check_positive("floor")


Numbers = numbers_class(Parameters, __name__)
after_episode = learn_no_more


class ReplayRates(NamedTuple):
    """What holds during one episode."""

    alpha: float
    epsilon: float
    beta: float


class Memory(NamedTuple):
    """The table, and the latest steps."""

    q_table: Table
    states: States
    """Of the n-th step at n modulo the size of the memory; so the next four."""
    actions: Actions
    rewards: FloatMemory
    next_states: States
    terminated: Flags
    tree: FloatMemory
    """Of priorities to the power of omega, see `sum_tree`."""
    largest: FloatMemory
    """Of those, ever; shape (1,)."""
    n_steps: StepCounts
    """How many there were; shape (1,)."""


def make_memory(p: Any, n_rows: int, rng: Rng) -> Memory:
    """Return a table to begin with, and no steps."""
    size, whole = p.replay_size, np.int64
    return Memory(
        q_table=draw_table(p, n_rows, rng),
        states=np.zeros(size, whole),
        actions=np.zeros(size, whole),
        rewards=np.zeros(size),
        next_states=np.zeros(size, whole),
        terminated=np.zeros(size, whole),
        tree=make_tree(size),
        largest=np.ones(1),
        n_steps=np.zeros(1, whole),
    )


def check_memory(p: Any, memory: Memory) -> None:
    """Refuse what no training can have come to (ValueError)."""
    known = min(memory.n_steps[0], p.replay_size)
    check_tree("tree", np.asarray(memory.tree), known, memory.largest[0])


def begin_episode(p: Any, memory: Any, number: int, episodes: int) -> ReplayRates:
    """Return step size, exploration and correction of an episode, counted from 0."""
    rates = begin_rates(p, memory, number, episodes)
    return ReplayRates(rates.alpha, rates.epsilon, linear(p.beta, 1.0, episodes, number))


def after_step(p: Any, memory: Memory, rates: ReplayRates, step: Transition, rng: Rng) -> None:
    """Remember one step, and learn from some that are remembered."""
    if step.over and not p.learn_last_step:
        return
    remember(p, memory, step)
    known = min(memory.n_steps[0], p.replay_size)
    for part in range(p.replays):
        i = find_leaf(memory.tree, (part + rng.random()) / p.replays * memory.tree[1], known)
        replay(p, memory, i, min(1.0, rates.alpha * weight(p, memory, i, rates.beta)))


def remember(p: Any, memory: Memory, step: Transition) -> None:
    """Put a step in the place of the oldest."""
    i = memory.n_steps[0] % p.replay_size
    memory.n_steps[0] += 1
    memory.states[i], memory.actions[i], memory.rewards[i] = step.s, step.a, step.r
    memory.next_states[i], memory.terminated[i] = step.s_next, int(step.terminated)
    set_leaf(memory.tree, i, memory.largest[0])


def weight(p: Any, memory: Memory, i: int, beta: float) -> float:
    """Return by how much longer a step is to be for being drawn more seldom than others."""
    known = min(memory.n_steps[0], p.replay_size)
    likely = known * weight_of(memory.tree, i) / memory.tree[1]
    return float(max(likely, RAREST) ** -beta)


def replay(p: Any, memory: Memory, i: int, alpha: float) -> None:
    """Learn from a step that is remembered, and give it the priority of its error."""
    q, s, a, target = memory.q_table, memory.states[i], memory.actions[i], memory.rewards[i]
    if memory.terminated[i] == 0:
        target += p.gamma * best(p, q, memory.next_states[i])
    priority = (abs(target - value(p, q, s, a)) + p.floor) ** p.omega
    move_towards(p, q, s, a, target, alpha)
    memory.largest[0] = max(memory.largest[0], priority)
    set_leaf(memory.tree, i, priority)
