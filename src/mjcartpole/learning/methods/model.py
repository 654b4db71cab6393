"""A model from counts, and value iteration in it after each episode: certainty equivalence.

Sutton and Barto (2018), section 4.4, with the counted transitions of `transition_counts` as the
world that is taken for certain:

    Q(s, a)  <-  mean of r + gamma max_a' Q(s', a') over all times that a was taken in s

Values of what was not seen stay as the table began: where that is more than anything is worth,
what is unknown is tried first (Brafman and Tennenholtz, 2002, R-max). A terminated step has nothing
after it; a truncated episode would have gone on, so its last step leads where it led.

With `plan_after="failure"` a table that has just balanced stays as it is, while counting goes on
(Robbins, 1952, doi:10.1090/S0002-9904-1952-09620-8, "win stay, lose shift").
"""

from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

from mjcartpole.learning.methods.action_values import (
    ExplorationParameters,
    FloatMemory,
    Rates,
    act,
    draw_table,
    explore,
    greedy_values,
)
from mjcartpole.learning.methods.experience import Rng, Trajectory, Transition
from mjcartpole.learning.methods.limits import PairCounts, Pairs, StepCounts
from mjcartpole.learning.methods.parameters import numbers_class
from mjcartpole.learning.methods.transition_counts import (
    CountParameters,
    StatesOrNothing,
    check_counts,
    count,
    expected_value,
    make_counts,
)
from mjcartpole.learning.tiles import Table

__all__ = ["act", "greedy_values"]

PlanAfter = Literal["episode", "failure"]
"""After which episodes values are computed: each, or those that the rules ended."""


@dataclass(frozen=True, kw_only=True)
class Parameters(CountParameters, ExplorationParameters):
    """Those of exploration and of counting, and how long the model is thought about."""

    sweeps: int = 1_000
    """Sweeps of value iteration after an episode, at most."""
    tolerance: float = 0.001
    """Sweeps end once none of the values changes by more."""
    plan_after: PlanAfter = "episode"
    """Compute values after each episode, or only after one that the rules ended."""

    def check_parameters(self) -> None:
        """Refuse values that make no sense (ConfigError)."""
        super().check_parameters()
        self._check_whole("sweeps", 1)
        self._check_positive("tolerance")
        self._check_one_of("plan_after", ("episode", "failure"))


Numbers = numbers_class(Parameters, __name__)
begin_episode = explore
check_memory = check_counts


class Memory(NamedTuple):
    """The table, and the counts, see `Counts`."""

    q_table: Table
    visits: StepCounts
    rewards: FloatMemory
    successors: StatesOrNothing
    counts: StepCounts
    seen: Pairs
    n_seen: PairCounts


def make_memory(p: Any, n_rows: int, rng: Rng) -> Memory:
    """Return a table to begin with, and counts of nothing."""
    return Memory(draw_table(p, n_rows, rng), *make_counts(p, n_rows))


def after_step(p: Any, memory: Memory, rates: Rates, step: Transition, rng: Rng) -> None:
    """Count one step."""
    if p.learn_last_step or not step.over:
        count(p, memory, step)


def after_episode(p: Any, memory: Memory, rates: Rates, episode: Trajectory, rng: Rng) -> None:
    """Sweep until the values are those of the model."""
    if p.plan_after == 1 and not episode.terminated:
        return
    for _ in range(p.sweeps):
        if sweep(p, memory) <= p.tolerance:
            break


def sweep(p: Any, memory: Memory) -> float:
    """Compute each value anew, what was seen last first; returns the largest change."""
    q, change = memory.q_table, 0.0
    for place in range(memory.n_seen[0] - 1, -1, -1):
        pair = memory.seen[place]
        value = expected_value(p, memory, pair)
        change = max(change, abs(value - q[pair]))
        q[pair] = value
    return change
