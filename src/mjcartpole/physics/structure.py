"""What makes a compiled model a cart-pole, or the reason why it is none.

Names do not matter. Needed are a slide joint (the cart's), a hinge joint inside its body (the
pole's), and a motor on the slide joint that can push in two ways; the push must tilt the pole. Each
further hinge is one more pole, beside the first or on it.
"""

import math
from dataclasses import dataclass
from typing import Final

import mujoco
import numpy as np
import numpy.typing as npt

from mjcartpole import task
from mjcartpole.errors import NotACartPoleError
from mjcartpole.physics.bodies import HasJoints, mass_of, pole_bodies, subtree

Vector = npt.NDArray[np.float64]

MOST_SUBSTEPS: Final = 1_000
"""Physics steps per control step."""

LEAST_COUPLING: Final = 0.5
"""How much of a push along the rail must act in the plane in which the pole turns."""

LEAST_ARM: Final = 1e-6
"""Metres; where the pole's centre of mass is nearer to the hinge, no angle is upright."""

LEAST_INERTIA: Final = 1e-9
"""Of any motion of several poles, relative; below it joints cannot be told apart."""

_KIND: Final = {
    mujoco.mjtJoint.mjJNT_SLIDE: "slide",
    mujoco.mjtJoint.mjJNT_HINGE: "hinge",
    mujoco.mjtJoint.mjJNT_BALL: "ball",
    mujoco.mjtJoint.mjJNT_FREE: "free",
}


_SHOWN: Final = 6


@dataclass(frozen=True)
class Directions:
    """Where the cart and one pole point when all coordinates are 0.

    Attributes:
        up: The world axis that gravity points away from most (z where there is none), shape (3,).
        rail: Where a positive x goes, unit, shape (3,).
        lean: Where the top of an upright pole goes as the angle grows, shape (3,); a unit vector
            if the hinge is horizontal.
        arm: From the hinge's axis to the pole's centre of mass, across the axis, m, shape (3,).
        upright: The angle at which the pole's centre of mass stands straight above the hinge, rad;
            0 where it lies on the hinge.
    """

    up: Vector
    rail: Vector
    lean: Vector
    arm: Vector
    upright: float

    @property
    def coupling(self) -> float:
        """1 where a positive angle leans along the rail, -1 where it leans against it."""
        return float(self.lean @ self.rail)


def find_joints(name: str, model: mujoco.MjModel) -> tuple[int, tuple[int, ...]]:
    """Return the index of the cart's joint, and of each pole's; all have one coordinate each.

    Raises:
        NotACartPoleError: There is another joint, or a hinge is not inside the cart.
    """
    kinds = [mujoco.mjtJoint(int(kind)) for kind in model.jnt_type]
    for kind in (mujoco.mjtJoint.mjJNT_FREE, mujoco.mjtJoint.mjJNT_BALL):
        if kind in kinds:
            raise refusal(
                name, model, f"a {_KIND[kind]} joint, that is neither the cart's nor the pole's"
            )
    sliders, hinges = (
        [index for index, found in enumerate(kinds) if found == kind]
        for kind in (mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE)
    )
    if len(sliders) != 1:
        amount = f"{len(sliders)} slide joints" if sliders else "no slide joint"
        raise refusal(name, model, f"{amount} where one (the cart's) is needed")
    if not hinges:
        raise refusal(name, model, "no hinge joint where one (the pole's) is needed")
    sliding = subtree(model, int(model.jnt_bodyid[sliders[0]]))
    for hinge in hinges:
        if model.jnt_bodyid[hinge] not in sliding:
            which = f" ('{model.joint(hinge).name or hinge}')" if len(hinges) > 1 else ""
            raise refusal(name, model, f"a hinge{which} whose body is not inside the cart's body")
    return sliders[0], tuple(hinges)


