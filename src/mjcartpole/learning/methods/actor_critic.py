"""Actor-critic: each step is judged by the value of where it led, and those before it a little.

Barto, Sutton and Anderson (1983), doi:10.1109/TSMC.1983.6313077, who balanced a pole with it;
Sutton and Barto (2018), section 13.5, with eligibility traces. After each step

    error    =   r + gamma v(s') - v(s)
    z_v      <-  gamma lambda z_v + grad v(s)
    z_h      <-  gamma lambda z_h + grad ln pi(a | s)
    v        <-  v + alpha_values error z_v
    h        <-  h + alpha error z_h

With lambda = 0 it is one-step actor-critic. The book's factor gamma^t, by which late steps hardly
count, is left out, as is usual. After a terminated step v(s') is 0; a truncated episode would have
gone on. Both actions' preferences mirror each other, so a state has one trace for both.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from mjcartpole.learning.methods.action_values import FloatMemory, learn_no_more
from mjcartpole.learning.methods.experience import Rng, Transition
from mjcartpole.learning.methods.limits import NoSteps, NoTraces, States
from mjcartpole.learning.methods.parameters import numbers_class
from mjcartpole.learning.methods.preferences import (
    PreferenceParameters,
    Rates,
    act,
    begin_episode,
    first_preferences,
    first_values,
    greedy_values,
    prefer_right,
    probability_of_right,
)
from mjcartpole.learning.tiles import Table

__all__ = ["act", "after_episode", "begin_episode", "greedy_values"]

FAINT = 1e-9
"""A trace below this is taken for none."""


@dataclass(frozen=True, kw_only=True)
class Parameters(PreferenceParameters):
    """Those of preferences, and lambda."""

    trace_lambda: float = 0.9
    """The share of an error that the step before takes, and so on back; 0: one step alone."""

    def check_parameters(self) -> None:
        """Refuse values that make no sense (ConfigError)."""
        super().check_parameters()
        self._check_shares("trace_lambda")


Numbers = numbers_class(Parameters, __name__)
after_episode = learn_no_more


class Memory(NamedTuple):
    """What is preferred, what is expected, and which states an error still concerns."""

    preferences: Table
    state_values: FloatMemory
    value_traces: NoTraces
    """Shape (n_rows,); so the next."""
    policy_traces: NoTraces
    """Of action 1; of action 0 it is as much below zero, and none is larger than the value's."""
    traced: States
    """States that have a trace, the first ones of shape (n_rows,)."""
    n_traced: NoSteps
    """How many these are; shape (1,)."""


def make_memory(p: Any, n_rows: int, rng: Rng) -> Memory:
    """Return preferences and values to begin with, and no traces."""
    none, states = np.zeros(n_rows), np.zeros(n_rows, np.int64)
    h, v = first_preferences(n_rows), first_values(p, n_rows)
    return Memory(h, v, none, none.copy(), states, np.zeros(1, np.int64))


def after_step(p: Any, memory: Memory, rates: Rates, step: Transition, rng: Rng) -> None:
    """Learn from one step."""
    h, v, s = memory.preferences, memory.state_values, step.s
    error = step.r - v[s]
    if not step.terminated:
        error += p.gamma * v[step.s_next]
    _fade(memory, p.gamma * p.trace_lambda)
    if memory.value_traces[s] == 0.0:
        memory.traced[memory.n_traced[0]] = s
        memory.n_traced[0] += 1
    memory.value_traces[s] += 1.0
    memory.policy_traces[s] += step.a - probability_of_right(h, s)
    for place in range(memory.n_traced[0]):
        s = memory.traced[place]
        v[s] += rates.alpha_values * error * memory.value_traces[s]
        prefer_right(h, s, rates.alpha * error * memory.policy_traces[s])
    if step.over:
        _fade(memory, 0.0)


def _fade(memory: Memory, share: float) -> None:
    """Let traces fade to a share of what they are, and forget the faint ones."""
    values, policies, kept = memory.value_traces, memory.policy_traces, 0
    for place in range(memory.n_traced[0]):
        s = memory.traced[place]
        values[s] *= share
        policies[s] *= share
        if values[s] > FAINT:
            memory.traced[kept] = s
            kept += 1
        else:
            values[s], policies[s] = 0.0, 0.0
    memory.n_traced[0] = kept
