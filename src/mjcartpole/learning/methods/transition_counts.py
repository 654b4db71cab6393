"""Counts of transitions: what has followed what, the model that planning methods learn.

For each pair of a state and an action: how often it was seen, the sum of its rewards, and a list of
bounded length with the states that followed and how often each did. While no list is full, all is
exact. In a full one a new state takes the place of the one that was counted least, and goes on from
its count (Metwally, Agrawal and El Abbadi, 2005, doi:10.1007/978-3-540-30570-5_27, "Space-Saving"):
the counts of a pair always add up to its visits.
"""

from dataclasses import dataclass
from typing import Annotated, Any, Final, NamedTuple

import numpy as np

from mjcartpole.errors import ConfigError
from mjcartpole.learning.methods.action_values import FloatMemory, IntMemory, best
from mjcartpole.learning.methods.experience import Transition
from mjcartpole.learning.methods.limits import PairCounts, Pairs, StepCounts, refuse
from mjcartpole.learning.methods.parameters import Parameters
from mjcartpole.task import N_ACTIONS

NOTHING: Final = -1
"""In place of a state: the rules ended the episode there."""

MOST: Final = 4_000_000
"""Places in all lists together: 64 MB."""


StatesOrNothing = Annotated[IntMemory, lambda grid: (NOTHING, grid.n_states - 1)]


@dataclass(frozen=True, kw_only=True)
class CountParameters(Parameters):
    """How much is counted."""

    successors: int = 16
    """Different next states that are counted of a state and an action."""

    def check_parameters(self) -> None:
        """Refuse values that make no sense (ConfigError)."""
        super().check_parameters()
        self._check_whole("successors", 1)


class Counts(NamedTuple):
    """Counts; each pair has the place 2 s + a, and `successors` places in the lists."""

    visits: StepCounts
    rewards: FloatMemory
    """Sums."""
    successors: StatesOrNothing
    """Rows of states, or `NOTHING`."""
    counts: StepCounts
    """How often each was seen; a list ends at the first 0."""
    seen: Pairs
    """Pairs in the order in which they were first seen …"""
    n_seen: PairCounts
    """… and how many, shape (1,)."""


def make_counts(p: Any, n_rows: int) -> Counts:
    """Return counts of nothing.

    Raises:
        ConfigError: They would need too much memory.
    """
    pairs = N_ACTIONS * n_rows
    places = pairs * p.successors
    check_places(n_rows, "successors", p.successors, places)
    visits, successors, counts, seen, n_seen = (
        np.zeros(n, np.int64) for n in (pairs, places, places, pairs, 1)
    )
    return Counts(visits, np.zeros(pairs), successors, counts, seen, n_seen)


def check_places(n_rows: int, what: str, length: int, places: int) -> None:
    """Refuse lists that would need too much memory (ConfigError)."""
    if places > MOST:
        raise ConfigError(
            f"{n_rows:,} states with {length} {what} each make lists of {places:,} places; "
            f"the most is {MOST:,}: give fewer bins or {what}"
        )


def check_counts(p: Any, memory: Any) -> None:
    """Refuse counts that contradict each other (ValueError)."""
    visits, seen = memory.visits, memory.seen[: memory.n_seen[0]]
    lists = memory.counts.reshape(-1, p.successors)
    refuse("counts", "has a gap in a list", (lists[:, :-1] == 0) & (lists[:, 1:] > 0))
    refuse(
        "counts", "adds up to other sums than visits has", lists.sum(axis=1, dtype=float) != visits
    )
    visited = np.flatnonzero(visits)
    refuse("seen", "is not what visits has", not np.array_equal(np.sort(seen), visited))


def count(p: Any, memory: Any, step: Transition) -> None:
    """Count one step."""
    pair = N_ACTIONS * step.s + step.a
    if memory.visits[pair] == 0:
        memory.seen[memory.n_seen[0]] = pair
        memory.n_seen[0] += 1
    memory.visits[pair] += 1
    memory.rewards[pair] += step.r
    s_next = NOTHING if step.terminated else step.s_next
    place = _place_of(memory, s_next, pair * p.successors, p.successors)
    memory.successors[place] = s_next
    memory.counts[place] += 1


def _place_of(memory: Any, s_next: int, first: int, length: int) -> int:
    """Return where a state stands in a list, or is to stand."""
    least = first
    for place in range(first, first + length):
        if memory.counts[place] == 0 or memory.successors[place] == s_next:
            return place
        if memory.counts[place] < memory.counts[least]:
            least = place
    return least


def expected_value(p: Any, memory: Any, pair: int) -> float:
    """Return r + gamma max_a' Q(s', a') on average over all that was counted of a pair."""
    total, first = memory.rewards[pair], pair * p.successors
    for place in range(first, first + p.successors):
        if memory.counts[place] == 0:
            break
        if memory.successors[place] != NOTHING:
            future = best(p, memory.q_table, memory.successors[place])
            total += memory.counts[place] * p.gamma * future
    mean: float = total / memory.visits[pair]
    return mean
