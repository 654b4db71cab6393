"""Prioritized sweeping: after each step some values are computed anew, the most outdated first.

Moore and Atkeson (1993), doi:10.1007/BF00993104; Sutton and Barto (2018), section 8.4. The world is
taken for what was counted (see `transition_counts`), and each update is the expected one:

    Q(s, a)  <-  mean of r + gamma max_a' Q(s', a') over all times that a was taken in s

What would change by more than a threshold waits in a queue, by the size of that change; where a
value changes, the pairs that have led to its state are looked at again. With `order="random"` pairs
that were seen are drawn instead: Dyna-Q (Sutton, 1990; Sutton and Barto, 2018, section 8.2), with
expected updates. A terminated step has nothing after it; a truncated episode would have gone on.
"""

from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np

from mjcartpole.learning.methods.action_values import (
    ExplorationParameters,
    FloatMemory,
    Rates,
    act,
    best,
    draw_table,
    explore,
    greedy_values,
    learn_no_more,
)
from mjcartpole.learning.methods.experience import Rng, Transition
from mjcartpole.learning.methods.limits import PairCounts, Pairs, StepCounts, refuse
from mjcartpole.learning.methods.parameters import numbers_class
from mjcartpole.learning.methods.priority_queue import check_queue, make_queue, pop, push
from mjcartpole.learning.methods.transition_counts import (
    CountParameters,
    StatesOrNothing,
    check_counts,
    check_places,
    count,
    expected_value,
    make_counts,
)
from mjcartpole.learning.tiles import Table
from mjcartpole.task import N_ACTIONS

__all__ = ["act", "after_episode", "greedy_values"]

Order = Literal["priority", "random"]
"""Which values are computed anew: the most outdated, or any (Dyna-Q)."""


@dataclass(frozen=True, kw_only=True)
class Parameters(CountParameters, ExplorationParameters):
    """Those of exploration and of counting, and how much is planned."""

    planning: int = 5
    """Values that are computed anew after each step."""
    order: Order = "priority"
    """Which ones: the most outdated first, or random ones (Dyna-Q)."""
    threshold: float = 0.001
    """Changes up to this are not worth a place in the queue."""
    predecessors: int = 64
    """Different states and actions that are remembered as having led to a state."""

    def check_parameters(self) -> None:
        """Refuse values that make no sense (ConfigError)."""
        super().check_parameters()
        self._check_whole("planning", 1)
        self._check_whole("predecessors", 1)
        self._check_positive("threshold")
        self._check_one_of("order", ("priority", "random"))


Numbers = numbers_class(Parameters, __name__)
begin_episode = explore
after_episode = learn_no_more


class Memory(NamedTuple):
    """The table, the counts, see `Counts`, the queue, see `Queue`, and what led where."""

    q_table: Table
    visits: StepCounts
    rewards: FloatMemory
    successors: StatesOrNothing
    counts: StepCounts
    seen: Pairs
    n_seen: PairCounts
    heap: Pairs
    place: PairCounts
    priority: FloatMemory
    n_queued: PairCounts
    predecessors: Pairs
    """Lists of pairs, one for each row …"""
    n_predecessors: PairCounts
    """… and how many are in each; a full one takes no more."""


def make_memory(p: Any, n_rows: int, rng: Rng) -> Memory:
    """Return a table to begin with, counts of nothing and an empty queue."""
    check_places(n_rows, "predecessors", p.predecessors, n_rows * p.predecessors)
    return Memory(
        draw_table(p, n_rows, rng),
        *make_counts(p, n_rows),
        *make_queue(N_ACTIONS * n_rows),
        np.zeros(n_rows * p.predecessors, np.int64),
        np.zeros(n_rows, np.int64),
    )


def check_memory(p: Any, memory: Any) -> None:
    """Refuse what no training can have come to (ValueError)."""
    check_counts(p, memory)
    check_queue(memory)
    n, lists = memory.n_predecessors, memory.predecessors.reshape(-1, p.predecessors)
    refuse("n_predecessors", f"has more than the {p.predecessors} of a list", n > p.predecessors)
    listed = lists[np.arange(p.predecessors) < n[:, None]]
    for name, pairs in (("predecessors", listed), ("heap", memory.heap[: memory.n_queued[0]])):
        refuse(name, "has what visits has not", memory.visits[pairs] == 0)


def after_step(p: Any, memory: Memory, rates: Rates, step: Transition, rng: Rng) -> None:
    """Count one step, and compute some values anew."""
    if step.over and not p.learn_last_step:
        return
    count(p, memory, step)
    pair = N_ACTIONS * step.s + step.a
    if p.order == 1:
        update(p, memory, pair)
        for _ in range(p.planning):
            update(p, memory, memory.seen[int(rng.random() * memory.n_seen[0])])
        return
    if not step.terminated:
        note_predecessor(p, memory, step.s_next, pair)
    consider(p, memory, pair)
    for _ in range(p.planning):
        if memory.n_queued[0] == 0:
            break
        sweep(p, memory, pop(memory))


def update(p: Any, memory: Memory, pair: int) -> None:
    """Compute one value anew."""
    memory.q_table[pair] = expected_value(p, memory, pair)


def sweep(p: Any, memory: Memory, pair: int) -> None:
    """Compute one value anew, and consider what led to its state if that is worth another now."""
    s = pair // N_ACTIONS
    before = best(p, memory.q_table, s)
    update(p, memory, pair)
    if best(p, memory.q_table, s) != before:
        first = s * p.predecessors
        for place in range(first, first + memory.n_predecessors[s]):
            consider(p, memory, memory.predecessors[place])


def consider(p: Any, memory: Memory, pair: int) -> None:
    """Queue a value that would change by more than the threshold."""
    change = abs(expected_value(p, memory, pair) - memory.q_table[pair])
    if change > p.threshold:
        push(memory, pair, change)


def note_predecessor(p: Any, memory: Memory, s: int, pair: int) -> None:
    """Remember that a pair led to a state."""
    first, n = s * p.predecessors, memory.n_predecessors[s]
    for place in range(first, first + n):
        if memory.predecessors[place] == pair:
            return
    if n < p.predecessors:
        memory.predecessors[first + n] = pair
        memory.n_predecessors[s] += 1
