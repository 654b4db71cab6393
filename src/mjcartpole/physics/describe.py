"""What was understood of a model: which joint is the cart's, which way is up, who pushes how."""

import math
from dataclasses import dataclass
from typing import Final

import mujoco
import numpy as np

from mjcartpole import task
from mjcartpole.errors import ModelError
from mjcartpole.physics.beyond import beyond_equations, beyond_step
from mjcartpole.physics.model import CartPole
from mjcartpole.physics.parameters import read_parameters
from mjcartpole.physics.structure import LEAST_ARM, Directions, Vector, directions, is_servo, push

_LABEL_WIDTH: Final = 12

_SHOWN: Final = 4
"""Reasons why the equations do not apply that fit into a line."""

_NOTHING: Final = 1e-9
"""What rounding leaves of an angle."""


@dataclass(frozen=True)
class Description:
    """A cart-pole in a person's words and numbers; `text()` has it in lines.

    Attributes:
        name: What a person calls the model.
        cart: The slide joint and its body.
        pole: The hinge joint and its body.
        rail: World axis of the rail, where positive x goes: `"+x"`, `"-y"`, or three numbers.
        up: World axis that gravity points away from: `"+z"`.
        gravity: m/s^2, shape (3,).
        upright: The hinge's angle in the document at which the model's angle is 0, rad.
        balance: The model's angle at which the centre of mass is straight above the hinge, rad.
        leans: 1 if a positive angle leans to positive x, -1 if it leans to negative x.
        forces: Push along the rail by action 0 and by action 1 at rest, N.
        servo: Whether the force depends on position or velocity too; `forces` are those at x = 0.
        gear: The actuator's.
        controls: Of action 0 and of action 1.
        timestep: Of one physics step, s.
        substeps: Physics steps per control step.
        integrator: As the document names it.
        cart_mass: All that slides but does not turn, kg.
        pole_mass: All that turns, kg.
        com_distance: From the hinge to the pole's centre of mass, m.
        rail_limits: Ends of the rail, m; None without.
        beyond: What acts on the motion and is not in the closed-form equations; empty where
            they apply.
        beyond_step: Why one step of the file's own integrator is not the equations' own.
    """

    name: str
    cart: str
    pole: str
    rail: str
    up: str
    gravity: tuple[float, float, float]
    upright: float
    balance: float
    leans: int
    forces: tuple[float, float]
    servo: bool
    gear: float
    controls: tuple[float, float]
    timestep: float
    substeps: int
    integrator: str
    cart_mass: float
    pole_mass: float
    com_distance: float
    rail_limits: tuple[float, float] | None
    beyond: tuple[str, ...]
    beyond_step: tuple[str, ...]

    @property
    def control_step(self) -> float:
        """Seconds between two actions."""
        return self.timestep * self.substeps

    @property
    def equations_apply(self) -> bool:
        """Whether the closed-form equations cover the motion."""
        return not self.beyond

    def text(self) -> list[str]:
        """The description in lines, each with a label."""
        lines = [
            ("cart", f"{self.cart}, {self.cart_mass:.6g} kg"),
            ("pole", f"{self.pole}, {self.pole_mass:.6g} kg, {self._arm()}"),
            ("rail", f"along {self.rail}{self._limits()}"),
            ("up", f"{self.up}; gravity {_numbers(self.gravity)} m/s^2"),
            ("angle", self._angle()),
            ("force", self._force()),
            ("time", self._time()),
            ("integrator", self.integrator),
            ("equations", self._equations()),
        ]
        return [f"{label:<{_LABEL_WIDTH}}{words}" for label, words in lines]

    def _arm(self) -> str:
        if self.com_distance < LEAST_ARM:
            return "centre of mass on the hinge, so that it cannot fall"
        return f"centre of mass {self.com_distance:.6g} m from the hinge"

    def _limits(self) -> str:
        if self.rail_limits is None:
            return f", no ends; an episode ends at {task.X_LIMIT:g} m"
        low, high = self.rail_limits
        return f", ends at {low:g} m and {high:g} m"

    def _angle(self) -> str:
        side = "+x" if self.leans > 0 else "-x"
        words = f"0 is upright, a positive angle leans to {side} of the rail"
        if self.upright:
            words += (
                f"; the file has upright at {math.degrees(self.upright):.6g} degrees, "
                "angles are counted from there"
            )
        if abs(self.balance) > _NOTHING:
            words += f"; it balances at {math.degrees(self.balance):.3g} degrees"
        return words

    def _force(self) -> str:
        (left, right), (low, high) = self.forces, self.controls
        servo = " at rest at x = 0, by a servo" if self.servo else ""
        return (
            f"action 0: {left:g} N, action 1: {right:g} N{servo} "
            f"(control {low:g} or {high:g}, gear {self.gear:g})"
        )

    def _time(self) -> str:
        steps = "step" if self.substeps == 1 else "steps"
        return f"{self.substeps} {steps} of {self.timestep:g} s per action, {self.control_step:g} s"

    def _equations(self) -> str:
        if not self.equations_apply:
            more = len(self.beyond) - _SHOWN
            shown = [*self.beyond[:_SHOWN], *([f"and {more} more"] if more > 0 else [])]
            return f"do not apply: {'; '.join(shown)}"
        if self.beyond_step:
            return f"apply to the accelerations, not to a step: {'; '.join(self.beyond_step)}"
        return "apply"


