"""One control step, its start and its end as compiled code: MuJoCo's own C step, or CartPole-v1's.

There are kinds of physics, and a function of each for everything that differs; Numba takes the one
that fits. A model that was fitted to the world is one as well, and differs from gymnasium's in its
step only. A state is a tuple of four floats, which costs no memory and no look-up; those of
several poles are read from MuJoCo's own arrays where all of them count.

`mj_step` and `mj_resetData` are called in libmujoco by address-free linking, the one form that
Numba can keep in a cache on disk.
"""

from typing import Any

import numpy as np
from numba import types
from numba.extending import overload

from mjcartpole import task
from mjcartpole.disturbances import effects as effects_of
from mjcartpole.learning import fitted
from mjcartpole.learning.kinds import Floats, Rules, State
from mjcartpole.learning.linking import INSIDE, AnyPhysics, compiled, floats, for_each, ints
from mjcartpole.physics import cartpole_v1
from mjcartpole.physics.simulation import FARTHEST_SANE, LARGEST_SANE
from mjcartpole.rewards import Reward

_wrapped = compiled(task.wrapped)
compiled(cartpole_v1.cartpole_v1_moved)
_cartpole_v1_step = compiled(cartpole_v1.cartpole_v1_step)

_control_of = compiled(task.control_of)
for _each in (effects_of._remember, effects_of._shoved):
    compiled(_each)
_actuate, _sense = compiled(effects_of.actuate), compiled(effects_of.sense)
_forget = compiled(effects_of.forget)

_mj_step = types.ExternalFunction("mj_step", types.void(types.intp, types.intp))
_mj_reset = types.ExternalFunction("mj_resetData", types.void(types.intp, types.intp))


# --- draw a starting state, and put a cart-pole there -------------------------------------------


def _begin_mujoco(physics: AnyPhysics, rules: Rules, rng: np.random.Generator) -> State:
    _mj_reset(physics.model, physics.data)
    joints, qpos, qvel = ints(physics.joints), floats(physics.qpos), floats(physics.qvel)
    start = floats(physics.start)
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


def _begin_disturbed(physics: AnyPhysics, rules: Rules, rng: np.random.Generator) -> State:
    _forget(physics.effects, floats(physics.memory))
    return begin(physics.inner, rules, rng)


@for_each(_begin_mujoco, _begin_gym, Disturbed=_begin_disturbed)
def begin(physics: AnyPhysics, rules: Rules, rng: np.random.Generator) -> State:
    """Return a starting state, in which the cart-pole is put; nothing of its past remains.

    `Generator.uniform` draws and computes each value like this.
    """
    raise NotImplementedError  # Numba takes one of those above; so below.


def _put_mujoco(physics: AnyPhysics, rules: Rules, start: Floats) -> State:
    _mj_reset(physics.model, physics.data)
    joints, qpos, qvel = ints(physics.joints), floats(physics.qpos), floats(physics.qvel)
    for index in range(physics.n_joints):
        qpos[joints[index]], qvel[joints[index]] = start[2 * index], start[2 * index + 1]
    return _as_one_pole(physics, rules)


def _put_gym(physics: AnyPhysics, rules: Rules, start: Floats) -> State:
    return start[0], start[1], start[2], start[3]


def _put_disturbed(physics: AnyPhysics, rules: Rules, start: Floats) -> State:
    _forget(physics.effects, floats(physics.memory))
    return put(physics.inner, rules, start)


@for_each(_put_mujoco, _put_gym, Disturbed=_put_disturbed)
def put(physics: AnyPhysics, rules: Rules, start: Floats) -> State:
    """Return a starting state in which the cart-pole is put; nothing of its past remains."""
    raise NotImplementedError


def start_at(physics: AnyPhysics, rules: Rules, starts: Any, number: int) -> State:
    """Return the starting state of an episode: drawn by a generator, or a row of an array."""
    raise NotImplementedError


