"""Rewards: what a control step pays, as plain functions of numbers."""

import math
from collections.abc import Callable, Mapping
from typing import Final, TypeAlias

Reward: TypeAlias = Callable[[float, float, float, float, bool], float]
"""From the state after a step (x, x_dot, theta, theta_dot; m, m/s, rad, rad/s) and whether it ends
the episode by the rules. Of several poles, theta and theta_dot are those of largest size. A plain
function of numbers: the compiled engine compiles it as it is."""


def one_per_step(x: float, x_dot: float, theta: float, theta_dot: float, terminated: bool) -> float:
    """Return 1: CartPole-v1's reward, also of the step that ends the episode."""
    return 1.0


def minus_one_at_the_end(
    x: float, x_dot: float, theta: float, theta_dot: float, terminated: bool
) -> float:
    """Return -1 for the step that ends the episode, 0 for others: Sutton and Barto's reward."""
    return -1.0 if terminated else 0.0


def upright(x: float, x_dot: float, theta: float, theta_dot: float, terminated: bool) -> float:
    """Return 1 for a pole that stands, 0 for one that hangs: (1 + cos theta) / 2."""
    return (1.0 + math.cos(theta)) / 2.0


REWARDS: Final[Mapping[str, Reward]] = {
    "one-per-step": one_per_step,
    "minus-one-at-the-end": minus_one_at_the_end,
    "upright": upright,
}
"""What rewards are called where no function can be given."""


def named(value: object) -> object:
    """Return a reward's name, if it has one; anything else as it is."""
    return next((name for name, reward in REWARDS.items() if reward is value), value)


CONSTANT: Final[Mapping[Reward, float]] = {one_per_step: 1.0, minus_one_at_the_end: 0.0}
"""Rewards that are the same number for every step that ends nothing, and that number: what need
not be called in hot paths."""
