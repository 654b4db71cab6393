"""The training loop compiled by Numba, with MuJoCo's own C step inside it.

What it shares with the reference loop it shares as functions: `row_of`, `choose`, `learn_step`,
`learn_episode`, `on_line` and the rules of `task.py` are compiled as they stand there. Only the
loops around them are written a second time, in the order of `loop.py`, so that both draw the same
numbers and round alike: tables, returns and policies are equal bit for bit.
"""

import functools
import hashlib
import inspect
from collections.abc import Callable
from typing import Any, Final, NamedTuple, TypeAlias, cast

import numba
import numpy as np
import numpy.typing as npt

from mjcartpole import task
from mjcartpole.learning import discretizer, episodes, qlearning, schedules, stepping
from mjcartpole.learning.discretizer import Grid
from mjcartpole.learning.episodes import Columns
from mjcartpole.learning.qlearning import Table
from mjcartpole.learning.stepping import (
    F,
    Floats,
    Physics,
    State,
    advance,
    begin,
    compiled,
    draw_start,
    has_diverged,
    is_over,
    observe,
)
from mjcartpole.physics import cartpole_v1
from mjcartpole.physics.simulation import LARGEST_SANE

DIVERGED: Final = -1
"""In place of an ending."""

Rngs: TypeAlias = tuple[np.random.Generator, np.random.Generator]
"""The environment's generator and the learner's."""


class Method(NamedTuple):
    """A Q-learner as the compiled loop sees it: see `TrainConfig`."""

    gamma: float
    td_lambda: float
    stepwise: bool
    """Learn after each step; else after each episode, by `td_lambda`."""
    draw_ties: bool
    learn_last_step: bool
    alpha: float
    alpha_final: float
    epsilon: float
    epsilon_final: float
    slope: float
    """Episodes until alpha and epsilon are at their final values."""


class Scratch(NamedTuple):
    """Memory for one episode: states, shape (limit + 1,), actions and rewards, shape (limit,)."""

    states: npt.NDArray[np.int64]
    actions: npt.NDArray[np.int64]
    rewards: Floats
    failure: Floats
    """Steps before a simulation diverged, then its state, shape (3 + 2 poles,)."""
    finished: npt.NDArray[np.int64]
    """Number of the next episode, shape (1,): it is known even where Ctrl-C swallows a return."""


_row_of = compiled(discretizer.row_of)
_choose = compiled(qlearning.choose)
_learn_step = compiled(qlearning.learn_step)
_learn_episode = compiled(qlearning.learn_episode)
_linear = compiled(schedules.linear)
_reward = compiled(task.reward)
_ending_index = compiled(episodes.ending_index)


@compiled
def _note_failure(failure: Floats, steps: int, state: State) -> None:
    failure[0] = steps
    for index in range(len(state)):
        failure[index + 1] = state[index]


@compiled
def _learn_stepwise(
    physics: Physics,
    grid: Grid,
    method: Method,
    q: Table,
    rngs: Rngs,
    rates: tuple[float, float],
    scratch: Scratch,
) -> tuple[float, int, int]:
    """Play an episode and learn after each step; returns its return, steps and ending."""
    alpha, epsilon = rates
    state = draw_start(physics, rngs[0])
    begin(physics, state)
    s = _row_of(observe(physics, state), grid)
    total, steps, over, terminated = 0.0, 0, False, False
    while not over:
        a = _choose(q, s, epsilon, method.draw_ties, rngs[1])
        state = advance(physics, state, a)
        terminated = is_over(physics, state)
        if terminated and has_diverged(state):
            _note_failure(scratch.failure, steps, state)
            return total, steps, DIVERGED
        r = _reward(terminated, False, False)
        total += r
        steps += 1
        over = terminated or steps == task.TIME_LIMIT
        s_next = _row_of(observe(physics, state), grid)
        if method.learn_last_step or not over:
            _learn_step(q, s, a, r, s_next, terminated, alpha, method.gamma)
        s = s_next
    return total, steps, _ending_index(terminated, state[0])


@compiled
def _learn_afterwards(
    physics: Physics,
    grid: Grid,
    method: Method,
    q: Table,
    rngs: Rngs,
    rates: tuple[float, float],
    scratch: Scratch,
) -> tuple[float, int, int]:
    """Play an episode, then learn from all of it; returns its return, steps and ending."""
    alpha, epsilon = rates
    states, actions, rewards = scratch.states, scratch.actions, scratch.rewards
    state = draw_start(physics, rngs[0])
    begin(physics, state)
    states[0] = _row_of(observe(physics, state), grid)
    total, steps, over, terminated = 0.0, 0, False, False
    while not over:
        actions[steps] = _choose(q, states[steps], epsilon, method.draw_ties, rngs[1])
        state = advance(physics, state, actions[steps])
        terminated = is_over(physics, state)
        if terminated and has_diverged(state):
            _note_failure(scratch.failure, steps, state)
            return total, steps, DIVERGED
        rewards[steps] = _reward(terminated, False, False)
        total += rewards[steps]
        steps += 1
        over = terminated or steps == task.TIME_LIMIT
        states[steps] = _row_of(observe(physics, state), grid)
    learned = steps if method.learn_last_step else steps - 1
    closed = terminated and method.learn_last_step
    _learn_episode(
        q, states, actions, rewards, learned, closed, alpha, method.gamma, method.td_lambda
    )
    return total, steps, _ending_index(terminated, state[0])