@overload(start_at, strict=False, jit_options=INSIDE)
def _choose_start(physics: AnyPhysics, rules: Any, starts: Any, number: Any) -> Any:
    def drawn(physics: AnyPhysics, rules: Rules, starts: Any, number: int) -> State:
        return begin(physics, rules, starts)

    def given(physics: AnyPhysics, rules: Rules, starts: Any, number: int) -> State:
        return put(physics, rules, starts[number])

    return given if isinstance(starts, types.Array) else drawn


# --- move it ------------------------------------------------------------------------------------


def _advance_mujoco(physics: AnyPhysics, rules: Rules, state: State, action: int) -> State:
    floats(physics.ctrl)[0] = physics.right if action == 1 else physics.left
    return _move_mujoco(physics, rules)


@compiled
def _move_mujoco(physics: AnyPhysics, rules: Rules) -> State:
    joints, qpos, qvel = ints(physics.joints), floats(physics.qpos), floats(physics.qvel)
    moved, h = floats(physics.moved), physics.timestep
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


compiled(fitted.bounded)
compiled(fitted.dot)
_rod_step, _linear_step = compiled(fitted.rod_step), compiled(fitted.linear_step)


def _advance_rod(physics: AnyPhysics, rules: Rules, state: State, action: int) -> State:
    return _rod_step(physics, state, action)


def _advance_linear(physics: AnyPhysics, rules: Rules, state: State, action: int) -> State:
    return _linear_step(physics, state, action)


def _push_mujoco(
    physics: AnyPhysics, rules: Rules, state: State, push: float, force: float
) -> State:
    floats(physics.ctrl)[0] = _control_of(push, (physics.left, physics.right))
    floats(physics.applied)[ints(physics.joints)[0]] = force
    return _move_mujoco(physics, rules)


def _push_gym(physics: AnyPhysics, rules: Rules, state: State, push: float, force: float) -> State:
    total = _control_of(push, (physics.left, physics.right)) + force
    return _cartpole_v1_step(state[0], state[1], state[2], state[3], total)


@for_each(_push_mujoco, _push_gym)
def push(physics: AnyPhysics, rules: Rules, state: State, push: float, force: float) -> State:
    """Return the state one control step later, after a push from -1 to 1 and a force besides, N."""
    raise NotImplementedError


def _advance_disturbed(physics: AnyPhysics, rules: Rules, state: State, action: int) -> State:
    given = 1.0 if action == 1 else -1.0
    made, force = _actuate(physics.effects, floats(physics.memory), given, physics.rng)
    return push(physics.inner, rules, state, made, force)


@for_each(
    _advance_mujoco,
    _advance_gym,
    Rod=_advance_rod,
    Linear=_advance_linear,
    Disturbed=_advance_disturbed,
)
def advance(physics: AnyPhysics, rules: Rules, state: State, action: int) -> State:
    """Return the state one control step later."""
    raise NotImplementedError


@compiled
def _as_one_pole(physics: AnyPhysics, rules: Rules) -> State:
    joints, qpos, qvel = ints(physics.joints), floats(physics.qpos), floats(physics.qvel)
    theta, theta_dot = qpos[joints[1]], qvel[joints[1]]
    if physics.n_joints > 2:
        theta, theta_dot = _worst(qpos, physics, rules.turns), _worst(qvel, physics, False)
    return qpos[joints[0]], qvel[joints[0]], theta, theta_dot


@compiled
def _worst(values: Any, physics: AnyPhysics, turns: bool) -> float:
    """Return the `max_abs` of the poles' values, of angles that count from -pi to pi.

    What makes an array of them at an address, for that function, takes a command long to load.
    """
    joints = ints(physics.joints)
    largest, total = 0.0, 0.0
    for index in range(1, physics.n_joints):
        value = values[joints[index]]
        value = _wrapped(value) if turns else value
        largest = max(largest, abs(value))
        total += value
    return largest + 0.0 * total


