"""The parameters of the equations, read from a compiled model.

`read_parameters` takes the file's numbers; `beyond.py` names everything else that acts on the
motion.
"""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Final

import mujoco
import numpy as np
import numpy.typing as npt

from mjcartpole import task
from mjcartpole.errors import ModelError, NotACartPoleError
from mjcartpole.physics.bodies import cart_bodies, mass_of, pole_bodies
from mjcartpole.physics.equations import Parameters
from mjcartpole.physics.model import CartPole

TILT: Final = 1e-14
"""Sine of an angle that rounding alone can leave between two axes; anything more is a tilt."""

UP: Final = np.array([0.0, 0.0, 1.0])

Vector = npt.NDArray[np.float64]


def read_parameters(cartpole: CartPole) -> Parameters:
    """The numbers that the equations need, from a compiled model.

    They are the file's own, also where an option flag keeps one of them from acting. All bodies
    below the hinge count as one rigid pole, all others below the slider as the cart. A motor's
    armature and damping act through its gear, so their share goes with the gear squared.

    Raises:
        NotACartPoleError: The pole has no mass.
        ModelError: There are several poles, or a number of the model makes no sense in the
            equations.
    """
    if cartpole.poles > 1:
        raise ModelError(f"{cartpole.name} has {several_poles(cartpole)}")
    model, slider, hinge = cartpole.model, cartpole.slider, cartpole.hinges[0]
    pole, axes = pole_of(cartpole), axes_of(cartpole)
    if pole.mass <= 0:
        name = joint_label(model, hinge)
        raise NotACartPoleError(f"{cartpole.name}: the pole, {name}, has no mass")
    gear = float(model.actuator_gear[0, 0])
    try:
        return Parameters(
            cart_mass=mass_of(model, cart_bodies(cartpole)),
            pole_mass=pole.mass,
            com_distance=float(axes.pole_frame[2] @ pole.com),
            inertia=pole.inertia,
            gravity=0.0 - float(model.opt.gravity[2]),
            slider_damping=float(model.dof_damping[slider] + gear**2 * model.actuator_damping[0]),
            hinge_damping=float(model.dof_damping[hinge]),
            slider_armature=float(
                model.dof_armature[slider] + gear**2 * model.actuator_armature[0]
            ),
            hinge_armature=float(model.dof_armature[hinge]),
            forces=forces_of(cartpole),
            timestep=float(model.opt.timestep),
            hinge_sign=-1 if np.cross(axes.hinge, UP) @ axes.slider < 0 else 1,
        )
    except ValueError as error:
        raise ModelError(f"{cartpole.name} is beyond the equations: {error}") from error


def several_poles(cartpole: CartPole) -> str:
    """Why the equations do not cover a model with several poles."""
    return f"{task.in_words(cartpole.poles)}, and the equations are those of one"


def differences(p: Parameters, q: Parameters, rtol: float = 1e-12) -> list[str]:
    """What `p` has instead of what `q` has, such as "pole mass 0.1001 instead of 0.1".

    Args:
        p: What is.
        q: What was wanted.
        rtol: Values this close, relative to the larger one, count as equal.

    Returns:
        One phrase per value that differs, in the order of the fields.
    """
    found = []
    for (label, a), (_, b) in zip(_values(p), _values(q), strict=True):
        if abs(a - b) > rtol * max(abs(a), abs(b)):
            found.append(f"{label} {_digits(a, b)} instead of {_digits(b, a)}")
    return found


def _values(p: Parameters) -> Iterator[tuple[str, float]]:
    for field in fields(p):
        value = getattr(p, field.name)
        if field.name == "forces":
            yield from ((f"force of action {i}", force) for i, force in enumerate(value))
        else:
            yield field.name.replace("_", " "), value


def _digits(value: float, other: float) -> str:
    """The fewest digits, but at least six, that tell a value from another."""
    for digits in range(6, 17):
        text = f"{value:.{digits}g}"
        if text != f"{other:.{digits}g}":
            return min(text, repr(value), key=len)
    return repr(value)


@dataclass(frozen=True)
class _Pole:
    """All bodies of a pole as one; the frame is that of the hinge's body."""

    mass: float  # kg
    com: Vector  # from the hinge, m, shape (3,)
    inertia: float  # about the centre of mass and the hinge's direction, kg m^2


@dataclass(frozen=True)
class _Axes:
    """Directions in the world when both coordinates are 0."""

    slider: Vector  # where a positive x goes, unit, shape (3,)
    hinge: Vector  # what a positive angle turns about, unit, shape (3,)
    pole_frame: Vector  # orientation of the hinge's body, shape (3, 3)


def axes_of(cartpole: CartPole, pole: int = 0) -> _Axes:
    """Where the cart's joint and a pole's point when all coordinates are 0."""
    model = cartpole.model
    data = mujoco.MjData(model)
    data.qpos[:] = 0.0  # angle 0, which a joint's `ref` can move away from the file's own pose
    mujoco.mj_kinematics(model, data)
    joint = cartpole.hinges[pole]
    frame = data.xmat[model.jnt_bodyid[joint]].reshape(3, 3)
    slider, hinge = data.xaxis[cartpole.slider], data.xaxis[joint]
    return _Axes(slider.copy(), hinge.copy(), frame.copy())


def pole_of(cartpole: CartPole, pole: int = 0) -> _Pole:
    """A pole as one rigid body, by the parallel axis theorem.

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
            frames[body] = place, turn @ _rotation(model.body_quat[body])
        position, turn = frames[body]
        places.append(position + turn @ model.body_ipos[body])
        along = axis @ turn @ _rotation(model.body_iquat[body])
        moments.append(float(along * along @ model.body_inertia[body]))
    com = places[0].copy()
    for body, place in zip(bodies, places, strict=True):
        com += model.body_mass[body] * (place - places[0]) / max(mass, mujoco.mjMINVAL)
    inertia = sum(moments)
    for body, place in zip(bodies, places, strict=True):
        arm = np.cross(axis, place - com)
        inertia += float(model.body_mass[body] * (arm @ arm))
    return _Pole(mass, com - model.jnt_pos[hinge], inertia)


def _rotation(quaternion: Vector) -> Vector:
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)


def forces_of(cartpole: CartPole) -> tuple[float, float]:
    """Push along the slider by action 0 and by action 1, N."""
    model = cartpole.model
    gear, gain = float(model.actuator_gear[0, 0]), float(model.actuator_gainprm[0, 0])
    left, right = cartpole.controls
    return gear * (gain * left), gear * (gain * right)


def joint_label(model: mujoco.MjModel, index: int) -> str:
    """A joint by its name, or by its number where it has none."""
    return label(model, mujoco.mjtObj.mjOBJ_JOINT, index)


def label(model: mujoco.MjModel, kind: mujoco.mjtObj, index: int, word: str | None = None) -> str:
    """How a person finds an element: "joint 'slider'", or "joint 0" if it has no name."""
    word = kind.name.removeprefix("mjOBJ_").lower() if word is None else word
    name = mujoco.mj_id2name(model, kind, index)
    return f"{word} '{name}'".lstrip() if name else f"{word} {index}".lstrip()
