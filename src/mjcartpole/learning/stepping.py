"""One control step, its start and its end as compiled code: MuJoCo's own C step, or CartPole-v1's.

There are three kinds of physics, and a function of each for everything that differs; Numba takes
the one that fits. With one pole a state is a tuple of four floats, which costs no memory and no
look-up; with several it is an array that the physics own.

`mj_step` and `mj_resetData` are called in libmujoco by address-free linking, the one form that
Numba can keep in a cache on disk.
"""

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
from mjcartpole.physics import cartpole_v1
from mjcartpole.physics.simulation import FARTHEST_SANE, LARGEST_SANE

Floats = npt.NDArray[np.float64]
F = TypeVar("F", bound=Callable[..., Any])

State: TypeAlias = Any
"""`(x, x_dot, theta, theta_dot)` as a tuple; with several poles an array, shape (2 + 2 poles,)."""


class MujocoPhysics(NamedTuple):
    """A `Simulation` of one pole, which must outlive this, as compiled code sees it."""

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


class PolesPhysics(NamedTuple):
    """The same with several poles."""

    model: int
    data: int
    qpos: Floats
    qvel: Floats
    ctrl: Floats
    joints: npt.NDArray[np.int64]
    """Of the cart, then of each pole, shape (1 + poles,)."""
    left: float
    right: float
    timestep: float
    substeps: int
    explicit: bool
    state: Floats
    """Memory for the state, shape (2 + 2 poles,)."""
    seen: Floats
    """Memory for the observation, shape (2 + 2 poles,)."""
    moved: Floats
    """Memory for positions, shape (1 + poles,)."""


class GymPhysics(NamedTuple):
    """Gymnasium's CartPole-v1."""

    left: float
    right: float
    """N."""


Physics: TypeAlias = MujocoPhysics | PolesPhysics | GymPhysics
AnyPhysics: TypeAlias = Any
"""One of them, where Numba is to see one name for all."""


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


_has_terminated = compiled(task.has_terminated)
_farthest = compiled(task.max_abs)
_cartpole_v1_step = compiled(cartpole_v1.cartpole_v1_step)

_mj_step = types.ExternalFunction("mj_step", types.void(types.intp, types.intp))
_mj_reset = types.ExternalFunction("mj_resetData", types.void(types.intp, types.intp))


# --- draw a starting state ----------------------------------------------------------------------


def draw_start(physics: AnyPhysics, rng: np.random.Generator) -> State:
    """A starting state: `Generator.uniform` draws and computes each value like this."""
    raise NotImplementedError  # Numba takes one of those below.


_LOW: Final = task.RESET_LOW
_WIDTH: Final = task.RESET_HIGH - task.RESET_LOW


def _draw_one_pole(physics: AnyPhysics, rng: np.random.Generator) -> State:
    x = _LOW + _WIDTH * rng.random()
    x_dot = _LOW + _WIDTH * rng.random()
    theta = _LOW + _WIDTH * rng.random()
    theta_dot = _LOW + _WIDTH * rng.random()
    return x, x_dot, theta, theta_dot


def _draw_poles(physics: AnyPhysics, rng: np.random.Generator) -> State:
    state = physics.state
    for index in range(len(state)):
        state[index] = _LOW + _WIDTH * rng.random()
    return state


@overload(draw_start)
def _choose_draw(physics: AnyPhysics, rng: np.random.Generator) -> Callable[..., State]:
    return _draw_poles if physics.instance_class is PolesPhysics else _draw_one_pole


# --- put a cart-pole there ----------------------------------------------------------------------


def begin(physics: AnyPhysics, state: State) -> None:
    """Put a cart-pole into a state; nothing of its past remains."""
    raise NotImplementedError


def _begin_mujoco(physics: AnyPhysics, state: State) -> None:
    _mj_reset(physics.model, physics.data)
    physics.qpos[physics.slider], physics.qvel[physics.slider] = state[0], state[1]
    physics.qpos[physics.hinge], physics.qvel[physics.hinge] = state[2], state[3]


