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

from mjcartpole import task
from mjcartpole.errors import NotACartPoleError
from mjcartpole.physics.bodies import data_at_zero, mass_of, pole_bodies, subtree
from mjcartpole.physics.cartpole import CartPole, Vector, motor_of

LEAST_COUPLING: Final = 0.5
"""How much of a push along the rail must act in the plane in which the pole turns."""

LEAST_ARM: Final = 1e-6
"""Metres; where the pole's centre of mass is nearer to the hinge, no angle is upright."""

LEAST_INERTIA: Final = 1e-9
"""Of any motion of several poles, relative; below it joints cannot be told apart."""

LARGEST_LEAN: Final = task.CARTPOLE_V1.theta_limit
"""A pole that leans by more, rad, at its document's angle 0 has its angle counted from upright.

The same for every task: it belongs to the document, which one task stores and another may read."""

_SHOWN: Final = 6


class UnfitError(Exception):
    """A model is no cart-pole; says what it has in place of what is needed (see `refusal`)."""


@dataclass(frozen=True)
class Directions:
    """Where the cart and one pole point when all coordinates are 0.

    Attributes:
        up: The world axis that gravity points away from most (z where there is none), shape (3,).
        rail: Where a positive x goes, unit, shape (3,).
        hinge: What a positive angle turns about, unit, shape (3,).
        frame: Orientation of the hinge's body, shape (3, 3).
        lean: Where the top of an upright pole goes as the angle grows, shape (3,); a unit vector
            if the hinge is horizontal.
        arm: From the hinge's axis to the pole's centre of mass, across the axis, m, shape (3,).
        upright: The angle at which the pole's centre of mass stands straight above the hinge, rad;
            0 where it lies on the hinge.
    """

    up: Vector
    rail: Vector
    hinge: Vector
    frame: Vector
    lean: Vector
    arm: Vector
    upright: float

    @property
    def coupling(self) -> float:
        """1 where a positive angle leans along the rail, -1 where it leans against it."""
        return float(self.lean @ self.rail)


def find_joints(model: mujoco.MjModel) -> tuple[int, tuple[int, ...]]:
    """Return the index of the cart's joint, and of each pole's; all have one coordinate each.

    Raises:
        UnfitError: There is another joint, or a hinge is not inside the cart.
    """
    kinds = [_kind(model, joint) for joint in range(model.njnt)]
    for kind in ("free", "ball"):
        if kind in kinds:
            raise UnfitError(f"a {kind} joint, that is neither the cart's nor the pole's")
    sliders, hinges = (
        [joint for joint, found in enumerate(kinds) if found == kind] for kind in ("slide", "hinge")
    )
    if len(sliders) != 1:
        amount = f"{len(sliders)} slide joints" if sliders else "no slide joint"
        raise UnfitError(f"{amount} where one (the cart's) is needed")
    if not hinges:
        raise UnfitError("no hinge joint where one (the pole's) is needed")
    sliding = subtree(model, int(model.jnt_bodyid[sliders[0]]))
    for hinge in hinges:
        if model.jnt_bodyid[hinge] not in sliding:
            which = f" ('{model.joint(hinge).name or hinge}')" if len(hinges) > 1 else ""
            raise UnfitError(f"a hinge{which} whose body is not inside the cart's body")
    return sliders[0], tuple(hinges)


def _kind(model: mujoco.MjModel, joint: int) -> str:
    return _word(mujoco.mjtJoint(int(model.jnt_type[joint])).name)


def _word(name: str) -> str:
    """Return the word in one of MuJoCo's names: "slide" for mjJNT_SLIDE."""
    return name.partition("_")[2].lower()


def find_controls(model: mujoco.MjModel, slider: int) -> tuple[float, float]:
    """Return the controls of both actions: the ends of the motor's range, or -1 and 1.

    Action 1 is the one that pushes more towards positive x.

    Raises:
        UnfitError: There is not exactly one motor, or it cannot push in two ways.
    """
    _check_motor(model, slider)
    low, high = -1.0, 1.0
    control = int(model.actuator_ctrladr[motor_of(model)])
    if model.actuator_ctrllimited[control]:
        low, high = (float(end) for end in model.actuator_ctrlrange[control])
    left, right = (push(model, slider, control) for control in (low, high))
    if left == right:
        raise UnfitError(
            f"a motor that pushes with {left + 0.0:g} N whatever the control, by its gear, gain "
            "and ranges"
        )
    return (low, high) if left < right else (high, low)


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


