"""One control step, its start and its end as compiled code: MuJoCo's own C step, or CartPole-v1's.

There are kinds of physics, and a function of each for everything that differs; Numba takes the one
that fits. A model that was fitted to the world is one as well, and differs from gymnasium's in its
step only. A state is a tuple of four floats, which costs no memory and no look-up; those of
several poles are read from MuJoCo's own arrays where all of them count.

`mj_step` and `mj_resetData` are called in libmujoco by address-free linking, the one form that
Numba can keep in a cache on disk.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias, TypeVar, cast

import llvmlite.binding
import numba
import numpy as np
import numpy.typing as npt
from numba import types
from numba.extending import intrinsic, overload, register_jitable

from mjcartpole import task
from mjcartpole.learning import fitted
from mjcartpole.physics import cartpole_v1
from mjcartpole.physics.simulation import FARTHEST_SANE, LARGEST_SANE
from mjcartpole.rewards import Reward

Floats = npt.NDArray[np.float64]
F = TypeVar("F", bound=Callable[..., Any])

State: TypeAlias = tuple[float, float, float, float]
"""`(x, x_dot, theta, theta_dot)`; of several poles, the largest sizes of the last two."""


class Rules(NamedTuple):
    """A `Task` as compiled code sees it, but for its reward."""

    x_limit: float
    theta_limit: float
    low: float
    width: float
    """Starting values lie in [low, low + width)."""
    time_limit: int
    turns: bool
    """Whether angles count from -pi to pi."""


class MujocoPhysics(NamedTuple):
    """A `Simulation`, which must outlive this, as compiled code sees it.

    Arrays are addresses here: Numba would count the references to each whenever this is passed on,
    which costs as much as a tenth of a step.
    """

    model: int
    """Of the mjModel."""
    data: int
    """Of the mjData, whose arrays follow."""
    qpos: int
    qvel: int
    ctrl: int
    joints: int
    """int64 indices of the cart's, then of each pole's, shape (1 + poles,)."""
    n_joints: int
    """How many joints these are."""
    left: float
    right: float
    """Controls of the two actions."""
    timestep: float
    substeps: int
    explicit: bool
    """Whether positions move by the old velocities (integrator `gym`)."""
    seen: int
    """Memory for the observation, shape (2 + 2 poles,)."""
    moved: int
    """Memory for positions, shape (1 + poles,)."""
    start: int
    """Where each joint starts, shape (1 + poles,); what is drawn is added."""


class GymPhysics(NamedTuple):
    """Gymnasium's CartPole-v1."""

    left: float
    right: float
    """N."""
    start: float
    """Angle at the start, rad; what is drawn is added."""


Physics: TypeAlias = MujocoPhysics | GymPhysics | fitted.Fitted
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