# --- look at it ---------------------------------------------------------------------------------


def _read_mujoco(physics: AnyPhysics, rules: Rules, state: State, seen: Any) -> None:
    joints, qpos, qvel = ints(physics.joints), floats(physics.qpos), floats(physics.qvel)
    for index in range(physics.n_joints):
        position = qpos[joints[index]]
        seen[2 * index] = _wrapped(position) if rules.turns and index > 0 else position
        seen[2 * index + 1] = qvel[joints[index]]


def _read_gym(physics: AnyPhysics, rules: Rules, state: State, seen: Any) -> None:
    seen[0], seen[1], seen[3] = state[0], state[1], state[3]
    seen[2] = _wrapped(state[2]) if rules.turns else state[2]


@for_each(_read_mujoco, _read_gym)
def read(physics: AnyPhysics, rules: Rules, state: State, seen: Any) -> None:
    """Write the state as rules have it."""
    raise NotImplementedError


@compiled
def _round(seen: Any, size: int) -> None:
    for index in range(size):
        seen[index] = np.float64(np.float32(seen[index]))


def _observe_mujoco(physics: AnyPhysics, rules: Rules, state: State) -> Any:
    seen = floats(physics.seen)
    read(physics, rules, state, seen)
    _round(seen, 2 * physics.n_joints)
    return seen


def _observe_gym(physics: AnyPhysics, rules: Rules, state: State) -> State:
    x, x_dot = np.float64(np.float32(state[0])), np.float64(np.float32(state[1]))
    angle = _wrapped(state[2]) if rules.turns else state[2]
    theta, theta_dot = np.float64(np.float32(angle)), np.float64(np.float32(state[3]))
    return x, x_dot, theta, theta_dot


def _observe_disturbed(physics: AnyPhysics, rules: Rules, state: State) -> Any:
    seen, effects = floats(physics.seen), physics.effects
    read(physics.inner, rules, state, seen)
    _sense(effects, floats(physics.memory), seen, physics.rng)
    _round(seen, effects.size + effects.actions)
    return seen


@for_each(_observe_mujoco, _observe_gym, Disturbed=_observe_disturbed)
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
    joints, qpos = ints(physics.joints), floats(physics.qpos)
    angle: float = qpos[joints[1]]
    for index in range(2, physics.n_joints):
        if abs(qpos[joints[index]]) > abs(angle):
            angle = qpos[joints[index]]
    return angle


def _lean_gym(physics: AnyPhysics, state: State) -> float:
    return state[2]


def _lean_disturbed(physics: AnyPhysics, state: State) -> float:
    return lean(physics.inner, state)


@for_each(_lean_mujoco, _lean_gym, Disturbed=_lean_disturbed)
def lean(physics: AnyPhysics, state: State) -> float:
    """Return the angle of the pole that leans most, with its sign; see `most_leaning`."""
    raise NotImplementedError


def _note_mujoco(physics: AnyPhysics, state: State, steps: int, failure: Floats) -> None:
    failure[0] = steps
    joints, qpos, qvel = ints(physics.joints), floats(physics.qpos), floats(physics.qvel)
    for index in range(physics.n_joints):
        failure[1 + 2 * index] = qpos[joints[index]]
        failure[2 + 2 * index] = qvel[joints[index]]


def _note_gym(physics: AnyPhysics, state: State, steps: int, failure: Floats) -> None:
    failure[0] = steps
    for index, value in enumerate(state):
        failure[1 + index] = value


def _note_disturbed(physics: AnyPhysics, state: State, steps: int, failure: Floats) -> None:
    note(physics.inner, state, steps, failure)


@for_each(_note_mujoco, _note_gym, Disturbed=_note_disturbed)
def note(physics: AnyPhysics, state: State, steps: int, failure: Floats) -> None:
    """Keep the state of a cart-pole that diverged, and after how many steps it did."""
    raise NotImplementedError
