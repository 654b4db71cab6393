"""The parameters of the equations, read from a compiled model.

`read_parameters` takes the numbers that act; `unmodelled_effects.py` names all else that acts.
"""

import copy
import math
from collections.abc import Iterable, Iterator
from dataclasses import fields, replace
from typing import Any, Final, NamedTuple

import mujoco
import numpy as np

from mjcartpole import task
from mjcartpole.errors import ModelError, NotACartPoleError
from mjcartpole.physics.bodies import cart_bodies, data_at_zero, mass_of, pole_bodies
from mjcartpole.physics.cartpole import CartPole, Vector
from mjcartpole.physics.dry_friction import DryFriction
from mjcartpole.physics.equations import Parameters
from mjcartpole.physics.structure import cross, directions, push

TILT: Final = 1e-14
"""Sine of an angle that rounding alone can leave between two axes; anything more is a tilt."""


def read_parameters(cartpole: CartPole) -> Parameters:
    """Return the numbers that the equations need, from a compiled model.

    They are those that act: what an option flag of the file switches off is 0. All bodies below
    the hinge count as one rigid pole, all others below the slider as the cart. A motor's armature
    and damping act through its gear, so their share goes with the gear squared.

    Raises:
        NotACartPoleError: The pole has no mass.
        ModelError: There are several poles, or a number of the model makes no sense in the
            equations.
    """
    if cartpole.poles > 1:
        raise ModelError(f"{cartpole.name} has {several_poles(cartpole)}")
    model, (slider, hinge), pole = cartpole.model, cartpole.joints, pole_of(cartpole)
    if pole.mass <= 0:
        raise NotACartPoleError(
            f"{cartpole.name}: the pole, {joint_label(model, hinge)}, has no mass"
        )
    motor, bit, frictions = cartpole.motor, mujoco.mjtDisableBit, _frictions(cartpole)
    gear_squared = float(model.actuator_gear[motor, 0]) ** 2
    slider_damping = model.dof_damping[slider] + gear_squared * model.actuator_damping[motor]
    slider_armature = model.dof_armature[slider] + gear_squared * model.actuator_armature[motor]
    damps, weighs = is_on(model, bit.mjDSBL_DAMPER), is_on(model, bit.mjDSBL_GRAVITY)
    try:
        return Parameters(
            cart_mass=mass_of(model, cart_bodies(cartpole)),
            pole_mass=pole.mass,
            inertia=pole.inertia,
            gravity=weighs * float(np.linalg.norm(model.opt.gravity)),
            slider_damping=damps * float(slider_damping),
            hinge_damping=damps * float(model.dof_damping[hinge]),
            motor_damping=_feedback(cartpole),
            slider_armature=float(slider_armature),
            hinge_armature=float(model.dof_armature[hinge]),
            forces=_acting_forces(cartpole),
            timestep=cartpole.timestep,
            slider_friction=frictions.get(slider),
            hinge_friction=frictions.get(hinge),
            **geometry_of(cartpole),
        )
    except ValueError as error:
        raise ModelError(f"{cartpole.name} is beyond the equations: {error}") from error


def is_on(model: mujoco.MjModel, *flags: mujoco.mjtDisableBit) -> bool:
    """Return whether a model's option flags leave all of these switched on."""
    return not any(model.opt.disableflags & int(flag) for flag in flags)


def can_push(cartpole: CartPole) -> bool:
    """Return whether the motor acts, by the file's flags."""
    model = cartpole.model
    group = int(model.actuator_group[cartpole.motor])
    enabled = not (0 <= group < 31 and model.opt.disableactuator >> group & 1)
    return enabled and is_on(model, mujoco.mjtDisableBit.mjDSBL_ACTUATION)