def _array_at(kind: types.Type) -> Callable[[int], Any]:
    """Return what makes an array of an address in compiled code."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.inttoptr(values[0], context.get_value_type(signature.return_type))

    pointer: Any = types.CPointer(kind)  # type: ignore[no-untyped-call]

    @intrinsic
    def array_at(context: Any, address: Any) -> Any:
        return pointer(address), generate

    return cast(Callable[[int], Any], array_at)


_floats, _ints = _array_at(types.float64), _array_at(types.int64)


_max_abs, _wrapped = compiled(task.max_abs), compiled(task.wrapped)
_carray = numba.carray  # type: ignore[attr-defined]
register_jitable(cartpole_v1.cartpole_v1_moved)
_cartpole_v1_step = compiled(cartpole_v1.cartpole_v1_step)

_mj_step = types.ExternalFunction("mj_step", types.void(types.intp, types.intp))
_mj_reset = types.ExternalFunction("mj_resetData", types.void(types.intp, types.intp))


def _for_each(mujoco: F, gym: F, **others: Callable[..., Any]) -> Callable[[F], F]:
    """Let Numba take one function of these for a stub, by the physics: its first argument.

    Args:
        mujoco: That for `MujocoPhysics`.
        gym: That for all kinds without one of their own.
        others: Those, by the names of the kinds.
    """
    functions: dict[str, Any] = {"MujocoPhysics": mujoco, **others}

    def register(stub: F) -> F:
        @overload(stub, strict=False)
        def choose(physics: AnyPhysics, *others: object) -> Any:
            return functions.get(physics.instance_class.__name__, gym)

        return stub

    return register


# --- draw a starting state, and put a cart-pole there -------------------------------------------


def _begin_mujoco(physics: AnyPhysics, rules: Rules, rng: np.random.Generator) -> State:
    _mj_reset(physics.model, physics.data)
    joints, qpos, qvel = _ints(physics.joints), _floats(physics.qpos), _floats(physics.qvel)
    start = _floats(physics.start)
    for index in range(physics.n_joints):
        qpos[joints[index]] = rules.low + rules.width * rng.random() + start[index]
        qvel[joints[index]] = rules.low + rules.width * rng.random()
    return _as_one_pole(physics, rules)


def _begin_gym(physics: AnyPhysics, rules: Rules, rng: np.random.Generator) -> State:
    x = rules.low + rules.width * rng.random()
    x_dot = rules.low + rules.width * rng.random()
    theta = rules.low + rules.width * rng.random() + physics.start
    theta_dot = rules.low + rules.width * rng.random()
    return x, x_dot, theta, theta_dot


@_for_each(_begin_mujoco, _begin_gym)
def begin(physics: AnyPhysics, rules: Rules, rng: np.random.Generator) -> State:
    """Return a starting state, in which the cart-pole is put; nothing of its past remains.

    `Generator.uniform` draws and computes each value like this.
    """
    raise NotImplementedError  # Numba takes one of those above; so below.


def _put_mujoco(physics: AnyPhysics, rules: Rules, start: Floats) -> State:
    _mj_reset(physics.model, physics.data)
    joints, qpos, qvel = _ints(physics.joints), _floats(physics.qpos), _floats(physics.qvel)
    for index in range(physics.n_joints):
        qpos[joints[index]], qvel[joints[index]] = start[2 * index], start[2 * index + 1]
    return _as_one_pole(physics, rules)


def _put_gym(physics: AnyPhysics, rules: Rules, start: Floats) -> State:
    return start[0], start[1], start[2], start[3]


@_for_each(_put_mujoco, _put_gym)
def put(physics: AnyPhysics, rules: Rules, start: Floats) -> State:
    """Return a starting state in which the cart-pole is put; nothing of its past remains."""
    raise NotImplementedError


def start_at(physics: AnyPhysics, rules: Rules, starts: Any, number: int) -> State:
    """Return the starting state of an episode: drawn by a generator, or a row of an array."""
    raise NotImplementedError


@overload(start_at, strict=False)
def _choose_start(physics: AnyPhysics, rules: Any, starts: Any, number: Any) -> Any:
    def drawn(physics: AnyPhysics, rules: Rules, starts: Any, number: int) -> State:
        return begin(physics, rules, starts)

    def given(physics: AnyPhysics, rules: Rules, starts: Any, number: int) -> State:
        return put(physics, rules, starts[number])

    return given if isinstance(starts, types.Array) else drawn


# --- move it ------------------------------------------------------------------------------------


def _advance_mujoco(physics: AnyPhysics, rules: Rules, state: State, action: int) -> State:
    joints, qpos, qvel = _ints(physics.joints), _floats(physics.qpos), _floats(physics.qvel)
    moved, h = _floats(physics.moved), physics.timestep
    _floats(physics.ctrl)[0] = physics.right if action == 1 else physics.left
    for _ in range(physics.substeps):
        for index in range(physics.n_joints):
            moved[index] = qpos[joints[index]] + h * qvel[joints[index]]
        _mj_step(physics.model, physics.data)
        if physics.explicit:
            for index in range(physics.n_joints):
                qpos[joints[index]] = moved[index]
    return _as_one_pole(physics, rules)


def _advance_gym(physics: AnyPhysics, rules: Rules, state: State, action: int) -> State:
    force = physics.right if action == 1 else physics.left
    return _cartpole_v1_step(state[0], state[1], state[2], state[3], force)


register_jitable(fitted.bounded)
register_jitable(fitted.dot)
_rod_step, _linear_step = compiled(fitted.rod_step), compiled(fitted.linear_step)


def _advance_rod(physics: AnyPhysics, rules: Rules, state: State, action: int) -> State:
    return _rod_step(physics, state, action)


def _advance_linear(physics: AnyPhysics, rules: Rules, state: State, action: int) -> State:
    return _linear_step(physics, state, action)


@_for_each(_advance_mujoco, _advance_gym, Rod=_advance_rod, Linear=_advance_linear)
def advance(physics: AnyPhysics, rules: Rules, state: State, action: int) -> State:
    """Return the state one control step later."""
    raise NotImplementedError


@compiled
def _as_one_pole(physics: AnyPhysics, rules: Rules) -> State:
    joints, qpos, qvel = _ints(physics.joints), _floats(physics.qpos), _floats(physics.qvel)
    theta, theta_dot = qpos[joints[1]], qvel[joints[1]]
    if physics.n_joints > 2:
        theta, theta_dot = _worst(qpos, physics, rules.turns), _worst(qvel, physics, False)
    return qpos[joints[0]], qvel[joints[0]], theta, theta_dot


@compiled
def _worst(values: Any, physics: AnyPhysics, turns: bool) -> float:
    """Return the largest size among the poles' values, of angles that count from -pi to pi."""
    joints, poles = _ints(physics.joints), _floats(physics.moved)
    for index in range(1, physics.n_joints):
        value = values[joints[index]]
        poles[index - 1] = _wrapped(value) if turns else value
    return _max_abs(_carray(poles, physics.n_joints - 1))


