"""The parameters of the equations, read from a compiled model, and what the equations leave out.

`read_parameters` takes the file's numbers; `beyond_equations` names everything else that acts on
the motion. Where the second is empty, MuJoCo and `equations` with the first must agree.
"""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Final

import mujoco
import numpy as np
import numpy.typing as npt

from mjcartpole.errors import ModelError, NotACartPoleError
from mjcartpole.physics.equations import Parameters
from mjcartpole.physics.model import CartPole

TILT: Final = 1e-14
"""Sine of an angle that rounding alone can leave between two axes; anything more is a tilt."""

_UP: Final = np.array([0.0, 0.0, 1.0])

Vector = npt.NDArray[np.float64]


def read_parameters(cartpole: CartPole) -> Parameters:
    """The numbers that the equations need, from a compiled model.

    They are the file's own, also where an option flag keeps one of them from acting. All bodies
    below the hinge count as one rigid pole, all others below the slider as the cart. A motor's
    armature and damping act through its gear, so their share goes with the gear squared.

    Raises:
        NotACartPoleError: The pole has no mass.
        ModelError: A number of the model makes no sense in the equations.
    """
    model, slider, hinge = cartpole.model, cartpole.slider, cartpole.hinge
    pole, axes = _pole(model, hinge), _axes(cartpole)
    if pole.mass <= 0:
        raise NotACartPoleError(f"{cartpole.name}: the pole, {_joint(model, hinge)}, has no mass")
    gear = float(model.actuator_gear[0, 0])
    try:
        return Parameters(
            cart_mass=_mass(model, _cart_bodies(cartpole)),
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
            forces=_forces(cartpole),
            timestep=float(model.opt.timestep),
            hinge_sign=-1 if np.cross(axes.hinge, _UP) @ axes.slider < 0 else 1,
        )
    except ValueError as error:
        raise ModelError(f"{cartpole.name} is beyond the equations: {error}") from error


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


def beyond_equations(cartpole: CartPole) -> list[str]:
    """Everything in a model that acts on its motion and is not in the equations, by name.

    What a flag of the file switches off, or what cannot act (a tendon without stiffness, the
    reference angle of a pole that is upright at angle 0), is not listed. Contacts count where two
    geoms may collide by MuJoCo's rules, wherever they are.

    Returns:
        One phrase each; empty if the equations cover the model.
    """
    found: list[str] = []
    for look in (_directions, _joints, _actuator, _contacts, _ties, _surroundings, _switches):
        found.extend(look(cartpole))
    return found


def beyond_step(cartpole: CartPole) -> list[str]:
    """Why one step of the file's own integrator is not the semi-implicit `equations.step`.

    Returns:
        One phrase each; empty for MuJoCo's `Euler` with implicit damping and for `implicitfast`,
        which leaves out what turns with the velocity and so is the same here.
    """
    model, names = cartpole.model, mujoco.mjtIntegrator
    integrator, found = names(int(model.opt.integrator)), []
    if integrator not in {names.mjINT_EULER, names.mjINT_IMPLICITFAST}:
        found.append(f"integrator {integrator.name.removeprefix('mjINT_')} instead of Euler")
    damped = model.dof_damping.any() or model.actuator_damping.any()
    explicit = not _on(model, mujoco.mjtDisableBit.mjDSBL_EULERDAMP)
    if integrator == names.mjINT_EULER and damped and explicit:
        found.append("implicit damping (eulerdamp) switched off")
    return found


# --- the bodies ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Pole:
    """All bodies below the hinge as one; the frame is that of the hinge's body."""

    mass: float  # kg
    com: Vector  # from the hinge, m, shape (3,)
    inertia: float  # about the centre of mass and the hinge's direction, kg m^2


@dataclass(frozen=True)
class _Axes:
    """Directions in the world when both coordinates are 0."""

    slider: Vector  # where a positive x goes, unit, shape (3,)
    hinge: Vector  # what a positive angle turns about, unit, shape (3,)
    pole_frame: Vector  # orientation of the hinge's body, shape (3, 3)


