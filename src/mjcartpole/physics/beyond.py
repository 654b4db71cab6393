"""What the equations leave out: everything in a model that acts on its motion beyond them.

Where nothing is left out, MuJoCo and `equations` with the model's parameters must agree.
"""

from collections.abc import Iterator

import mujoco
import numpy as np

from mjcartpole.physics.bodies import moving_bodies
from mjcartpole.physics.model import CartPole
from mjcartpole.physics.parameters import (
    TILT,
    Vector,
    axes_of,
    forces_of,
    joint_label,
    label,
    pole_of,
    several_poles,
)


def beyond_equations(cartpole: CartPole) -> list[str]:
    """Everything in a model that acts on its motion and is not in the equations, by name.

    What a flag of the file switches off, or what cannot act (a tendon without stiffness, the
    reference angle of a pole that is upright at angle 0), is not listed. Contacts count where two
    geoms may collide by MuJoCo's rules, wherever they are.

    Returns:
        One phrase each; empty if the equations cover the model.
    """
    found: list[str] = []
    parts = (_poles, _directions, _joints, _actuator)
    for look in (*parts, _contacts, _ties, _surroundings, _switches):
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


def overridden_masses(cartpole: CartPole) -> list[str]:
    """Masses that the document gives to geoms and that an explicit `<inertial>` overrides.

    They change nothing in the motion, whatever the person who wrote them expected.

    Returns:
        One phrase each; empty if there are none, or if the document cannot be read alone.
    """
    try:
        spec = mujoco.MjSpec.from_string(cartpole.xml)
    except ValueError:
        return []
    if spec.compiler.inertiafromgeom == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE:
        return []
    return [
        f"mass {geom.mass:g} of geom '{geom.name}', which the <inertial> of body '{body.name}' "
        "overrides"
        for body in spec.bodies
        if body.explicitinertial
        for geom in body.geoms
        if geom.mass > 0
    ]


def _poles(cartpole: CartPole) -> Iterator[str]:
    if cartpole.poles > 1:
        yield several_poles(cartpole)


def _directions(cartpole: CartPole) -> Iterator[str]:
    """Tilted axes, and poles that do not stand at angle 0."""
    slider = joint_label(cartpole.model, cartpole.slider)
    if abs(axes_of(cartpole).slider[2]) > TILT:
        yield f"slide axis of {slider} is tilted, not horizontal"
    for pole in range(cartpole.poles):
        yield from _directions_of(cartpole, pole, slider)


def _directions_of(cartpole: CartPole, pole: int, slider: str) -> Iterator[str]:
    model, axes, joint = cartpole.model, axes_of(cartpole, pole), cartpole.hinges[pole]
    hinge = joint_label(model, joint)
    if abs(axes.hinge[2]) > TILT:
        yield f"hinge axis of {hinge} is tilted, not horizontal"
    if abs(axes.hinge @ axes.slider) > TILT:
        yield f"hinge axis of {hinge} is not perpendicular to the slide axis of {slider}"
    same_body = model.jnt_bodyid[cartpole.slider] == model.jnt_bodyid[joint]
    if same_body and joint < cartpole.slider:
        yield f"slide axis of {slider} turns with the pole: {hinge} comes first in the same body"
    com = axes.pole_frame @ pole_of(cartpole, pole).com
    beside = float(com @ axes.slider)
    if abs(beside) > TILT * np.abs(com).max():
        ref = float(model.qpos0[joint])
        reason = f" (its ref is {ref:g} rad)" if ref else ""
        yield (
            f"the pole's centre of mass is {abs(beside):.3g} m beside {hinge} at angle 0{reason}"
        )


def _joints(cartpole: CartPole) -> Iterator[str]:
    """Limits, friction loss, springs and damping that is not viscous."""
    model, bit = cartpole.model, mujoco.mjtDisableBit
    solver = _on(model, bit.mjDSBL_CONSTRAINT)
    for joint in cartpole.joints:
        name = joint_label(model, joint)
        low, high = model.jnt_range[joint]
        limited = model.jnt_limited[joint] and np.isfinite([low, high]).any()
        if limited and solver and _on(model, bit.mjDSBL_LIMIT):
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
    name = label(model, mujoco.mjtObj.mjOBJ_ACTUATOR, 0)
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
    slider, pushes = cartpole.slider, np.array(forces_of(cartpole))
    if model.jnt_actfrclimited[slider] and _clips(model.jnt_actfrcrange[slider], pushes):
        yield f"actuator force range of {joint_label(model, slider)} clips the force of {name}"


def _clips(interval: Vector, forces: Vector) -> bool:
    return bool((np.clip(forces, *interval) != forces).any())


def _contacts(cartpole: CartPole) -> Iterator[str]:
    """Pairs of geoms that may touch, by MuJoCo's filters; a fixed pair counts as it stands."""
    model, bit = cartpole.model, mujoco.mjtDisableBit
    if not (_on(model, bit.mjDSBL_CONTACT) and _on(model, bit.mjDSBL_CONSTRAINT)):
        return
    weld = model.body_weldid[model.geom_bodyid].tolist()
    moves = np.isin(model.geom_bodyid, moving_bodies(cartpole)).tolist()
    explicit = set(zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True))
    for a in range(model.ngeom):
        for b in range(a + 1, model.ngeom):
            if weld[a] == weld[b] or not (moves[a] or moves[b]):
                continue
            if {(a, b), (b, a)} & explicit or _may_collide(model, a, b):
                names = [label(model, mujoco.mjtObj.mjOBJ_GEOM, geom, "") for geom in (a, b)]
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
            yield f"equality constraint {label(model, mujoco.mjtObj.mjOBJ_EQUALITY, index, '')}"
    acting = ("stiffness", "stiffnesspoly", "damping", "dampingpoly", "frictionloss", "armature")
    for tendon in range(model.ntendon):
        values = [getattr(model, f"tendon_{name}")[tendon] for name in (*acting, "limited")]
        if any(np.any(value) for value in values):
            yield label(model, mujoco.mjtObj.mjOBJ_TENDON, tendon)
    for flex in range(model.nflex):
        yield label(model, mujoco.mjtObj.mjOBJ_FLEX, flex)
    for plugin in sorted({*model.body_plugin.tolist(), *model.actuator_plugin.tolist()} - {-1}):
        yield label(model, mujoco.mjtObj.mjOBJ_PLUGIN, plugin)


def _surroundings(cartpole: CartPole) -> Iterator[str]:
    """Gravity that is not plain, and air or water."""
    model = cartpole.model
    gravity = model.opt.gravity
    if np.abs(gravity[:2]).max() > TILT * abs(gravity[2]):
        yield f"gravity is not vertical ({' '.join(f'{value:g}' for value in gravity)})"
    for body in moving_bodies(cartpole):
        if model.body_gravcomp[body]:
            yield f"gravity compensation of {label(model, mujoco.mjtObj.mjOBJ_BODY, body)}"
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