def _check_motor(model: mujoco.MjModel, slider: int) -> None:
    if model.nu != 1:
        idle = " with a control input" if model.nactuator > model.nu else ""
        amount = f"{model.nu} actuators{idle}" if model.nu else f"no actuator{idle}"
        raise UnfitError(f"{amount} where one plain motor is needed")
    motor = motor_of(model)
    transmission = mujoco.mjtTrn(int(model.actuator_trntype[motor]))
    on_joint = transmission in {mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT}
    if not on_joint or model.actuator_trnid[motor, 0] != slider:
        what = "another joint" if on_joint else f"a {_word(transmission.name)}"
        raise UnfitError(
            f"an actuator that does not push along the slide joint (it acts on {what})"
        )
    if model.na or model.actuator_dyntype[motor] != mujoco.mjtDyn.mjDYN_NONE:
        active = int(np.flatnonzero(model.actuator_actnum)[0]) if model.na else motor
        kind = _word(mujoco.mjtDyn(int(model.actuator_dyntype[active])).name)
        raise UnfitError(f"an actuator with activation states ({kind}) instead of a plain motor")
    kind_of_gain = model.actuator_gaintype[motor]
    affine = kind_of_gain == mujoco.mjtGain.mjGAIN_AFFINE
    varies = not affine or model.actuator_gainprm[motor, 1:3].any()
    if kind_of_gain != mujoco.mjtGain.mjGAIN_FIXED and varies:
        raise UnfitError("an actuator whose force is not in proportion to its control")


def is_servo(model: mujoco.MjModel) -> bool:
    """Return whether the motor's force depends on more than its control: position or velocity."""
    motor = motor_of(model)
    biased = model.actuator_biastype[motor] != mujoco.mjtBias.mjBIAS_NONE
    return bool(biased and model.actuator_biasprm[motor, 1:3].any())


def directions(cartpole: CartPole, pole: int = 0, data: mujoco.MjData | None = None) -> Directions:
    """Return where the cart and one pole point when all coordinates are 0 (see `data_at_zero`)."""
    model, joint = cartpole.model, cartpole.hinges[pole]
    data = data_at_zero(model, data)
    axis = data.xaxis[joint].copy()
    arm = _centre(cartpole, pole, data) - data.xanchor[joint]
    arm = arm - (arm @ axis) * axis
    up, angle = _up(model.opt.gravity), 0.0
    if np.linalg.norm(arm) >= LEAST_ARM:
        # From where the arm points to where `up` does, about the axis.
        angle = math.atan2(float(axis @ cross(arm, up)), float(arm @ up))
    rail, frame = data.xaxis[cartpole.slider].copy(), data.xmat[model.jnt_bodyid[joint]]
    return Directions(up, rail, axis, frame.reshape(3, 3).copy(), cross(axis, up), arm, angle)


def cross(a: Vector, b: Vector) -> Vector:
    """Return the vector product of two vectors, in numpy's bits and a tenth of its time."""
    (a0, a1, a2), (b0, b1, b2) = a.tolist(), b.tolist()
    return np.array([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0])


def _centre(cartpole: CartPole, pole: int, data: mujoco.MjData) -> Vector:
    """Return a pole's centre of mass in the world, m, shape (3,)."""
    model, bodies = cartpole.model, pole_bodies(cartpole, pole)
    if mass_of(model, bodies) > 0:
        weights = model.body_mass[bodies]
        centre: Vector = weights @ data.xipos[bodies] / weights.sum()
        return centre
    # Nothing weighs but what stands on it, or nothing at all.
    mujoco.mj_comPos(model, data)
    whole: Vector = data.subtree_com[model.jnt_bodyid[cartpole.hinges[pole]]]
    return whole


def _up(gravity: Vector) -> Vector:
    """Return the signed world axis that is nearest to straight against gravity."""
    pulls = np.abs(gravity)
    axis = 2 if pulls[2] >= pulls.max() else int(pulls.argmax())
    up = np.zeros(3)
    up[axis] = 1.0 if gravity[axis] <= 0 else -1.0
    return up