def _axes(cartpole: CartPole) -> _Axes:
    model = cartpole.model
    data = mujoco.MjData(model)
    data.qpos[:] = 0.0  # angle 0, which a joint's `ref` can move away from the file's own pose
    mujoco.mj_kinematics(model, data)
    frame = data.xmat[model.jnt_bodyid[cartpole.hinge]].reshape(3, 3)
    slider, hinge = data.xaxis[cartpole.slider], data.xaxis[cartpole.hinge]
    return _Axes(slider.copy(), hinge.copy(), frame.copy())


def _pole(model: mujoco.MjModel, hinge: int) -> _Pole:
    """The pole as one rigid body, by the parallel axis theorem.

    Positions are composed in the frame of the hinge's body, not taken from the world: there a
    pole on a table 1.3 m high has lost the last digit of its length.
    """
    root, axis = int(model.jnt_bodyid[hinge]), model.jnt_axis[hinge]
    bodies = _subtree(model, root)
    mass = _mass(model, bodies)
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


def _subtree(model: mujoco.MjModel, root: int) -> list[int]:
    """A body and all below it; parents come before their children."""
    inside = [root]
    for body in range(root + 1, model.nbody):
        if int(model.body_parentid[body]) in inside:
            inside.append(body)
    return inside


def _moving_bodies(cartpole: CartPole) -> list[int]:
    return _subtree(cartpole.model, int(cartpole.model.jnt_bodyid[cartpole.slider]))


def _cart_bodies(cartpole: CartPole) -> list[int]:
    model = cartpole.model
    pole = _subtree(model, int(model.jnt_bodyid[cartpole.hinge]))
    return [body for body in _moving_bodies(cartpole) if body not in pole]


def _mass(model: mujoco.MjModel, bodies: list[int]) -> float:
    return float(sum(float(model.body_mass[body]) for body in bodies))


def _rotation(quaternion: Vector) -> Vector:
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)


def _forces(cartpole: CartPole) -> tuple[float, float]:
    model = cartpole.model
    gear, gain = float(model.actuator_gear[0, 0]), float(model.actuator_gainprm[0, 0])
    left, right = cartpole.controls
    return gear * (gain * left), gear * (gain * right)


# --- what the equations leave out ---------------------------------------------------------------


def _directions(cartpole: CartPole) -> Iterator[str]:
    """Tilted axes, and a pole that does not stand at angle 0."""
    model, axes = cartpole.model, _axes(cartpole)
    slider, hinge = _joint(model, cartpole.slider), _joint(model, cartpole.hinge)
    if abs(axes.slider[2]) > TILT:
        yield f"slide axis of {slider} is tilted, not horizontal"
    if abs(axes.hinge[2]) > TILT:
        yield f"hinge axis of {hinge} is tilted, not horizontal"
    if abs(axes.hinge @ axes.slider) > TILT:
        yield f"hinge axis of {hinge} is not perpendicular to the slide axis of {slider}"
    same_body = model.jnt_bodyid[cartpole.slider] == model.jnt_bodyid[cartpole.hinge]
    if same_body and cartpole.hinge < cartpole.slider:
        yield f"slide axis of {slider} turns with the pole: {hinge} comes first in the same body"
    com = axes.pole_frame @ _pole(model, cartpole.hinge).com
    beside = float(com @ axes.slider)
    if abs(beside) > TILT * np.abs(com).max():
        ref = float(model.qpos0[cartpole.hinge])
        reason = f" (its ref is {ref:g} rad)" if ref else ""
        yield (
            f"the pole's centre of mass is {abs(beside):.3g} m beside {hinge} at angle 0{reason}"
        )


