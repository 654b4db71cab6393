"""Q-learning: after each step, or after each episode from lambda-returns.

One-step Q-learning (Watkins, 1989; Sutton and Barto, 2018, section 6.5):

    Q(s, a)  <-  Q(s, a) + alpha (G - Q(s, a)),    G = r + gamma max_a' Q(s', a')

With a lambda, an episode is learned when it is over, backwards, so that its end reaches its
beginning at once (Peng and Williams, 1996, doi:10.1007/BF00114731, in its forward view):

    G_t = r_t + gamma ((1 - lambda) max_a' Q(s_t+1, a') + lambda G_t+1)

A terminated episode has no future, so its last target is `r` alone. A truncated one would have
gone on, so it bootstraps like any other step.
"""

from dataclasses import dataclass
from typing import Any

from mjcartpole.learning.methods.action_values import (
    QTable,
    Rates,
    TiledParameters,
    act,
    begin_episode,
    best,
    greedy_values,
    make_memory,
    move_towards,
)
from mjcartpole.learning.methods.experience import Rng, Trajectory, Transition
from mjcartpole.learning.methods.parameters import numbers_class

__all__ = ["act", "begin_episode", "greedy_values", "make_memory"]


@dataclass(frozen=True, kw_only=True)
class Parameters(TiledParameters):
    """Those of action values, and lambda."""

    alpha_final: float = 0.003
    """Step size once decayed."""
    td_lambda: float | None = 0.8
    """Learn after each episode from lambda-returns with this lambda; None: after each step."""

    def check_parameters(self) -> None:
        """Refuse values that make no sense (ConfigError)."""
        super().check_parameters()
        if self.td_lambda is not None:
            self._check_shares("td_lambda")


Numbers = numbers_class(Parameters, __name__)


def after_step(p: Any, memory: QTable, rates: Rates, step: Transition, rng: Rng) -> None:
    """Learn from one step, unless the episode is learned when it is over."""
    if p.td_lambda >= 0 or (step.over and not p.learn_last_step):
        return
    target = step.r
    if not step.terminated:
        target += p.gamma * best(p, memory.q_table, step.s_next)
    move_towards(p, memory.q_table, step.s, step.a, target, rates.alpha)


def after_episode(p: Any, memory: QTable, rates: Rates, episode: Trajectory, rng: Rng) -> None:
    """Learn from an episode by lambda-returns, last step first."""
    if p.td_lambda < 0:
        return
    q, lam = memory.q_table, p.td_lambda
    learned = episode.steps if p.learn_last_step else episode.steps - 1
    closed = episode.terminated and p.learn_last_step
    future = 0.0 if closed else best(p, q, episode.states[learned])
    for t in range(learned - 1, -1, -1):
        s = episode.states[t]
        target = episode.rewards[t] + p.gamma * future
        move_towards(p, q, s, episode.actions[t], target, rates.alpha)
        future = (1 - lam) * best(p, q, s) + lam * target