# --- look at it ---------------------------------------------------------------------------------


def _observe_mujoco(physics: AnyPhysics, rules: Rules, state: State) -> Any:
    joints, seen = _ints(physics.joints), _floats(physics.seen)
    qpos, qvel = _floats(physics.qpos), _floats(physics.qvel)
    for index in range(physics.n_joints):
        position = qpos[joints[index]]
        if rules.turns and index > 0:
            position = _wrapped(position)
        seen[2 * index] = np.float64(np.float32(position))
        seen[2 * index + 1] = np.float64(np.float32(qvel[joints[index]]))
    return seen


def _observe_gym(physics: AnyPhysics, rules: Rules, state: State) -> State:
    x, x_dot = np.float64(np.float32(state[0])), np.float64(np.float32(state[1]))
    angle = _wrapped(state[2]) if rules.turns else state[2]
    theta, theta_dot = np.float64(np.float32(angle)), np.float64(np.float32(state[3]))
    return x, x_dot, theta, theta_dot


@_for_each(_observe_mujoco, _observe_gym)
def observe(physics: AnyPhysics, rules: Rules, state: State) -> Any:
    """Return the float32 observation, as plain floats again."""
    raise NotImplementedError


@compiled
def pay(reward: Reward, rules: Rules, state: State, terminated: bool) -> float:
    """Return the reward of a step."""
    theta = _wrapped(state[2]) if rules.turns else state[2]
    return reward(state[0], state[1], theta, state[3], terminated)


@compiled
def is_over(rules: Rules, state: State) -> bool:
    """Return whether the rules end the episode, or a state gone wild does, as in the env."""
    x, x_dot, theta, theta_dot = state
    has_ended = abs(x) > rules.x_limit or abs(theta) > rules.theta_limit
    is_number = (x - theta) * 0.0 == 0.0
    is_sane = -FARTHEST_SANE < x_dot - theta_dot < FARTHEST_SANE
    return has_ended or not is_number or not is_sane


@compiled
def has_diverged(state: State) -> bool:
    """Return whether a value is NaN, or beyond what MuJoCo calls sane."""
    sane = True
    for value in state:
        sane &= -LARGEST_SANE < value < LARGEST_SANE
    return not sane


def _lean_mujoco(physics: AnyPhysics, state: State) -> float:
    joints, qpos = _ints(physics.joints), _floats(physics.qpos)
    angle: float = qpos[joints[1]]
    for index in range(2, physics.n_joints):
        if abs(qpos[joints[index]]) > abs(angle):
            angle = qpos[joints[index]]
    return angle


def _lean_gym(physics: AnyPhysics, state: State) -> float:
    return state[2]


@_for_each(_lean_mujoco, _lean_gym)
def lean(physics: AnyPhysics, state: State) -> float:
    """Return the angle of the pole that leans most, with its sign; see `most_leaning`."""
    raise NotImplementedError


def _note_mujoco(physics: AnyPhysics, state: State, steps: int, failure: Floats) -> None:
    failure[0] = steps
    joints, qpos, qvel = _ints(physics.joints), _floats(physics.qpos), _floats(physics.qvel)
    for index in range(physics.n_joints):
        failure[1 + 2 * index] = qpos[joints[index]]
        failure[2 + 2 * index] = qvel[joints[index]]


def _note_gym(physics: AnyPhysics, state: State, steps: int, failure: Floats) -> None:
    failure[0] = steps
    for index, value in enumerate(state):
        failure[1 + index] = value


@_for_each(_note_mujoco, _note_gym)
def note(physics: AnyPhysics, state: State, steps: int, failure: Floats) -> None:
    """Keep the state of a cart-pole that diverged, and after how many steps it did."""
    raise NotImplementedError
