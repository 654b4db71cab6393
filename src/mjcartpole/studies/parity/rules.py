"""Rung 5: when an episode ends and what it pays, on both sides of every limit."""

import itertools
import math
import warnings
from collections.abc import Iterator
from typing import Any

import gymnasium
import numpy as np

from mjcartpole.envs.backend import GYM_ID
from mjcartpole.studies.parity.case import Subject
from mjcartpole.studies.parity.result import Figure, Question, Result
from mjcartpole.task import CARTPOLE_V1

QUESTION = Question(
    5, "boundaries: termination, reward, past the end, time limit", "equal by definition"
)
LIMITS = ((0, CARTPOLE_V1.x_limit), (2, CARTPOLE_V1.theta_limit))
STEPS_BEYOND_THE_END = 4


def boundaries(subject: Subject) -> Result:
    """Rung 5: termination and reward by one ulp, stepping past the end, the time limit.

    The rules do not depend on the model, so gymnasium's own environment is the reference for
    every question. Zero velocities leave positions where they are under explicit Euler.
    """
    compared = different = 0
    problems = []
    for (place, limit), sutton_barto in itertools.product(LIMITS, (False, True)):
        ours = subject.ours(sutton_barto_reward=sutton_barto)
        gyms = gymnasium.make(GYM_ID, disable_env_checker=True, sutton_barto_reward=sutton_barto)
        for value in _around(limit):
            a, b = (_outcomes(env, place, value) for env in (ours, gyms))
            compared += len(a)
            wrong = sum(x != y for x, y in zip(a, b, strict=True))
            different += wrong
            if wrong:
                problems.append(f"{('x', 'theta')[place // 2]} = {value!r}: {a} instead of {b}")
    ours_limit, its_limit = (_time_limit(env) for env in (subject.ours(), subject.gyms_as_is()))
    figures = (
        Figure(f"outcomes that differ ({compared})", float(different), 0.0),
        Figure("steps to the time limit, difference", float(abs(ours_limit - its_limit)), 0.0),
    )
    return QUESTION.answer(figures, problems=tuple(problems))


def _around(limit: float) -> Iterator[float]:
    """Yield both ends of a range, and their neighbours among the floats."""
    for end in (limit, -limit):
        yield from (math.nextafter(end, 0.0), end, math.nextafter(end, end * math.inf))


def _outcomes(env: gymnasium.Env[Any, Any], place: int, value: float) -> list[tuple[Any, ...]]:
    """Return reward, flags and info of a step at a limit, and of a few more; warnings counted."""
    state = np.zeros(4)
    state[place] = value
    cartpole: Any = env.unwrapped
    cartpole.reset(seed=0)
    outcomes: list[tuple[Any, ...]] = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for _ in range(1 + STEPS_BEYOND_THE_END):
            cartpole.state = state.copy()
            outcomes.append(cartpole.step(1)[1:])
    return [*outcomes, (len(caught),)]


def _time_limit(env: gymnasium.Env[Any, Any]) -> int:
    """Return the steps until truncation, with the pole held upright."""
    env.reset(seed=0)
    for step in range(1, 10 * CARTPOLE_V1.time_limit):
        env.unwrapped.state = np.zeros(4)  # type: ignore[attr-defined]
        _, _, terminated, truncated, _ = env.step(1)
        if terminated or truncated:
            return step if truncated else -step
    return 0
