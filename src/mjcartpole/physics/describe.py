"""What was understood of a model: which joint is the cart's, which way is up, who pushes how."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import mujoco
import numpy as np

from mjcartpole.physics.bodies import cart_bodies, mass_of, pole_bodies
from mjcartpole.physics.cartpole import CartPole, Vector
from mjcartpole.physics.file_steps import method_of
from mjcartpole.physics.structure import LEAST_ARM, directions, is_servo, push
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


class Description:
    """A cart-pole in a person's words and numbers; `text()` has it in lines.

    Attributes:
        cartpole: The model.
        cart: The slide joint and its body.
        cart_mass: All that slides but does not turn, kg.
        poles: One description each, in the order of the state's values.
        rail: World axis of the rail, where positive x goes: `"+x"`, `"-y"`, or three numbers.
        up: World axis that gravity points away from: `"+z"`.
        forces: Push along the rail by action 0 and by action 1 at rest at x = 0, N.
        rail_limits: Ends of the rail, m; None without.
        beyond: What acts on the motion and is not in the closed-form equations; empty where
            they apply.
    """

    def __init__(self, cartpole: CartPole, task: Task) -> None:
        """Look at a model; `task` says what ends an episode."""
        self.cartpole, self._task = cartpole, task
        model, slider = cartpole.model, cartpole.slider
        found = directions(cartpole)
        self.rail, self.up = axis_name(found.rail), axis_name(found.up)
        self.cart = _joint(model, slider)
        self.cart_mass = mass_of(model, cart_bodies(cartpole))
        self.poles = tuple(_pole(cartpole, pole) for pole in range(cartpole.poles))
        self.forces = tuple(push(model, slider, control) for control in cartpole.controls)
        low, high = model.jnt_range[slider].tolist()
        has_ends = model.jnt_limited[slider] and (math.isfinite(low) or math.isfinite(high))
        self.rail_limits = (low, high) if has_ends else None
        self.beyond = beyond_equations(cartpole, task=task)

    @cached_property
    def beyond_step(self) -> list[str]:
        """Why one step of the file's own integrator is not the equations' own."""
        method = method_of(self.cartpole)
        return beyond_step(self.cartpole, method, self.beyond, task=self._task)

    def text(self) -> list[str]:
        """Return the description in lines, each with a label."""
        several = len(self.poles) > 1
        poles = [(f" {i}" if several else "", pole) for i, pole in enumerate(self.poles, start=1)]
        gravity = _numbers(self.cartpole.model.opt.gravity)
        lines = [
            ("cart", f"{self.cart}, {self.cart_mass:.6g} kg"),
            *((f"pole{number}", pole.what()) for number, pole in poles),
            ("rail", f"along {self.rail}{self._limits()}"),
            ("up", f"{self.up}; gravity {gravity} m/s^2"),
            *((f"angle{number}", pole.angle()) for number, pole in poles),
            ("force", self._force()),
            ("time", self._time()),
            ("integrator", self.cartpole.integrator),
            ("equations", self._equations()),
        ]
        return [f"{label:<{_LABEL_WIDTH}}{words}" for label, words in lines]

    def _limits(self) -> str:
        if self.rail_limits is None:
            limit = self._task.x_limit
            return ", no ends" + f"; an episode ends at {limit:g} m" * math.isfinite(limit)
        low, high = self.rail_limits
        return f", ends at {low:g} m and {high:g} m"

    def _force(self) -> str:
        model, (left, right), (low, high) = self.cartpole.model, self.forces, self.cartpole.controls
        servo = " at rest at x = 0, by a servo" if is_servo(model) else ""
        return (
            f"action 0: {left:g} N, action 1: {right:g} N{servo} "
            f"(control {low:g} or {high:g}, gear {model.actuator_gear[self.cartpole.motor, 0]:g})"
        )

    def _time(self) -> str:
        of = self.cartpole
        steps = "step" if of.substeps == 1 else "steps"
        return f"{of.substeps} {steps} of {of.timestep:g} s per action, {of.control_step:g} s"

    def _equations(self) -> str:
        if self.beyond:
            more = len(self.beyond) - _SHOWN
            shown = [*self.beyond[:_SHOWN], *([f"and {more} more"] if more > 0 else [])]
            return f"do not apply: {'; '.join(shown)}"
        if self.beyond_step:
            return f"apply to the accelerations, not to a step: {'; '.join(self.beyond_step)}"
        return "apply"


def describe(cartpole: CartPole, *, task: Task = CARTPOLE_V1) -> Description:
    """Say what was understood of a model, and where a task's episodes end on it."""
    return Description(cartpole, task)


def _pole(cartpole: CartPole, pole: int) -> PoleDescription:
    found = directions(cartpole, pole)
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


def _numbers(values: Vector) -> str:
    return " ".join(f"{value:.4g}" for value in values)