def describe(cartpole: CartPole) -> Description:
    """Say what was understood of a model.

    Args:
        cartpole: A loaded model.
    """
    model, found = cartpole.model, directions(cartpole)
    slider, hinge = cartpole.slider, cartpole.hinge
    moving = float(model.body_subtreemass[model.jnt_bodyid[slider]])
    pole_mass = float(model.body_subtreemass[model.jnt_bodyid[hinge]])
    low, high = (push(model, slider, control) for control in cartpole.controls)
    limits = [float(end) for end in model.jnt_range[slider]]
    return Description(
        name=cartpole.name,
        cart=_joint(model, slider),
        pole=_joint(model, hinge),
        rail=axis_name(found.rail),
        up=axis_name(found.up),
        gravity=tuple(model.opt.gravity.tolist()),
        upright=cartpole.upright,
        balance=found.upright,
        leans=1 if found.coupling > 0 else -1,
        forces=(low, high),
        servo=is_servo(model),
        gear=float(model.actuator_gear[0, 0]),
        controls=cartpole.controls,
        timestep=cartpole.timestep,
        substeps=cartpole.substeps,
        integrator=cartpole.integrator,
        cart_mass=moving - pole_mass,
        pole_mass=pole_mass,
        com_distance=float(np.linalg.norm(found.arm)),
        rail_limits=(limits[0], limits[1]) if model.jnt_limited[slider] else None,
        beyond=_beyond(cartpole, found),
        beyond_step=tuple(beyond_step(cartpole)),
    )


def axis_name(axis: Vector) -> str:
    """A direction by the world axis that it follows, `"+x"`, or by its numbers."""
    index = int(np.abs(axis).argmax())
    if abs(axis[index]) > 1 - _NOTHING:
        return f"{'+' if axis[index] > 0 else '-'}{'xyz'[index]}"
    return f"({_numbers(axis)})"


def _beyond(cartpole: CartPole, found: Directions) -> tuple[str, ...]:
    """What keeps the equations from covering a model; they have z up."""
    reasons = beyond_equations(cartpole)
    try:
        read_parameters(cartpole)
    except ModelError as error:
        reasons.append(str(error))
    if not found.up[2] and not reasons:
        reasons.append(f"up is {axis_name(found.up)}, not z")
    return tuple(reasons)


def _joint(model: mujoco.MjModel, joint: int) -> str:
    body = int(model.jnt_bodyid[joint])
    words = [
        f"{kind} {name!r}" if name else f"{kind} {index} (unnamed)"
        for kind, name, index in (
            ("joint", model.joint(joint).name, joint),
            ("body", model.body(body).name, body),
        )
    ]
    return " of ".join(words)


def _numbers(values: tuple[float, ...] | Vector) -> str:
    return " ".join(f"{value:.4g}" for value in values)
