"""Forces that the engine applies and the equations do not have, whatever makes them.

MuJoCo keeps the forces of a step by kind, in arrays that are called `qfrc_…`. Over sampled states
each is held against what the equations put there, so that an effect is seen by what it does; a list
of effects would know those of today only.
"""

from collections.abc import Iterator
from typing import Final

import mujoco
import numpy as np

from mjcartpole.physics.bodies import farthest_from_origin
from mjcartpole.physics.cartpole import CartPole, Vector
from mjcartpole.physics.equations import Parameters, coefficients
from mjcartpole.physics.free_region import FreeRegion, wide_box
from mjcartpole.physics.parameters import joint_label, label
from mjcartpole.physics.structure import push

_SAMPLES: Final = 24
_SPEED: Final = 5.0
_ROUNDING: Final = 1e-9
"""Relative to the largest force of a state: more than rounding far from the world's origin makes,
less than anything that a single step would show."""

_POSITIONS: Final = 1e-5
"""Of the weight; times `_ROUNDING`, some tens of roundings of a position."""

_SUMS: Final = {"qfrc_applied", "qfrc_inverse", "qfrc_smooth"}
"""What the caller applies, and sums of other kinds."""

_KINDS: Final = tuple(sorted({n for n in dir(mujoco.MjData) if n.startswith("qfrc_")} - _SUMS))


def unexplained_forces(cartpole: CartPole, p: Parameters, region: FreeRegion) -> dict[str, str]:
    """Return kinds of forces that act on the joints of a model of one pole beyond the equations.

    States are drawn from the region in which it moves freely. The result has a phrase for each
    kind, which is the name of MuJoCo's array: where and how much.
    """
    rng = np.random.default_rng(0)
    low, high = region.box(wide_box(region.task))
    offset = farthest_from_origin(cartpole)
    found: dict[str, tuple[float, str]] = {}
    data = mujoco.MjData(cartpole.model)
    for _ in range(_SAMPLES):
        x, theta = rng.uniform(low[0], high[0]), rng.uniform(low[2], high[2])
        state = np.array([x, rng.normal() * _SPEED, theta, rng.normal() * _SPEED])
        for control in (*cartpole.controls, 0.0):
            for kind, excess, joint in _excesses(cartpole, p, data, state, control, offset):
                if excess > found.get(kind, (0.0, ""))[0]:
                    found[kind] = excess, _phrase(cartpole, data, kind, excess, joint)
    return {kind: phrase for kind, (_, phrase) in found.items()}


def _excesses(
    cartpole: CartPole,
    p: Parameters,
    data: mujoco.MjData,
    state: Vector,
    control: float,
    offset: float,
) -> Iterator[tuple[str, float, int]]:
    """Yield of each kind the largest force beyond the equations' own, and on which joint."""
    joints = list(cartpole.joints)
    mujoco.mj_resetData(cartpole.model, data)
    data.qpos[joints], data.qvel[joints] = state[[0, 2]], state[[1, 3]]
    data.ctrl[0] = control
    mujoco.mj_forward(cartpole.model, data)
    expected = _expected(cartpole, p, state, control)
    forces = {name: getattr(data, name)[joints] for name in _KINDS}
    forces["qfrc_constraint"] -= _dry_friction(data)[joints]
    scale = max(float(np.abs(values).max()) for values in (*forces.values(), *expected.values()))
    scale = max(scale, _whole_weight(p, state, offset))
    for name, values in forces.items():
        excess = np.abs(values - expected.get(name, np.zeros(2)))
        # Where the equations have nothing, nothing is exactly nothing.
        if excess.max() > (_ROUNDING * scale if name in expected else 0.0):
            worst = int(excess.argmax())
            yield name, float(excess[worst]), joints[worst]


def _expected(
    cartpole: CartPole, p: Parameters, state: Vector, control: float
) -> dict[str, Vector]:
    """Return the forces that the equations have, by MuJoCo's kinds."""
    k, (_, x_dot, theta, theta_dot) = coefficients(p), state
    swing = (k.coupling * np.sin(theta) + k.crossing * np.cos(theta)) * theta_dot**2
    turn = k.weight * np.sin(theta) + k.leaning * np.cos(theta)
    brake = np.array([-p.slider_damping * x_dot, -p.hinge_damping * theta_dot])
    acting, model = 0.0, cartpole.model
    if any(p.forces):
        motor = cartpole.motor
        if model.actuator_ctrllimited[model.actuator_ctrladr[motor]]:
            control = min(max(control, min(cartpole.controls)), max(cartpole.controls))
        acting = push(model, cartpole.slider, control)
    return {
        "qfrc_bias": np.array([-k.pull - swing, -turn]),
        "qfrc_damper": brake,
        "qfrc_passive": brake,
        "qfrc_actuator": np.array([acting - p.motor_damping * x_dot, 0.0]),
    }


def _whole_weight(p: Parameters, state: Vector, offset: float) -> float:
    """Return what weight and rotation would be with the arm positions round by, N or N m."""
    arm = offset + abs(state[0])
    pull = p.gravity + arm * state[3] ** 2
    return float((p.cart_mass + p.pole_mass) * pull * max(arm, 1.0) * _POSITIONS)


def _dry_friction(data: mujoco.MjData) -> Vector:
    """Return the part of the constraint forces that is dry friction of joints, shape (nv,)."""
    forces: Vector = np.zeros_like(data.qvel)
    for row in range(data.nefc):
        if data.efc_type[row] == mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF:
            forces[data.efc_id[row]] += data.efc_force[row]
    return forces


def _phrase(cartpole: CartPole, data: mujoco.MjData, kind: str, size: float, joint: int) -> str:
    """Return what acts, on what, and how much; an actuator that helps is named."""
    model, by = cartpole.model, ""
    if kind == "qfrc_actuator":
        helpers = [
            label(model, mujoco.mjtObj.mjOBJ_ACTUATOR, index)
            for index in range(model.nactuator)
            if index != cartpole.motor and data.actuator_force[index]
        ]
        by = f" by {', '.join(helpers)}" if helpers else ""
    unit = "N" if joint == cartpole.slider else "N m"
    return (
        f"{kind.removeprefix('qfrc_')} force{by} on {joint_label(model, joint)} that the equations "
        f"do not have (up to {size:.3g} {unit})"
    )
