"""The training loop compiled by Numba, with MuJoCo's own C step inside it.

What it shares with the reference loop it shares as functions: `row_of`, the reward of the task and
all functions of the learning method are compiled as they stand. Only the loop around them is
written a second time, in the order of `loop.py`, so that both draw the same numbers and round
alike: tables, returns and policies are equal bit for bit.
"""

import contextlib
import functools
import hashlib
import inspect
import math
from collections.abc import Callable
from types import FunctionType
from typing import Any, Final, NamedTuple, TypeAlias, cast

import numba
import numpy as np
import numpy.typing as npt
from numba import types
from numba.core.caching import FunctionCache
from numba.core.runtime.nrt import rtsys

from mjcartpole import rewards, task
from mjcartpole.disturbances import effects
from mjcartpole.learning import ahead as looking_ahead
from mjcartpole.learning import discretizer, episodes, fitted, linking, sines, stepping, tiles
from mjcartpole.learning.ahead import foresee, go_on
from mjcartpole.learning.discretizer import Grid
from mjcartpole.learning.episodes import Columns
from mjcartpole.learning.kinds import Floats, Physics, Rules, State
from mjcartpole.learning.linking import F, compiled
from mjcartpole.learning.methods import experience
from mjcartpole.learning.methods.experience import Trajectory, Transition
from mjcartpole.learning.stepping import (
    advance,
    begin,
    has_diverged,
    is_over,
    lean,
    note,
    observe,
    pay,
    start_at,
)
from mjcartpole.physics import cartpole_v1
from mjcartpole.physics.simulation import LARGEST_SANE
from mjcartpole.rewards import CONSTANT, Reward

DIVERGED: Final = -1
"""In place of an ending."""

Played: TypeAlias = tuple[float, int, int, int]
"""Return, steps, ending and side of an episode."""

Rngs: TypeAlias = tuple[np.random.Generator, np.random.Generator]
"""The environment's generator and the learner's."""


class Scratch(NamedTuple):
    """Memory for one episode: states, shape (limit + 1,), actions and rewards, shape (limit,)."""

    states: npt.NDArray[np.int64]
    actions: npt.NDArray[np.int64]
    rewards: Floats
    failure: Floats
    """Steps before a simulation diverged, then its state, shape (3 + 2 poles,)."""
    finished: npt.NDArray[np.int64]
    """Number of the next episode, shape (1,): it is known even where Ctrl-C swallows a return."""


_ending_index, _side_index = compiled(episodes.ending_index), compiled(episodes.side_index)
_row_of, _folded = compiled(discretizer.row_of), compiled(discretizer.folded)


@compiled
def _ended(
    physics: Physics, rules: Rules, state: State, total: float, steps: int, terminated: bool
) -> Played:
    ending = _ending_index(terminated, state[0], rules.x_limit)
    side = _side_index(ending, state[0], lean(physics, state)) if terminated else 0
    return total, steps, ending, side


@compiled
def _learn_episode(
    act: Callable[..., int],
    after_step: Callable[..., None],
    after_episode: Callable[..., None],
    reward: Reward,
    physics: Physics,
    rules: Rules,
    grid: Grid,
    p: Any,
    memory: Any,
    rates: Any,
    rngs: Rngs,
    visits: npt.NDArray[np.int64],
    scratch: Scratch,
) -> Played:
    """Play an episode and learn."""
    states, actions, rewards = scratch.states, scratch.actions, scratch.rewards
    state = begin(physics, rules, rngs[0])
    row = _row_of(observe(physics, rules, state), grid)
    s, mirrored = _folded(row, grid.folding)
    states[0] = s
    ahead = foresee(physics, state)
    total, steps, over, terminated = 0.0, 0, False, False
    while not over:
        a = act(p, memory, rates, s, rngs[1])
        pushed = 1 - a if mirrored else a
        visits[2 * _home(p.tiles, row) + pushed] += 1
        state, ahead = go_on(physics, rules, state, pushed, ahead)
        terminated = is_over(rules, state)
        if terminated and has_diverged(state):
            note(physics, state, steps, scratch.failure)
            return total, steps, DIVERGED, 0
        r = pay(reward, rules, state, terminated)
        total += r
        actions[steps], rewards[steps] = a, r
        steps += 1
        over = terminated or steps == rules.time_limit
        row = _row_of(observe(physics, rules, state), grid)
        s_next, mirrored = _folded(row, grid.folding)
        after_step(p, memory, rates, Transition(s, a, r, s_next, terminated, over), rngs[1])
        states[steps] = s_next
        s = s_next
    episode = Trajectory(states, actions, rewards, steps, terminated)
    after_episode(p, memory, rates, episode, rngs[1])
    return _ended(physics, rules, state, total, steps, terminated)