@compiled
def _play(
    physics: Physics,
    grid: Grid,
    actions: npt.NDArray[np.int64],
    rng: np.random.Generator,
    failure: Floats,
) -> tuple[float, int, int]:
    """Play an episode without learning; returns its return, steps and ending."""
    state = draw_start(physics, rng)
    begin(physics, state)
    total, steps, over, terminated = 0.0, 0, False, False
    while not over:
        state = advance(physics, state, actions[_row_of(observe(physics, state), grid)])
        terminated = is_over(physics, state)
        if terminated and has_diverged(state):
            _note_failure(failure, steps, state)
            return total, steps, DIVERGED
        total += _reward(terminated, False, False)
        steps += 1
        over = terminated or steps == task.TIME_LIMIT
    return total, steps, _ending_index(terminated, state[0])


def _entry(function: F) -> F:
    """Compile what Python calls, and keep it on disk, where a folder for that can be written."""
    jit = functools.partial(numba.njit, error_model="numpy", nogil=True)
    entry: Any
    try:
        entry = jit(cache=True)(function)
    except RuntimeError:
        entry = jit()(function)
    return cast(F, entry)


@functools.cache
def uncached(entry: Callable[..., int]) -> Callable[..., int]:
    """An entry of its own for a process in which the cache on disk cannot be used."""
    function: Callable[..., int] = cast(Any, entry).py_func
    return compiled(function)


def _make_learn_chunk(sources: str) -> Callable[..., int]:
    def learn_chunk(
        physics: Physics,
        grid: Grid,
        method: Method,
        q: Table,
        rngs: Rngs,
        numbers: tuple[int, int],
        most_steps: int,
        columns: Columns,
        scratch: Scratch,
    ) -> int:
        """Learn from episodes `numbers[0]` to `numbers[1] - 1`, in `columns[number]` each.

        Stops after the episode in which `most_steps` is reached, or where the physics diverge.

        Returns:
            The number of the next episode.
        """
        _ = sources
        all_steps = 0
        for number in range(numbers[0], numbers[1]):
            alpha = _linear(method.alpha, method.alpha_final, method.slope, number)
            epsilon = _linear(method.epsilon, method.epsilon_final, method.slope, number)
            rates = (alpha, epsilon)
            if method.stepwise:
                played = _learn_stepwise(physics, grid, method, q, rngs, rates, scratch)
            else:
                played = _learn_afterwards(physics, grid, method, q, rngs, rates, scratch)
            total, steps, ending = played
            columns.totals[number] = total
            columns.steps[number] = steps
            columns.endings[number] = ending
            all_steps += steps
            if ending == DIVERGED:
                return number
            scratch.finished[0] = number + 1
            if all_steps >= most_steps:
                return number + 1
        return numbers[1]

    return learn_chunk


def _make_play_chunk(sources: str) -> Callable[..., int]:
    def play_chunk(
        physics: Physics,
        grid: Grid,
        actions: npt.NDArray[np.int64],
        rng: np.random.Generator,
        numbers: tuple[int, int],
        most_steps: int,
        columns: Columns,
        failure: Floats,
    ) -> int:
        """The same as `learn_chunk` without learning; `actions[row]` is taken."""
        _ = sources
        all_steps = 0
        for number in range(numbers[0], numbers[1]):
            total, steps, ending = _play(physics, grid, actions, rng, failure)
            columns.totals[number] = total
            columns.steps[number] = steps
            columns.endings[number] = ending
            all_steps += steps
            if ending == DIVERGED:
                return number
            if all_steps >= most_steps:
                return number + 1
        return numbers[1]

    return play_chunk


def _sources() -> str:
    """A checksum of all that is compiled into the entries.

    Numba keeps what it compiled until the file of the entry changes, and would not see that another
    file did. A value that an entry closes over is part of the cache's key.
    """
    modules = (cartpole_v1, discretizer, episodes, qlearning, schedules, stepping, task)
    texts = "".join(inspect.getsource(module) for module in modules) + repr(LARGEST_SANE)
    return hashlib.sha256(texts.encode()).hexdigest()


learn_chunk = _entry(_make_learn_chunk(_sources()))
play_chunk = _entry(_make_play_chunk(_sources()))