def _feedback(cartpole: CartPole) -> float:
    """Return how much the motor itself brakes the cart, N s/m: velocity feedback."""
    model, motor = cartpole.model, cartpole.motor
    if model.actuator_biastype[motor] != mujoco.mjtBias.mjBIAS_AFFINE or not can_push(cartpole):
        return 0.0
    gear = float(model.actuator_gear[motor, 0])
    return 0.0 - gear**2 * float(model.actuator_biasprm[motor, 2])


def _acting_forces(cartpole: CartPole) -> tuple[float, float]:
    """Return the push of either action at rest at x = 0, after all that clips it, N."""
    if not can_push(cartpole):
        return 0.0, 0.0
    left, right = (push(cartpole.model, cartpole.slider, control) for control in cartpole.controls)
    return left, right


def _frictions(cartpole: CartPole) -> dict[int, DryFriction]:
    """Return dry friction by joint, with the softness that MuJoCo's constraint solver gives it."""
    # As explicit Euler and the other integrators solve it; `discrete` has its own way.
    model = copy.copy(cartpole.model)
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
    data = data_at_zero(model)
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fwdVelocity(model, data)
    kind = int(mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF)
    return {
        int(data.efc_id[row]): DryFriction(
            loss=float(data.efc_frictionloss[row]),
            softness=float(data.efc_R[row]),
            rate=float(data.efc_KBIP[row, 1]),
        )
        for row in range(data.nefc)
        if data.efc_type[row] == kind
    }


def geometry_of(cartpole: CartPole, up: Vector | None = None) -> dict[str, Any]:
    """Return the parameters that say where the axes and the pole point; what rounding makes is 0.

    `up` is a unit vector, shape (3,); against gravity if it is left out.
    """
    axes, gravity = directions(cartpole), cartpole.model.opt.gravity
    if up is None:
        up = -gravity / np.linalg.norm(gravity) if gravity.any() else axes.up
    # In the plane in which the pole turns: up, and where a positive angle leans.
    high = up - (axes.hinge @ up) * axes.hinge
    high /= np.linalg.norm(high)
    aside = np.cross(axes.hinge, high)
    com = axes.frame @ pole_of(cartpole).com
    above, beside = float(com @ high), float(com @ aside)
    leans, side = abs(beside) > TILT * abs(above), 1 if above >= 0 else -1
    return {
        "com_distance": math.copysign(math.hypot(above, beside), above) if leans else above,
        "hinge_sign": -1 if axes.rail @ aside < 0 else 1,
        "rail_tilt": _angle(axes.rail, up),
        "hinge_tilt": _angle(axes.hinge, up),
        "skew": _angle(axes.rail, axes.hinge),
        "lean": math.atan2(side * beside, side * above) if leans else 0.0,
    }


def _angle(axis: Vector, other: Vector) -> float:
    """Return between an axis and the plane that is square to another, rad."""
    sine = float(axis @ other)
    return 0.0 if abs(sine) < TILT else math.asin(min(max(sine, -1.0), 1.0))


def several_poles(cartpole: CartPole) -> str:
    """Say why the equations do not cover a model with several poles."""
    return f"{task.in_words(cartpole.poles)}, and the equations are those of one"


def take(p: Parameters, other: Parameters, names: Iterable[str]) -> Parameters:
    """Return `p` with some of another's parameters."""
    return replace(p, **{name: getattr(other, name) for name in names})


def differences(p: Parameters, q: Parameters, rtol: float = 1e-12) -> list[str]:
    """Return what `p` has instead of what `q` has, such as "pole mass 0.1001 instead of 0.1".

    One phrase per value that differs by more than `rtol`, relative to the larger one.
    """
    found = []
    for (label, a), (_, b) in zip(_values(p), _values(q), strict=True):
        if abs(a - b) > rtol * max(abs(a), abs(b)):
            found.append(f"{label} {_digits(a, b)} instead of {_digits(b, a)}")
    return found