def find_controls(name: str, model: mujoco.MjModel, slider: int) -> tuple[float, float]:
    """Return the controls of both actions: the ends of the motor's range, or -1 and 1.

    Action 1 is the one that pushes more towards positive x.

    Raises:
        NotACartPoleError: There is not exactly one motor, or it cannot push in two ways.
    """
    _check_motor(name, model, slider)
    motor, low, high = motor_of(model), -1.0, 1.0
    control = int(model.actuator_ctrladr[motor])
    if model.actuator_ctrllimited[control]:
        low, high = (float(end) for end in model.actuator_ctrlrange[control])
    left, right = (push(model, slider, control) for control in (low, high))
    if left == right:
        raise refusal(
            name,
            model,
            f"a motor that pushes with {left + 0.0:g} N whatever the control, by its gear, gain "
            "and ranges",
        )
    return (low, high) if left < right else (high, low)


def motor_of(model: mujoco.MjModel) -> int:
    """Return index of the actuator that takes the one control of a model (others may take none)."""
    return int(np.flatnonzero(model.actuator_ctrlnum)[0])


def push(model: mujoco.MjModel, slider: int, control: float) -> float:
    """Return force along the slider by a control, N, after the limits that clip it.

    A servo's (`is_servo`) is that at rest at x = 0.
    """
    motor = motor_of(model)
    force = float(model.actuator_gainprm[motor, 0]) * control
    if model.actuator_biastype[motor] != mujoco.mjtBias.mjBIAS_NONE:
        force += float(model.actuator_biasprm[motor, 0])
    if model.actuator_forcelimited[motor]:
        force = float(np.clip(force, *model.actuator_forcerange[motor]))
    force *= float(model.actuator_gear[motor, 0])
    if model.jnt_actfrclimited[slider]:
        force = float(np.clip(force, *model.jnt_actfrcrange[slider]))
    return force


def _check_motor(name: str, model: mujoco.MjModel, slider: int) -> None:
    if model.nu != 1:
        idle = " with a control input" if model.nactuator > model.nu else ""
        amount = f"{model.nu} actuators{idle}" if model.nu else f"no actuator{idle}"
        raise refusal(name, model, f"{amount} where one plain motor is needed")
    motor = motor_of(model)
    transmission = mujoco.mjtTrn(int(model.actuator_trntype[motor]))
    on_joint = transmission in {mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT}
    if not on_joint or model.actuator_trnid[motor, 0] != slider:
        word = transmission.name.removeprefix("mjTRN_").lower()
        what = "another joint" if on_joint else f"a {word}"
        raise refusal(
            name,
            model,
            f"an actuator that does not push along the slide joint (it acts on {what})",
        )
    if model.na or model.actuator_dyntype[motor] != mujoco.mjtDyn.mjDYN_NONE:
        active = int(np.flatnonzero(model.actuator_actnum)[0]) if model.na else motor
        kind = mujoco.mjtDyn(int(model.actuator_dyntype[active])).name
        kind = kind.removeprefix("mjDYN_").lower()
        raise refusal(
            name, model, f"an actuator with activation states ({kind}) instead of a plain motor"
        )
    fixed = model.actuator_gaintype[motor] == mujoco.mjtGain.mjGAIN_FIXED
    if not fixed and not _is_fixed_gain(model, motor):
        raise refusal(name, model, "an actuator whose force is not in proportion to its control")


def _is_fixed_gain(model: mujoco.MjModel, motor: int) -> bool:
    affine = model.actuator_gaintype[motor] == mujoco.mjtGain.mjGAIN_AFFINE
    return bool(affine and not model.actuator_gainprm[motor, 1:3].any())


def is_servo(model: mujoco.MjModel) -> bool:
    """Return whether the motor's force depends on more than its control: position or velocity."""
    motor = motor_of(model)
    biased = model.actuator_biastype[motor] != mujoco.mjtBias.mjBIAS_NONE
    return bool(biased and model.actuator_biasprm[motor, 1:3].any())