@compiled
def _play_episode(
    reward: Reward,
    physics: Physics,
    rules: Rules,
    grid: Grid,
    tiling: Any,
    choices: Any,
    state: State,
    failure: Floats,
) -> Played:
    """Play an episode without learning, from a state in which the cart-pole is."""
    total, steps, over, terminated = 0.0, 0, False, False
    s = _row_of(observe(physics, rules, state), grid)
    while not over:
        state = advance(physics, rules, state, _greedy(tiling, choices, s, grid.folding))
        terminated = is_over(rules, state)
        if terminated and has_diverged(state):
            note(physics, state, steps, failure)
            return total, steps, DIVERGED, 0
        total += pay(reward, rules, state, terminated)
        steps += 1
        over = terminated or steps == rules.time_limit
        s = _row_of(observe(physics, rules, state), grid)
    return _ended(physics, rules, state, total, steps, terminated)


@compiled
def _log(columns: Columns, number: int, played: Played) -> None:
    columns.totals[number], columns.steps[number] = played[0], played[1]
    columns.endings[number], columns.sides[number] = played[2], played[3]


class _Kept(FunctionCache):
    """Numba's cache on disk, read without what only compiling needs: half of a training's start."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return what was compiled for these types, or None."""
        rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)  # type: ignore[no-untyped-call]


def _entry(function: F, sources: str) -> F:
    """Compile what Python calls, and keep it on disk, where a folder for that can be written."""
    entry: Any = _for_python(function)
    if sources:
        with contextlib.suppress(RuntimeError):
            entry._cache = _Kept(function)  # type: ignore[no-untyped-call]
    return cast(F, entry)


@functools.cache
def uncached(entry: Callable[..., int]) -> Callable[..., int]:
    """Return an entry of its own for a process in which the cache on disk cannot be used."""
    function: Callable[..., int] = cast(Any, entry).py_func
    return _for_python(function)


def _for_python(function: F) -> F:
    return cast(F, numba.njit(error_model="numpy", nogil=True)(function))


@functools.cache
def learn_chunk(method: Any, reward: Reward) -> Callable[..., int]:
    """Return the compiled loop that learns by a method, where this is the reward of a step."""
    functions = (method.begin_episode, method.act, method.after_step, method.after_episode)
    begin_episode, act, after_step, after_episode = map(_compilable, functions)
    _compilable(reward)
    sources = _sources(reward, *functions)

    def learn_chunk(
        physics: Physics,
        rules: Rules,
        grid: Grid,
        p: Any,
        memory: Any,
        rngs: Rngs,
        numbers: tuple[int, int, int],
        most_steps: int,
        columns: Columns,
        visits: npt.NDArray[np.int64],
        scratch: Scratch,
    ) -> int:
        """Learn from episodes `numbers[0]` to `numbers[1] - 1` of `numbers[2]` in all.

        Stops after the episode in which `most_steps` is reached, or where the physics diverge.

        Returns:
            The number of the next episode.
        """
        _ = sources
        all_steps = 0
        for number in range(numbers[0], numbers[1]):
            rates = begin_episode(p, memory, number, numbers[2])
            played = _learn_episode(
                act,
                after_step,
                after_episode,
                reward,
                physics,
                rules,
                grid,
                p,
                memory,
                rates,
                rngs,
                visits,
                scratch,
            )
            _log(columns, number, played)
            all_steps += played[1]
            if played[2] == DIVERGED:
                return number
            scratch.finished[0] = number + 1
            if all_steps >= most_steps:
                return number + 1
        return numbers[1]

    return _entry(learn_chunk, sources)