def _begin_poles(physics: AnyPhysics, state: State) -> None:
    _mj_reset(physics.model, physics.data)
    for index, joint in enumerate(physics.joints):
        physics.qpos[joint], physics.qvel[joint] = state[2 * index], state[2 * index + 1]


def _begin_gym(physics: AnyPhysics, state: State) -> None:
    pass


@overload(begin)
def _choose_begin(physics: AnyPhysics, state: State) -> Callable[..., None]:
    kind = {MujocoPhysics: _begin_mujoco, PolesPhysics: _begin_poles, GymPhysics: _begin_gym}
    return kind[physics.instance_class]


# --- move it ------------------------------------------------------------------------------------


def advance(physics: AnyPhysics, state: State, action: int) -> State:
    """The state one control step later."""
    raise NotImplementedError


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


def _advance_poles(physics: AnyPhysics, state: State, action: int) -> State:
    qpos, qvel, h = physics.qpos, physics.qvel, physics.timestep
    joints, moved = physics.joints, physics.moved
    physics.ctrl[0] = physics.right if action == 1 else physics.left
    for _ in range(physics.substeps):
        for index, joint in enumerate(joints):
            moved[index] = qpos[joint] + h * qvel[joint]
        _mj_step(physics.model, physics.data)
        if physics.explicit:
            for index, joint in enumerate(joints):
                qpos[joint] = moved[index]
    for index, joint in enumerate(joints):
        state[2 * index], state[2 * index + 1] = qpos[joint], qvel[joint]
    return state


def _advance_gym(physics: AnyPhysics, state: State, action: int) -> State:
    force = physics.right if action == 1 else physics.left
    return _cartpole_v1_step(state[0], state[1], state[2], state[3], force)


@overload(advance)
def _choose_advance(physics: AnyPhysics, state: State, action: int) -> Callable[..., State]:
    kind = {MujocoPhysics: _advance_mujoco, PolesPhysics: _advance_poles, GymPhysics: _advance_gym}
    return kind[physics.instance_class]


# --- look at it ---------------------------------------------------------------------------------


def observe(physics: AnyPhysics, state: State) -> State:
    """The float32 observation, as plain floats again."""
    raise NotImplementedError


def _observe_one_pole(physics: AnyPhysics, state: State) -> State:
    x, x_dot = np.float64(np.float32(state[0])), np.float64(np.float32(state[1]))
    theta, theta_dot = np.float64(np.float32(state[2])), np.float64(np.float32(state[3]))
    return x, x_dot, theta, theta_dot


def _observe_poles(physics: AnyPhysics, state: State) -> State:
    seen = physics.seen
    for index in range(len(state)):
        seen[index] = np.float64(np.float32(state[index]))
    return seen


@overload(observe)
def _choose_observe(physics: AnyPhysics, state: State) -> Callable[..., State]:
    return _observe_poles if physics.instance_class is PolesPhysics else _observe_one_pole


def is_over(physics: AnyPhysics, state: State) -> bool:
    """Whether the rules end the episode, or a state gone wild does, as in the environment."""
    raise NotImplementedError


@compiled
def _is_over(x: float, x_dot: float, theta: float, theta_dot: float) -> bool:
    is_number = (x - theta) * 0.0 == 0.0
    is_sane = -FARTHEST_SANE < x_dot - theta_dot < FARTHEST_SANE
    return _has_terminated(x, theta) or not is_number or not is_sane


def _is_over_one_pole(physics: AnyPhysics, state: State) -> bool:
    return _is_over(state[0], state[1], state[2], state[3])


def _is_over_poles(physics: AnyPhysics, state: State) -> bool:
    return _is_over(state[0], state[1], _farthest(state[2::2]), _farthest(state[3::2]))


@overload(is_over)
def _choose_is_over(physics: AnyPhysics, state: State) -> Callable[..., bool]:
    return _is_over_poles if physics.instance_class is PolesPhysics else _is_over_one_pole


@compiled
def has_diverged(state: State) -> bool:
    """Whether a value is NaN, or beyond what MuJoCo calls sane."""
    sane = True
    for value in state:
        sane &= -LARGEST_SANE < value < LARGEST_SANE
    return not sane