def _joints(cartpole: CartPole) -> Iterator[str]:
    """Limits, friction loss, springs and damping that is not viscous."""
    model, bit = cartpole.model, mujoco.mjtDisableBit
    solver = _on(model, bit.mjDSBL_CONSTRAINT)
    for joint in (cartpole.slider, cartpole.hinge):
        name = _joint(model, joint)
        if model.jnt_limited[joint] and solver and _on(model, bit.mjDSBL_LIMIT):
            low, high = model.jnt_range[joint]
            yield f"limit of {name} at {low:g} and {high:g}"
        if model.dof_frictionloss[joint] and solver and _on(model, bit.mjDSBL_FRICTIONLOSS):
            yield f"friction loss in {name}"
        spring = model.jnt_stiffness[joint] or model.jnt_stiffnesspoly[joint].any()
        if spring and _on(model, bit.mjDSBL_SPRING):
            yield f"spring (stiffness) in {name}"
        if model.dof_dampingpoly[joint].any() and _on(model, bit.mjDSBL_DAMPER):
            yield f"damping of {name} is not proportional to the velocity"


def _actuator(cartpole: CartPole) -> Iterator[str]:
    """Whatever makes the actuator more than a motor: force = gear * gain * control."""
    model = cartpole.model
    name = _named(model, mujoco.mjtObj.mjOBJ_ACTUATOR, 0)
    if model.actuator_gaintype[0] != mujoco.mjtGain.mjGAIN_FIXED:
        yield f"gain of {name} is not fixed"
    if model.actuator_biastype[0] != mujoco.mjtBias.mjBIAS_NONE and model.actuator_biasprm.any():
        yield f"bias (servo, velocity feedback) of {name}"
    if model.actuator_dyntype[0] != mujoco.mjtDyn.mjDYN_NONE:
        yield f"activation dynamics of {name}"
    if model.actuator_delay[0] > 0:
        yield f"delay of {name}"
    if model.actuator_dampingpoly[0].any():
        yield f"damping of {name} is not proportional to the velocity"
    if model.opt.disableactuator >> int(model.actuator_group[0]) & 1:
        yield f"{name} is in a disabled group"
    forces = np.array(cartpole.controls) * model.actuator_gainprm[0, 0]
    if model.actuator_forcelimited[0] and _clips(model.actuator_forcerange[0], forces):
        yield f"force range of {name} clips its force"
    slider, pushes = cartpole.slider, np.array(_forces(cartpole))
    if model.jnt_actfrclimited[slider] and _clips(model.jnt_actfrcrange[slider], pushes):
        yield f"actuator force range of {_joint(model, slider)} clips the force of {name}"


def _clips(interval: Vector, forces: Vector) -> bool:
    return bool((np.clip(forces, *interval) != forces).any())


def _contacts(cartpole: CartPole) -> Iterator[str]:
    """Pairs of geoms that may touch, by MuJoCo's filters; a fixed pair counts as it stands."""
    model, bit = cartpole.model, mujoco.mjtDisableBit
    if not (_on(model, bit.mjDSBL_CONTACT) and _on(model, bit.mjDSBL_CONSTRAINT)):
        return
    weld = model.body_weldid[model.geom_bodyid].tolist()
    moves = np.isin(model.geom_bodyid, _moving_bodies(cartpole)).tolist()
    explicit = set(zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True))
    for a in range(model.ngeom):
        for b in range(a + 1, model.ngeom):
            if weld[a] == weld[b] or not (moves[a] or moves[b]):
                continue
            if {(a, b), (b, a)} & explicit or _may_collide(model, a, b):
                names = [_named(model, mujoco.mjtObj.mjOBJ_GEOM, geom, "") for geom in (a, b)]
                yield f"contact between geoms {' and '.join(names)}"


def _may_collide(model: mujoco.MjModel, a: int, b: int) -> bool:
    """MuJoCo's filter of two geoms on bodies that move apart: bit masks, parents, excludes."""
    masks = model.geom_contype[a] & model.geom_conaffinity[b]
    if not (masks or model.geom_contype[b] & model.geom_conaffinity[a]):
        return False
    bodies = sorted((int(model.geom_bodyid[a]), int(model.geom_bodyid[b])))
    if (bodies[0] << 16) + bodies[1] in model.exclude_signature:
        return False
    weld = [int(model.body_weldid[body]) for body in bodies]
    above = [int(model.body_weldid[model.body_parentid[body]]) for body in weld]
    parent_filter = _on(model, mujoco.mjtDisableBit.mjDSBL_FILTERPARENT) and 0 not in weld
    return not (parent_filter and (weld[0] == above[1] or weld[1] == above[0]))