def _values(p: Parameters) -> Iterator[tuple[str, float]]:
    for field in fields(p):
        value = getattr(p, field.name)
        label = field.name.replace("_", " ")
        if field.name == "forces":
            yield from ((f"force of action {i}", force) for i, force in enumerate(value))
        elif field.name.endswith("friction"):
            for part in fields(DryFriction):
                number = getattr(value, part.name) if value else 0.0
                yield label if part.name == "loss" else f"{label}'s {part.name}", number
        else:
            yield label, value


def _digits(value: float, other: float) -> str:
    """Return the fewest digits, but at least six, that tell a value from another."""
    for digits in range(6, 17):
        text = f"{value:.{digits}g}"
        if text != f"{other:.{digits}g}":
            return min(text, repr(value), key=len)
    return repr(value)


class _Pole(NamedTuple):
    """All bodies of a pole as one; the frame is that of the hinge's body."""

    mass: float  # kg
    com: Vector  # from the hinge, m, shape (3,)
    inertia: float  # about the centre of mass and the hinge's direction, kg m^2


def pole_of(cartpole: CartPole, pole: int = 0) -> _Pole:
    """Return a pole as one rigid body, by the parallel axis theorem.

    Positions are composed in the frame of the hinge's body, not taken from the world: there a
    pole on a table 1.3 m high has lost the last digit of its length.
    """
    model, hinge = cartpole.model, cartpole.hinges[pole]
    root, axis = int(model.jnt_bodyid[hinge]), model.jnt_axis[hinge]
    bodies = pole_bodies(cartpole, pole)
    if not bodies:
        return _Pole(0.0, np.zeros(3), 0.0)
    mass = mass_of(model, bodies)
    frames = {root: (np.zeros(3), np.eye(3))}
    places, moments = [], []
    for body in bodies:
        if body != root:
            position, turn = frames[int(model.body_parentid[body])]
            place = position + turn @ model.body_pos[body]
            frames[body] = place, turn @ rotation(model.body_quat[body])
        position, turn = frames[body]
        # The engine takes a centre of mass nearer than 1e-6 m for in place.
        in_place = model.body_sameframe[body] == mujoco.mjtSameFrame.mjSAMEFRAME_BODY
        places.append(position if in_place else position + turn @ model.body_ipos[body])
        along = axis @ turn @ rotation(model.body_iquat[body])
        moments.append(float(along * along @ model.body_inertia[body]))
    com = places[0].copy()
    for body, place in zip(bodies, places, strict=True):
        com += model.body_mass[body] * (place - places[0]) / max(mass, mujoco.mjMINVAL)
    inertia = sum(moments)
    for body, place in zip(bodies, places, strict=True):
        arm = cross(axis, place - com)
        inertia += float(model.body_mass[body] * (arm @ arm))
    return _Pole(mass, com - model.jnt_pos[hinge], inertia)


def rotation(quaternion: Vector) -> Vector:
    """Return the rotation matrix of a quaternion, shape (3, 3)."""
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)


def forces_of(cartpole: CartPole) -> tuple[float, float]:
    """Return push along the slider by action 0 and by action 1, N, whatever clips it."""
    model, motor, (left, right) = cartpole.model, cartpole.motor, cartpole.controls
    gear, gain = float(model.actuator_gear[motor, 0]), float(model.actuator_gainprm[motor, 0])
    return gear * (gain * left), gear * (gain * right)


def joint_label(model: mujoco.MjModel, index: int) -> str:
    """Return a joint by its name, or by its number where it has none."""
    return label(model, mujoco.mjtObj.mjOBJ_JOINT, index)


def label(model: mujoco.MjModel, kind: mujoco.mjtObj, index: int, word: str | None = None) -> str:
    """Return how a person finds an element: "joint 'slider'", or "joint 0" if it has no name."""
    word = kind.name.removeprefix("mjOBJ_").lower() if word is None else word
    name = mujoco.mj_id2name(model, kind, index)
    return f"{word} '{name}'".lstrip() if name else f"{word} {index}".lstrip()
