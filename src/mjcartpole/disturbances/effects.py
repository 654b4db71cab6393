"""What disturbances do in a control step, as plain functions that Numba compiles as they are."""

import math
from collections.abc import MutableSequence
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np

from mjcartpole.task import wrapped

Numbers: TypeAlias = MutableSequence[float] | Any
"""Memory that lasts an episode: a list in Python, an address in compiled code."""


class Effects(NamedTuple):
    """`Disturbances` as numbers; see there. Compiled code knows it as it is."""

    size: int
    """Values of a state."""
    delay: int
    hold: float
    drop: float
    follow: float
    """Share of the way to what is asked for that a motor makes in a step; 1 without lag."""
    force_noise: float
    pushes: int
    sensor_delay: int
    actions: int
    """How many of the last ones are seen."""
    turns: bool
    """Whether angles count from -pi to pi."""
    constants: int
    """Where in memory they begin: noise, bias and steps of each value, then a row a shove."""


CLOCK: Final = 0
_HELD: Final = 1
_LAGGED: Final = 2
QUEUE: Final = 3


def forget(effects: Effects, memory: Numbers) -> None:
    """Begin an episode: nothing is asked of the motor, nothing was seen."""
    for place in range(QUEUE + effects.delay + effects.actions):
        memory[place] = 0.0


def actuate(
    effects: Effects, memory: Numbers, action: float, rng: np.random.Generator
) -> tuple[float, float]:
    """Return what a motor makes of an action: a push, -1 to 1, and a force besides, N."""
    step = int(memory[CLOCK])
    memory[CLOCK] = step + 1.0
    _remember(effects, memory, action)
    push = action
    if effects.delay > 0:
        place = QUEUE + step % effects.delay
        push = memory[place]
        memory[place] = action
    if effects.hold > 0.0 and rng.random() < effects.hold:
        push = memory[_HELD]
    memory[_HELD] = push
    if effects.drop > 0.0 and rng.random() < effects.drop:
        push = 0.0
    if effects.follow < 1.0:
        memory[_LAGGED] += effects.follow * (push - memory[_LAGGED])
        push = memory[_LAGGED]
    return push, _shoved(effects, memory, step, rng)


def _shoved(effects: Effects, memory: Numbers, step: int, rng: np.random.Generator) -> float:
    """Return the force of noise and shoves in a step, N."""
    force = 0.0
    if effects.force_noise > 0.0:
        force = effects.force_noise * rng.standard_normal()
    row = effects.constants + 3 * effects.size
    for _ in range(effects.pushes):
        chance = memory[row + 2]
        if chance > 0.0:
            drawn = rng.random()
            if drawn < chance:
                force += memory[row] if drawn < 0.5 * chance else -memory[row]
        elif memory[row + 1] == step:
            force += memory[row]
        row += 3
    return force


def _remember(effects: Effects, memory: Numbers, action: float) -> None:
    first = QUEUE + effects.delay
    for place in range(first + effects.actions - 1, first, -1):
        memory[place] = memory[place - 1]
    if effects.actions > 0:
        memory[first] = action


def sense(effects: Effects, memory: Numbers, seen: Numbers, rng: np.random.Generator) -> None:
    """Make what is seen of a state, as rules have it, in place; the last actions go behind it."""
    size, step = effects.size, int(memory[CLOCK])
    readings = QUEUE + effects.delay + effects.actions
    noise = effects.constants
    for index in range(size):
        value = seen[index]
        if effects.sensor_delay > 0:
            if step == 0:
                for turn in range(effects.sensor_delay):
                    memory[readings + turn * size + index] = value
            place = readings + step % effects.sensor_delay * size + index
            now, value = value, memory[place]
            memory[place] = now
        value += memory[noise + size + index]
        if memory[noise + index] > 0.0:
            value += memory[noise + index] * rng.standard_normal()
        quantum = memory[noise + 2 * size + index]
        if quantum > 0.0:
            value = math.floor(value / quantum + 0.5) * quantum
        if effects.turns and index > 1 and index % 2 == 0:
            value = wrapped(value)
        seen[index] = value
    for index in range(effects.actions):
        seen[size + index] = memory[QUEUE + effects.delay + index]