def _ties(cartpole: CartPole) -> Iterator[str]:
    """Equality constraints, tendons, deformable things and plugins."""
    model, bit = cartpole.model, mujoco.mjtDisableBit
    if _on(model, bit.mjDSBL_EQUALITY) and _on(model, bit.mjDSBL_CONSTRAINT):
        for index in np.flatnonzero(model.eq_active0).tolist():
            yield f"equality constraint {_named(model, mujoco.mjtObj.mjOBJ_EQUALITY, index, '')}"
    acting = ("stiffness", "stiffnesspoly", "damping", "dampingpoly", "frictionloss", "armature")
    for tendon in range(model.ntendon):
        values = [getattr(model, f"tendon_{name}")[tendon] for name in (*acting, "limited")]
        if any(np.any(value) for value in values):
            yield _named(model, mujoco.mjtObj.mjOBJ_TENDON, tendon)
    for flex in range(model.nflex):
        yield _named(model, mujoco.mjtObj.mjOBJ_FLEX, flex)
    for plugin in sorted({*model.body_plugin.tolist(), *model.actuator_plugin.tolist()} - {-1}):
        yield _named(model, mujoco.mjtObj.mjOBJ_PLUGIN, plugin)


def _surroundings(cartpole: CartPole) -> Iterator[str]:
    """Gravity that is not plain, and air or water."""
    model = cartpole.model
    gravity = model.opt.gravity
    if np.abs(gravity[:2]).max() > TILT * abs(gravity[2]):
        yield f"gravity is not vertical ({' '.join(f'{value:g}' for value in gravity)})"
    for body in _moving_bodies(cartpole):
        if model.body_gravcomp[body]:
            yield f"gravity compensation of {_named(model, mujoco.mjtObj.mjOBJ_BODY, body)}"
    for name in ("density", "viscosity"):
        if getattr(model.opt, name):
            wind = " and wind" if model.opt.wind.any() else ""
            yield f"a fluid around it (option {name} {getattr(model.opt, name):g}{wind})"


def _switches(cartpole: CartPole) -> Iterator[str]:
    """Option flags that keep a part of the equations from acting."""
    model, bit = cartpole.model, mujoco.mjtDisableBit
    damped = model.dof_damping.any() or model.actuator_damping.any()
    if model.opt.gravity.any() and not _on(model, bit.mjDSBL_GRAVITY):
        yield "gravity is switched off (option flag)"
    if damped and not _on(model, bit.mjDSBL_DAMPER):
        yield "damping is switched off (option flag)"
    if not _on(model, bit.mjDSBL_ACTUATION):
        yield "actuation is switched off (option flag)"
    if model.opt.enableflags & int(mujoco.mjtEnableBit.mjENBL_SLEEP):
        yield "sleeping of what is at rest (option flag)"


def _on(model: mujoco.MjModel, flag: mujoco.mjtDisableBit) -> bool:
    return not model.opt.disableflags & int(flag)


def _joint(model: mujoco.MjModel, index: int) -> str:
    return _named(model, mujoco.mjtObj.mjOBJ_JOINT, index)


def _named(model: mujoco.MjModel, kind: mujoco.mjtObj, index: int, word: str | None = None) -> str:
    """How a person finds an element: "joint 'slider'", or "joint 0" if it has no name."""
    word = kind.name.removeprefix("mjOBJ_").lower() if word is None else word
    name = mujoco.mj_id2name(model, kind, index)
    return f"{word} '{name}'".lstrip() if name else f"{word} {index}".lstrip()