def find_substeps(name: str, model: mujoco.MjModel) -> int:
    """Return physics steps that fill a control step of 0.02 s.

    Raises:
        NotACartPoleError: The timestep does not divide it, or there would be too many.
    """
    timestep = float(model.opt.timestep)
    substeps = round(task.CONTROL_STEP / timestep)
    if substeps > MOST_SUBSTEPS:
        raise NotACartPoleError(
            f"{name}: timestep {timestep:g} s makes {substeps:g} physics steps of one control step "
            f"of {task.CONTROL_STEP} s, and no more than {MOST_SUBSTEPS} are done; use 0.001 …"
        )
    if substeps < 1 or abs(substeps * timestep - task.CONTROL_STEP) > 1e-12:
        raise NotACartPoleError(
            f"{name}: timestep {timestep:g} s does not divide the control step of "
            f"{task.CONTROL_STEP} s; use 0.02, 0.01, 0.005, 0.002 …, or take the file's own as the "
            "control step (--own-timestep, own_timestep=True)"
        )
    return substeps


def directions(parts: HasJoints, pole: int = 0) -> Directions:
    """Return where the cart and one pole point when all coordinates are 0."""
    model, slider, hinge = parts.model, parts.slider, parts.hinges[pole]
    data = mujoco.MjData(model)
    data.qpos[:] = 0.0
    mujoco.mj_kinematics(model, data)
    axis = data.xaxis[hinge]
    arm = _centre(parts, pole, data) - data.xanchor[hinge]
    arm = arm - (arm @ axis) * axis
    up = _up(model.opt.gravity)
    lean = np.cross(axis, up)
    angle = 0.0
    if np.linalg.norm(arm) >= LEAST_ARM:
        # From where the arm points to where `up` does, about the axis.
        angle = math.atan2(float(axis @ np.cross(arm, up)), float(arm @ up))
    return Directions(up, data.xaxis[slider].copy(), lean, arm, angle)


def _centre(parts: HasJoints, pole: int, data: mujoco.MjData) -> Vector:
    """Return a pole's centre of mass in the world, m, shape (3,)."""
    model, bodies = parts.model, pole_bodies(parts, pole)
    if mass_of(model, bodies) > 0:
        weights = model.body_mass[bodies]
        centre: Vector = weights @ data.xipos[bodies] / weights.sum()
        return centre
    # Nothing weighs but what stands on it, or nothing at all.
    mujoco.mj_comPos(model, data)
    whole: Vector = data.subtree_com[model.jnt_bodyid[parts.hinges[pole]]]
    return whole


def _up(gravity: Vector) -> Vector:
    """Return the signed world axis that is nearest to straight against gravity."""
    pulls = np.abs(gravity)
    axis = 2 if pulls[2] >= pulls.max() else int(pulls.argmax())
    up = np.zeros(3)
    up[axis] = 1.0 if gravity[axis] <= 0 else -1.0
    return up


def check_directions(name: str, parts: HasJoints, pole: int = 0) -> Directions:
    """Refuse a pole that no push along the rail tilts, and a wheel among several poles.

    Raises:
        NotACartPoleError: As said; the reason is named.
    """
    found, which = directions(parts, pole), _which(parts, pole)
    if abs(found.rail @ found.up) > 1 - LEAST_COUPLING**2:
        reason = "a slide joint that goes up and down, not along a rail"
    elif np.linalg.norm(found.lean) < LEAST_COUPLING:
        reason = f"a hinge{which} that turns about the vertical"
    elif abs(found.coupling) < LEAST_COUPLING:
        reason = f"a hinge{which} whose axis is along the rail, so a push does not tilt the pole"
    elif len(parts.hinges) > 1 and np.linalg.norm(found.arm) < LEAST_ARM:
        reason = f"a hinge{which} that turns about its own centre of mass, as a wheel and no pole"
    else:
        return found
    raise refusal(name, parts.model, reason)


def _which(parts: HasJoints, pole: int) -> str:
    """Return a hinge's name in brackets where there are several."""
    if len(parts.hinges) == 1:
        return ""
    return f" ('{parts.model.joint(parts.hinges[pole]).name or f'number {pole + 1}'}')"