@functools.cache
def play_chunk(reward: Reward) -> Callable[..., int]:
    """Return the compiled loop that plays, where this is the reward of a step."""
    _compilable(reward)
    sources = _sources(reward)

    def play_chunk(
        physics: Physics,
        rules: Rules,
        grid: Grid,
        tiling: Any,
        choices: Any,
        starts: Any,
        numbers: tuple[int, int],
        most_steps: int,
        columns: Columns,
        failure: Floats,
    ) -> int:
        """Do the same as `learn_chunk` without learning.

        Where each episode starts is drawn by a generator, or is a row of an array; for the choices
        see `tiles.greedy`.
        """
        _ = sources
        all_steps = 0
        for number in range(numbers[0], numbers[1]):
            state = start_at(physics, rules, starts, number)
            played = _play_episode(reward, physics, rules, grid, tiling, choices, state, failure)
            _log(columns, number, played)
            all_steps += played[1]
            if played[2] == DIVERGED:
                return number
            if all_steps >= most_steps:
                return number + 1
        return numbers[1]

    return _entry(play_chunk, sources)


_known: Final[set[FunctionType]] = set()


def _compilable(function: Any) -> Any:
    """Let compiled code call a plain function, and the plain functions that this one calls."""
    for each in _reached(function) - _known:
        _known.add(each)
        compiled(each)
    return function


def _reached(*functions: Any) -> set[FunctionType]:
    """Return the plain functions among these, and those that they call."""
    found: set[FunctionType] = set()
    waiting = list(functions)
    while waiting:
        each = waiting.pop()
        if isinstance(each, FunctionType) and each not in found:
            found.add(each)
            waiting += _globals_of(each)
    return found


def _globals_of(function: FunctionType) -> list[Any]:
    names = function.__code__.co_names
    return [function.__globals__[name] for name in names if name in function.__globals__]


_greedy, _home = compiled(_compilable(tiles.greedy)), compiled(tiles.home)


@functools.cache
def why_not_compilable(reward: Reward) -> str:
    """Return why compiled code cannot call a reward; nothing if it can."""
    if reward in CONSTANT:
        return ""
    if not isinstance(reward, FunctionType):
        return "is no plain function"
    trial: Any = _for_python(_compilable(reward))
    try:
        trial.compile((numba.float64,) * 4 + (numba.boolean,))
    except Exception as error:  # Numba has more kinds than it documents.
        lines = [line for line in str(error).splitlines() if line.strip()]
        return f"cannot be compiled: {' '.join(lines[:2])}"
    if not isinstance(trial.nopython_signatures[0].return_type, types.Number | types.Boolean):
        return "does not always return a number"
    return ""


def _sources(reward: Any, *functions: Any) -> str:
    """Return a checksum of all that is compiled into an entry; nothing where that is not known.

    All files count that have one of a method's functions, or one that these call. Numba keeps what
    it compiled until the file of the entry changes, and would not see that another file did. A
    value that an entry closes over is part of the cache's key.
    """
    constants = _globals_of(reward)
    # Functions and objects that a reward takes from elsewhere change without its own text; and what
    # was typed at a prompt has no file, but Python may show another text for it.
    elsewhere = reward.__closure__ or not all(type(each) in _PLAIN for each in constants)
    if elsewhere or reward.__code__.co_filename.startswith("<"):
        return ""
    files = {inspect.getmodule(each) for each in _reached(*functions)}
    try:
        texts = [inspect.getsource(each) for each in (*_SHARED, *sorted(files, key=repr), reward)]
    except (OSError, TypeError):
        return ""
    return hashlib.sha256(
        "".join([*texts, repr((LARGEST_SANE, sines.IS_GLIBC, constants))]).encode()
    ).hexdigest()


_SHARED: Final = (
    looking_ahead,
    cartpole_v1,
    discretizer,
    effects,
    episodes,
    fitted,
    linking,
    sines,
    stepping,
    rewards,
    task,
    tiles,
    experience,
)
_PLAIN: Final = {bool, int, float, type(math)}
