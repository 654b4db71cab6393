"""Expected SARSA: learns the mean over the next action instead of one that is drawn.

Van Seijen, van Hasselt, Whiteson and Wiering (2009), doi:10.1109/ADPRL.2009.4927542; Sutton and
Barto (2018), section 6.6:

    Q(s, a)  <-  Q(s, a) + alpha (r + gamma sum_a' pi(a' | s') Q(s', a') - Q(s, a))

where pi is the epsilon-greedy policy that is followed. After a terminated step the target is `r`; a
truncated episode would have gone on, so it bootstraps.
"""

from dataclasses import dataclass
from typing import Any

from mjcartpole.learning.methods.action_values import (
    QTable,
    Rates,
    TiledParameters,
    act,
    begin_episode,
    greedy_values,
    learn_no_more,
    make_memory,
    move_towards,
)
from mjcartpole.learning.methods.experience import Rng, Transition
from mjcartpole.learning.methods.parameters import numbers_class
from mjcartpole.learning.tiles import pair_at

__all__ = ["act", "after_episode", "begin_episode", "greedy_values", "make_memory"]


@dataclass(frozen=True, kw_only=True)
class Parameters(TiledParameters):
    """Those of action values."""


Numbers = numbers_class(Parameters, __name__)
after_episode = learn_no_more


def after_step(p: Any, memory: QTable, rates: Rates, step: Transition, rng: Rng) -> None:
    """Learn from one step."""
    if step.over and not p.learn_last_step:
        return
    q, target = memory.q_table, step.r
    if not step.terminated:
        left, right = pair_at(p.tiles, q, step.s_next)
        mean, better = (left + right) / 2, max(left, right)
        target += p.gamma * ((1 - rates.epsilon) * better + rates.epsilon * mean)
    move_towards(p, q, step.s, step.a, target, rates.alpha)
