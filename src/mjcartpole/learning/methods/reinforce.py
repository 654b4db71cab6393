"""REINFORCE with baseline: what went better than expected is done more often.

Williams (1992), doi:10.1007/BF00992696; Sutton and Barto (2018), section 13.4. When an episode is
over, for each of its steps, with G the discounted sum of the rewards from there on,

    advantage  =  G - v(s)
    v(s)       <-  v(s) + alpha_values advantage
    h(s, .)    <-  h(s, .) + alpha advantage grad ln pi(a | s)

the last step first, so that one sum serves all. The factor gamma^t of the book, by which late steps
hardly count, is left out, as is usual. A truncated episode would have gone on: its sum ends in v.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

from mjcartpole.learning.methods.action_values import FloatMemory
from mjcartpole.learning.methods.experience import Rng, Trajectory, Transition
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

__all__ = ["act", "begin_episode", "greedy_values"]


@dataclass(frozen=True, kw_only=True)
class Parameters(PreferenceParameters):
    """Those of preferences; whole returns scatter more than one step, so step sizes are small."""

    gamma: float = 0.99
    """Discount per step."""
    alpha: float = 0.003
    """Step size of the preferences at the start."""
    alpha_final: float = 0.003
    """Step size of the preferences once decayed."""
    alpha_values: float = 0.005
    """Step size of the values of states at the start."""
    alpha_values_final: float = 0.005
    """Step size of the values of states once decayed."""
    v_init: float = 30.0
    """Values of states start here."""


Numbers = numbers_class(Parameters, __name__)


class Memory(NamedTuple):
    """What is preferred, and what is expected."""

    preferences: Table
    state_values: FloatMemory


def make_memory(p: Any, n_rows: int, rng: Rng) -> Memory:
    """Return preferences and values to begin with."""
    return Memory(first_preferences(n_rows), first_values(p, n_rows))


def after_step(p: Any, memory: Memory, rates: Rates, step: Transition, rng: Rng) -> None:
    """Wait until the episode is over."""


def after_episode(p: Any, memory: Memory, rates: Rates, episode: Trajectory, rng: Rng) -> None:
    """Learn from an episode, last step first."""
    h, v = memory.preferences, memory.state_values
    total = 0.0 if episode.terminated else v[episode.states[episode.steps]]
    for t in range(episode.steps - 1, -1, -1):
        s, a = episode.states[t], episode.actions[t]
        total = episode.rewards[t] + p.gamma * total
        advantage = total - v[s]
        v[s] += rates.alpha_values * advantage
        prefer_right(h, s, rates.alpha * advantage * (a - probability_of_right(h, s)))
