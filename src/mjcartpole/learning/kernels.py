"""The training loop compiled by Numba, with MuJoCo's own C step inside it.

What it shares with the reference loop it shares as functions: `row_of`, `choose`, `learn_step`,
`learn_episode`, `on_line` and the rules of `task.py` are compiled as they stand there. Only the
loops around them are written a second time, in the order of `loop.py`, so that both draw the same
numbers and round alike: tables, returns and policies are equal bit for bit.

`mj_step` and `mj_resetData` are called in libmujoco by address-free linking, the one form that
Numba can keep in a cache on disk.
"""

import functools
import hashlib
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeAlias, TypeVar, cast

import llvmlite.binding
import numba
import numpy as np
import numpy.typing as npt
from numba import types
from numba.extending import overload

from mjcartpole import task
from mjcartpole.learning import discretizer, episodes, qlearning, schedules
from mjcartpole.learning.discretizer import Grid
from mjcartpole.learning.episodes import Columns
from mjcartpole.learning.qlearning import Table
from mjcartpole.physics import cartpole_v1
from mjcartpole.physics.simulation import FARTHEST_SANE, LARGEST_SANE, State

DIVERGED: Final = -1
"""In place of an ending."""

Floats = npt.NDArray[np.float64]
F = TypeVar("F", bound=Callable[..., Any])
Rngs: TypeAlias = tuple[np.random.Generator, np.random.Generator]
"""The environment's generator and the learner's."""


class MujocoPhysics(NamedTuple):
    """A simulation as the compiled loop sees it: see `Simulation`, which must outlive it."""

    model: int
    """Address of the mjModel."""
    data: int
    """Address of the mjData, whose arrays follow."""
    qpos: Floats
    qvel: Floats
    ctrl: Floats
    slider: int
    hinge: int
    left: float
    right: float
    """Controls of the two actions."""
    timestep: float
    substeps: int
    explicit: bool
    """Whether positions move by the old velocities (integrator `gym`)."""


class GymPhysics(NamedTuple):
    """Gymnasium's CartPole-v1."""

    left: float
    right: float
    """N."""


Physics: TypeAlias = MujocoPhysics | GymPhysics
AnyPhysics: TypeAlias = Any
"""Either, where Numba is to see one name for both."""


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
    """Steps before a simulation diverged, and its state then, shape (5,)."""
    finished: npt.NDArray[np.int64]
    """Number of the next episode, shape (1,): it is known even where Ctrl-C swallows a return."""


def link(library: Path | None) -> str:
    """Make MuJoCo's functions known to the compiler; returns why that failed, or nothing."""
    if library is None:
        return "libmujoco was not found in the mujoco package"
    try:
        llvmlite.binding.load_library_permanently(str(library))
    except RuntimeError as error:
        return f"libmujoco cannot be linked: {error}"
    if llvmlite.binding.address_of_symbol("mj_step") is None:
        return f"'{library}' has no mj_step"
    return ""


def compiled(function: F) -> F:
    """Compile a function when it is first called, for others here to call."""
    jitted: Any = numba.njit(error_model="numpy", nogil=True)(function)
    return cast(F, jitted)


_row_of = compiled(discretizer.row_of)
_choose = compiled(qlearning.choose)
_learn_step = compiled(qlearning.learn_step)
_learn_episode = compiled(qlearning.learn_episode)
_on_line = compiled(schedules.on_line)
_has_terminated = compiled(task.has_terminated)
_reward = compiled(task.reward)
_ending_index = compiled(episodes.ending_index)
_cartpole_v1_step = compiled(cartpole_v1.cartpole_v1_step)

_mj_step = types.ExternalFunction("mj_step", types.void(types.intp, types.intp))
_mj_reset = types.ExternalFunction("mj_resetData", types.void(types.intp, types.intp))


def _begin(physics: AnyPhysics, state: State) -> None:
    """Put a cart-pole into a state; nothing of its past remains."""
    raise NotImplementedError  # Numba takes one of the two below.


def _begin_mujoco(physics: AnyPhysics, state: State) -> None:
    _mj_reset(physics.model, physics.data)
    physics.qpos[physics.slider], physics.qvel[physics.slider] = state[0], state[1]
    physics.qpos[physics.hinge], physics.qvel[physics.hinge] = state[2], state[3]


def _begin_gym(physics: AnyPhysics, state: State) -> None:
    pass


def _advance(physics: AnyPhysics, state: State, action: int) -> State:
    """The state 0.02 s later."""
    raise NotImplementedError  # Numba takes one of the two below.


