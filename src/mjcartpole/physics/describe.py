"""What was understood of a model: which joint is the cart's, which way is up, who pushes how."""

import math
from dataclasses import dataclass
from typing import Final

import mujoco
import numpy as np

from mjcartpole.physics.bodies import cart_bodies, mass_of, pole_bodies
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.file_steps import method_of
from mjcartpole.physics.structure import LEAST_ARM, Directions, Vector, directions, is_servo, push
from mjcartpole.physics.unmodelled_effects import beyond_equations, beyond_step
from mjcartpole.task import CARTPOLE_V1, Task

_LABEL_WIDTH: Final = 12

_SHOWN: Final = 4
"""Reasons why the equations do not apply that fit into a line."""

_NOTHING: Final = 1e-9
"""What rounding leaves of an angle."""


@dataclass(frozen=True)
class PoleDescription:
    """One pole.

    Attributes:
        joint: The hinge joint and its body.
        mass: All that turns on the hinge, without a pole that stands on it, kg.
        com_distance: From the hinge to the pole's centre of mass, m.
        upright: The hinge's angle in the document at which the model's angle is 0, rad.
        balance: The model's angle at which the centre of mass is straight above the hinge, rad.
        leans: 1 if a positive angle leans to positive x, -1 if it leans to negative x.
    """

    joint: str
    mass: float
    com_distance: float
    upright: float
    balance: float
    leans: int

    def what(self) -> str:
        """Return what it is, in words."""
        arm = f"centre of mass {self.com_distance:.6g} m from the hinge"
        if self.com_distance < LEAST_ARM:
            arm = "centre of mass on the hinge, so that it cannot fall"
        return f"{self.joint}, {self.mass:.6g} kg, {arm}"

    def angle(self) -> str:
        """Return from where its angle is counted, in words."""
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


@dataclass(frozen=True)
class Description:
    """A cart-pole in a person's words and numbers; `text()` has it in lines.

    Attributes:
        name: What a person calls the model.
        cart: The slide joint and its body.
        poles: One description each, in the order of the state's values.
        rail: World axis of the rail, where positive x goes: `"+x"`, `"-y"`, or three numbers.
        up: World axis that gravity points away from: `"+z"`.
        gravity: m/s^2, shape (3,).
        forces: Push along the rail by action 0 and by action 1 at rest, N.
        servo: Whether the force depends on position or velocity too; `forces` are those at x = 0.
        gear: The actuator's.
        controls: Of action 0 and of action 1.
        timestep: Of one physics step, s.
        substeps: Physics steps per control step.
        integrator: As the document names it.
        cart_mass: All that slides but does not turn, kg.
        rail_limits: Ends of the rail, m; None without.
        x_limit: How far from its middle an episode ends, m.
        beyond: What acts on the motion and is not in the closed-form equations; empty where
            they apply.
        beyond_step: Why one step of the file's own integrator is not the equations' own.
    """

    name: str
    cart: str
    poles: tuple[PoleDescription, ...]
    rail: str
    up: str
    gravity: tuple[float, float, float]
    forces: tuple[float, float]
    servo: bool
    gear: float
    controls: tuple[float, float]
    timestep: float
    substeps: int
    integrator: str
    cart_mass: float
    rail_limits: tuple[float, float] | None
    x_limit: float
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
        """Return the description in lines, each with a label."""
        lines = [
            ("cart", f"{self.cart}, {self.cart_mass:.6g} kg"),
            *((f"pole{number}", pole.what()) for number, pole in self._numbered()),
            ("rail", f"along {self.rail}{self._limits()}"),
            ("up", f"{self.up}; gravity {_numbers(self.gravity)} m/s^2"),
            *((f"angle{number}", pole.angle()) for number, pole in self._numbered()),
            ("force", self._force()),
            ("time", self._time()),
            ("integrator", self.integrator),
            ("equations", self._equations()),
        ]
        return [f"{label:<{_LABEL_WIDTH}}{words}" for label, words in lines]

    def _numbered(self) -> list[tuple[str, PoleDescription]]:
        """Return each pole with what tells it from the others; nothing where there is one."""
        if len(self.poles) == 1:
            return [("", self.poles[0])]
        return [(f" {number}", pole) for number, pole in enumerate(self.poles, start=1)]

    def _limits(self) -> str:
        if self.rail_limits is None:
            ends = math.isfinite(self.x_limit)
            return ", no ends" + (f"; an episode ends at {self.x_limit:g} m" if ends else "")
        low, high = self.rail_limits
        return f", ends at {low:g} m and {high:g} m"

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


def describe(cartpole: CartPole, *, task: Task = CARTPOLE_V1) -> Description:
    """Say what was understood of a model.

    Args:
        cartpole: A loaded model.
        task: What ends an episode.
    """
    model, slider = cartpole.model, cartpole.slider
    found = [directions(cartpole, pole) for pole in range(cartpole.poles)]
    low, high = (push(model, slider, control) for control in cartpole.controls)
    limits = [float(end) for end in model.jnt_range[slider]]
    has_ends = model.jnt_limited[slider] and np.isfinite(limits).any()
    beyond = beyond_equations(cartpole, task=task)
    return Description(
        name=cartpole.name,
        cart=_joint(model, slider),
        poles=tuple(_pole(cartpole, pole, found[pole]) for pole in range(cartpole.poles)),
        rail=axis_name(found[0].rail),
        up=axis_name(found[0].up),
        gravity=tuple(model.opt.gravity.tolist()),
        forces=(low, high),
        servo=is_servo(model),
        gear=float(model.actuator_gear[cartpole.motor, 0]),
        controls=cartpole.controls,
        timestep=cartpole.timestep,
        substeps=cartpole.substeps,
        integrator=cartpole.integrator,
        cart_mass=mass_of(model, cart_bodies(cartpole)),
        rail_limits=(limits[0], limits[1]) if has_ends else None,
        x_limit=task.x_limit,
        beyond=tuple(beyond),
        beyond_step=tuple(beyond_step(cartpole, method_of(cartpole), beyond, task=task)),
    )


def _pole(cartpole: CartPole, pole: int, found: Directions) -> PoleDescription:
    return PoleDescription(
        joint=_joint(cartpole.model, cartpole.hinges[pole]),
        mass=mass_of(cartpole.model, pole_bodies(cartpole, pole)),
        com_distance=float(np.linalg.norm(found.arm)),
        upright=cartpole.upright[pole],
        balance=found.upright,
        leans=1 if found.coupling > 0 else -1,
    )


def axis_name(axis: Vector) -> str:
    """Return a direction by the world axis that it follows, `"+x"`, or by its numbers."""
    index = int(np.abs(axis).argmax())
    if abs(axis[index]) > 1 - _NOTHING:
        return f"{'+' if axis[index] > 0 else '-'}{'xyz'[index]}"
    return f"({_numbers(axis)})"


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