def check_independent(name: str, parts: HasJoints) -> None:
    """Refuse several hinges of which one adds no motion of its own.

    Raises:
        NotACartPoleError: The inertia of all joints together is singular.
    """
    model = parts.model
    if len(parts.hinges) == 1:
        return
    data, inertia = mujoco.MjData(model), np.empty((model.nv, model.nv))
    data.qpos[:] = 0.0
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fullM(model, data, inertia)
    scale = np.sqrt(np.maximum(inertia.diagonal(), mujoco.mjMINVAL))
    if np.linalg.eigvalsh(inertia / np.outer(scale, scale))[0] < LEAST_INERTIA:
        raise refusal(name, model, "hinges that turn alike, or poles without mass")


def count_from_upright(name: str, parts: HasJoints, pole: int, upright: float) -> float:
    """Return change, in place, from where a compiled model counts the hinge's angle.

    It is what the attribute `ref` does in a document: the pose stays, its coordinate moves. No
    derived value of the model depends on it.

    Args:
        name: What a person calls the model.
        parts: The model and its joints.
        pole: Which pole.
        upright: The angle that becomes 0, rad; of those a full turn apart, one inside the limits.

    Returns:
        The angle that became 0, rad.

    Raises:
        NotACartPoleError: Something else in the model counts by the old angle.
    """
    model, hinge = parts.model, parts.hinges[pole]
    upright = _within_limits(model, hinge, upright)
    if model.ntendon or model.nplugin:
        raise refusal(
            name,
            model,
            f"a pole that stands upright at {math.degrees(upright):.4g} degrees instead of 0, with "
            "tendons or plugins that count its angle",
        )
    model.qpos0[hinge] -= upright
    model.qpos_spring[hinge] -= upright
    model.jnt_range[hinge] -= upright
    model.key_qpos[:, hinge] -= upright
    return upright


def _within_limits(model: mujoco.MjModel, hinge: int, angle: float) -> float:
    low, high = model.jnt_range[hinge]
    for turned in (angle, angle + 2 * math.pi, angle - 2 * math.pi):
        if not model.jnt_limited[hinge] or low <= turned <= high:
            return turned
    return angle


def check_limits(name: str, parts: HasJoints) -> None:
    """Refuse joints whose limits keep them from position 0, where episodes start.

    Raises:
        NotACartPoleError: As said.
    """
    model = parts.model
    for joint in (parts.slider, *parts.hinges):
        on_rail = joint == parts.slider
        place, unit = ("x = 0", "m") if on_rail else ("the upright position", "rad")
        low, high = model.jnt_range[joint]
        if model.jnt_limited[joint] and not low <= 0.0 <= high:
            label = model.joint(joint).name or f"number {joint}"
            raise refusal(
                name,
                model,
                f"a range from {low:g} to {high:g} {unit} of joint '{label}' that leaves out "
                f"{place}",
            )


def refusal(name: str, model: mujoco.MjModel, found: str) -> NotACartPoleError:
    """Return the error that says what a model has instead of what a cart-pole needs."""
    joints = [
        f"{model.joint(index).name or 'unnamed'} ({_KIND[mujoco.mjtJoint(int(kind))]})"
        for index, kind in enumerate(model.jnt_type[:_SHOWN])
    ]
    actuators = [
        mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_ACTUATOR, index) or "unnamed"
        for index in range(min(model.nactuator, _SHOWN))
    ]
    joints += ["…"] * (model.njnt > _SHOWN)
    actuators += ["…"] * (model.nactuator > _SHOWN)
    return NotACartPoleError(
        f"{name} is not a cart-pole: it has {found} "
        f"[joints: {', '.join(joints) or 'none'}; actuators: {', '.join(actuators) or 'none'}]; "
        "needed are a slide joint for the cart, a hinge joint inside it for each pole, and one "
        "motor on the slide joint"
    )