def _advance_mujoco(physics: AnyPhysics, state: State, action: int) -> State:
    qpos, qvel, h = physics.qpos, physics.qvel, physics.timestep
    slider, hinge = physics.slider, physics.hinge
    physics.ctrl[0] = physics.right if action == 1 else physics.left
    for _ in range(physics.substeps):
        x = qpos[slider] + h * qvel[slider]
        theta = qpos[hinge] + h * qvel[hinge]
        _mj_step(physics.model, physics.data)
        if physics.explicit:
            qpos[slider] = x
            qpos[hinge] = theta
    return qpos[slider], qvel[slider], qpos[hinge], qvel[hinge]


def _advance_gym(physics: AnyPhysics, state: State, action: int) -> State:
    force = physics.right if action == 1 else physics.left
    return _cartpole_v1_step(state[0], state[1], state[2], state[3], force)


@overload(_begin)
def _choose_begin(physics: AnyPhysics, state: State) -> Callable[..., None]:
    return _begin_mujoco if physics.instance_class is MujocoPhysics else _begin_gym


@overload(_advance)
def _choose_advance(physics: AnyPhysics, state: State, action: int) -> Callable[..., State]:
    return _advance_mujoco if physics.instance_class is MujocoPhysics else _advance_gym


@compiled
def _draw_start(rng: np.random.Generator) -> State:
    """A starting state: `Generator.uniform` draws and computes each value like this."""
    low, width = task.RESET_LOW, task.RESET_HIGH - task.RESET_LOW
    x = low + width * rng.random()
    x_dot = low + width * rng.random()
    theta = low + width * rng.random()
    theta_dot = low + width * rng.random()
    return x, x_dot, theta, theta_dot


@compiled
def _observe(state: State) -> State:
    """The float32 observation, as plain floats again."""
    x, x_dot = np.float64(np.float32(state[0])), np.float64(np.float32(state[1]))
    theta, theta_dot = np.float64(np.float32(state[2])), np.float64(np.float32(state[3]))
    return x, x_dot, theta, theta_dot


@compiled
def _is_over(state: State) -> bool:
    """Whether the rules end the episode, or a state gone wild does, as in the environment."""
    x, x_dot, theta, theta_dot = state
    is_number = (x - theta) * 0.0 == 0.0
    is_sane = -FARTHEST_SANE < x_dot - theta_dot < FARTHEST_SANE
    return _has_terminated(x, theta) or not is_number or not is_sane


@compiled
def _has_diverged(state: State) -> bool:
    x, x_dot, theta, theta_dot = state
    return not (
        -LARGEST_SANE < x < LARGEST_SANE
        and -LARGEST_SANE < x_dot < LARGEST_SANE
        and -LARGEST_SANE < theta < LARGEST_SANE
        and -LARGEST_SANE < theta_dot < LARGEST_SANE
    )


@compiled
def _note_failure(failure: Floats, steps: int, state: State) -> None:
    failure[0] = steps
    for index in range(4):
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
    state = _draw_start(rngs[0])
    _begin(physics, state)
    s = _row_of(_observe(state), grid)
    total, steps, over, terminated = 0.0, 0, False, False
    while not over:
        a = _choose(q, s, epsilon, method.draw_ties, rngs[1])
        state = _advance(physics, state, a)
        terminated = _is_over(state)
        if terminated and _has_diverged(state):
            _note_failure(scratch.failure, steps, state)
            return total, steps, DIVERGED
        r = _reward(terminated, False, False)
        total += r
        steps += 1
        over = terminated or steps == task.TIME_LIMIT
        s_next = _row_of(_observe(state), grid)
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
    state = _draw_start(rngs[0])
    _begin(physics, state)
    states[0] = _row_of(_observe(state), grid)
    total, steps, over, terminated = 0.0, 0, False, False
    while not over:
        actions[steps] = _choose(q, states[steps], epsilon, method.draw_ties, rngs[1])
        state = _advance(physics, state, actions[steps])
        terminated = _is_over(state)
        if terminated and _has_diverged(state):
            _note_failure(scratch.failure, steps, state)
            return total, steps, DIVERGED
        rewards[steps] = _reward(terminated, False, False)
        total += rewards[steps]
        steps += 1
        over = terminated or steps == task.TIME_LIMIT
        states[steps] = _row_of(_observe(state), grid)
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
    state = _draw_start(rng)
    _begin(physics, state)
    total, steps, over, terminated = 0.0, 0, False, False
    while not over:
        state = _advance(physics, state, actions[_row_of(_observe(state), grid)])
        terminated = _is_over(state)
        if terminated and _has_diverged(state):
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
            alpha = _on_line(method.alpha, method.alpha_final, method.slope, number)
            epsilon = _on_line(method.epsilon, method.epsilon_final, method.slope, number)
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
    modules = (cartpole_v1, discretizer, episodes, qlearning, schedules, task)
    texts = "".join(inspect.getsource(module) for module in modules) + repr(LARGEST_SANE)
    return hashlib.sha256(texts.encode()).hexdigest()


learn_chunk = _entry(_make_learn_chunk(_sources()))
play_chunk = _entry(_make_play_chunk(_sources()))