def count_from_upright(cartpole: CartPole, pole: int, data: mujoco.MjData) -> float:
    """Have a pole's angle count from upright, if it does not; return the angle that became 0, rad.

    It is what the attribute `ref` does in a document: the pose stays, its coordinate moves, in
    place. No derived value of the model depends on it. Of angles a full turn apart it is one
    inside the joint's limits. `data` are some of the model's, which are overwritten.

    Raises:
        UnfitError: No push tilts the pole, or something else in the model counts by the old angle.
    """
    upright = _checked_directions(cartpole, pole, data).upright
    if abs(upright) <= LARGEST_LEAN:
        return 0.0
    model, hinge = cartpole.model, cartpole.hinges[pole]
    if model.jnt_limited[hinge]:
        low, high = model.jnt_range[hinge]
        turns = (upright, upright + 2 * math.pi, upright - 2 * math.pi)
        upright = next((angle for angle in turns if low <= angle <= high), upright)
    if model.ntendon or model.nplugin:
        raise UnfitError(
            f"a pole that stands upright at {math.degrees(upright):.4g} degrees instead of 0, with "
            "tendons or plugins that count its angle"
        )
    for counted in (model.qpos0, model.qpos_spring, model.jnt_range):
        counted[hinge] -= upright
    model.key_qpos[:, hinge] -= upright
    return upright


def _checked_directions(cartpole: CartPole, pole: int, data: mujoco.MjData) -> Directions:
    """Refuse a pole that no push along the rail tilts, and a wheel among several poles."""
    found, several = directions(cartpole, pole, data), cartpole.poles > 1
    name = cartpole.model.joint(cartpole.hinges[pole]).name or f"number {pole + 1}"
    which = f" ('{name}')" if several else ""
    if abs(found.rail @ found.up) > 1 - LEAST_COUPLING**2:
        raise UnfitError("a slide joint that goes up and down, not along a rail")
    if np.linalg.norm(found.lean) < LEAST_COUPLING:
        raise UnfitError(f"a hinge{which} that turns about the vertical")
    if abs(found.coupling) < LEAST_COUPLING:
        raise UnfitError(
            f"a hinge{which} whose axis is along the rail, so a push does not tilt the pole"
        )
    if several and np.linalg.norm(found.arm) < LEAST_ARM:
        raise UnfitError(
            f"a hinge{which} that turns about its own centre of mass, as a wheel and no pole"
        )
    return found


def check_independent(cartpole: CartPole, data: mujoco.MjData) -> None:
    """Refuse several hinges of which one adds no motion of its own; overwrites `data`.

    Raises:
        UnfitError: The inertia of all joints together is singular.
    """
    if cartpole.poles == 1:
        return
    model = cartpole.model
    inertia = np.empty((model.nv, model.nv))
    mujoco.mj_fwdPosition(model, data_at_zero(model, data))
    mujoco.mj_fullM(model, data, inertia)
    scale = np.sqrt(np.maximum(inertia.diagonal(), mujoco.mjMINVAL))
    if np.linalg.eigvalsh(inertia / np.outer(scale, scale))[0] < LEAST_INERTIA:
        raise UnfitError("hinges that turn alike, or poles without mass")


def check_limits(cartpole: CartPole) -> None:
    """Refuse joints whose limits keep them from position 0, where episodes start (UnfitError)."""
    model = cartpole.model
    for joint in cartpole.joints:
        on_rail = joint == cartpole.slider
        place, unit = ("x = 0", "m") if on_rail else ("the upright position", "rad")
        low, high = model.jnt_range[joint]
        if model.jnt_limited[joint] and not low <= 0.0 <= high:
            label = model.joint(joint).name or f"number {joint}"
            raise UnfitError(
                f"a range from {low:g} to {high:g} {unit} of joint '{label}' that leaves out "
                f"{place}"
            )


def refusal(name: str, model: mujoco.MjModel, found: UnfitError) -> NotACartPoleError:
    """Return the error that says what a model has instead of what a cart-pole needs."""
    joints = [
        f"{model.joint(joint).name or 'unnamed'} ({_kind(model, joint)})"
        for joint in range(min(model.njnt, _SHOWN))
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
