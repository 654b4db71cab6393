"""Rungs 2 to 4: accelerations, and single steps with both integrators."""

import math
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt

from mjcartpole.integrator import Integrator
from mjcartpole.physics import equations
from mjcartpole.physics.dry_friction import DryFriction
from mjcartpole.physics.equations import Parameters, coefficients
from mjcartpole.physics.file_steps import file_step
from mjcartpole.physics.free_region import wide_box
from mjcartpole.studies.parity.case import Against, Batch, Subject, Vector
from mjcartpole.studies.parity.diagnosis import Predict, likely_cause
from mjcartpole.studies.parity.result import Figure, Result

LEAST_ARM = 1e-9
"""Metres."""

EPS = float(np.finfo(np.float64).eps)

FAR = 2.0
"""Metres from the world's origin that are worth a word."""

_WITNESS = {
    "gym": "CartPole-v1's default",
    "mujoco": "CartPole-v1's semi-implicit one",
    "itself": "its equations",
}

ACCELERATION_BOUND = 16.0
STEP_BOUNDS: dict[Against, float] = {"cartpole-v1": 4.0, "itself": 16.0}
"""In ulp. CartPole-v1's own numbers leave little to cancel; any other pole may leave more."""


def accelerations(subject: Subject) -> Result:
    """Rung 2: MuJoCo's accelerations against the equations."""
    title = "accelerations, MuJoCo against the equations"
    reason = (
        f"rounding: {ACCELERATION_BOUND:.0f} eps of the terms that the two equations add up, "
        "times the condition of their mass matrix"
    )
    if subject.against == "itself" and subject.beyond:
        return beyond_result(2, title, reason, subject.beyond)
    batch = subject.random_batch(2, 10_000 if subject.quick else 100_000, wide_box())
    found = subject.simulation("gym").accelerations(batch.states, subject.controls(batch))
    _, x_dot, theta, theta_dot = batch.states.T

    def predict(p: Parameters) -> Vector:
        forces = np.array(p.forces)[batch.actions]
        return np.column_stack(equations.accelerations(p, x_dot, theta, theta_dot, forces))

    expected = predict(subject.reference)
    difference = np.abs(found - expected)
    scale = acceleration_scale(
        subject.reference, batch.states, subject.forces(batch), subject.offset
    )
    error = difference / (EPS * scale)
    figures = (
        Figure("largest error", float(error.max()), ACCELERATION_BOUND, "eps of the terms"),
        Figure("the same, m/s² or rad/s²", float(difference.max())),
        Figure("states", float(len(error))),
    )
    if figures[0].holds:
        return Result(2, title, reason, figures)
    story = _worst_case(batch, error, found, expected, "equations")
    return Result(2, title, reason, figures, (), (*story, likely_cause(subject, predict, found)))


def acceleration_scale(
    p: Parameters, states: Vector, forces: Vector, offset: float = 0.0
) -> Vector:
    """How large the terms of both accelerations are before they cancel, shape (n, 2).

    MuJoCo works with points in the world: a lever arm is the difference of two positions and
    rounds with the cart's distance from the origin, even where its sine is small. So does what it
    makes of it, the hinge's inertia included. And it adds up what the velocities do to the angular
    momentum, of which the rotation's own part and the cart's cancel.

    Args:
        p: The cart-pole.
        states: Shape (n, 4).
        forces: N, shape (n,).
        offset: From the world's origin to the cart at x = 0, m.
    """
    k = coefficients(p)
    x, x_dot, _, theta_dot = np.abs(states).T
    # Where the centre of mass is on the hinge, the mass still has an arm.
    arm = max(abs(p.com_distance), math.sqrt(p.inertia / p.pole_mass), LEAST_ARM)
    arms = 1 + (x + offset) / arm
    shared = p.pole_mass * arm
    push = np.abs(forces) + abs(k.pull) + k.slider_damping * x_dot + arms * shared * theta_dot**2
    swing = k.hinge_inertia * theta_dot**2 + shared * x_dot * theta_dot
    weight = np.hypot(k.weight, k.leaning)
    torque = weight + k.hinge_damping * theta_dot + swing
    # A grip is the difference of two accelerations, over its softness.
    push = push + _grip(p.slider_friction, x_dot)
    torque = arms * (torque + _grip(p.hinge_friction, theta_dot))
    product = k.slider_inertia * k.hinge_inertia
    turned = k.coupling * np.cos(states[:, 2]) - k.crossing * np.sin(states[:, 2])
    determinant = product - turned**2
    coupling, condition = arms * shared, product / determinant
    return np.column_stack(
        [
            condition * (k.hinge_inertia * push + coupling * torque) / determinant,
            condition * (k.slider_inertia * torque + coupling * push) / determinant,
        ]
    )


def _grip(friction: DryFriction | None, speed: Vector) -> Vector | float:
    return friction.loss + friction.rate * speed / friction.softness if friction else 0.0


def step_unit(subject: Subject, batch: Batch, expected: Vector) -> Vector:
    """What one ulp of a step stands for, shape (n, 4): of 1, or of the value if that is larger.

    A model that is asked about itself may be anything, such as a heavy pole on a light cart. There
    the terms that the step adds up count as well; of CartPole-v1 those that grow with the distance
    from the world's origin.
    """
    unit = np.maximum(1.0, np.abs(expected))
    p, forces = subject.reference, subject.forces(batch)
    terms = acceleration_scale(p, batch.states, forces, subject.offset)
    if subject.against == "cartpole-v1":
        terms = terms - acceleration_scale(p, batch.states, forces)
    return EPS * np.maximum(unit, p.timestep * terms[:, [0, 0, 1, 1]])


def step_gym(subject: Subject) -> Result:
    """Rung 3: one step of explicit Euler, against CartPole-v1's default."""
    return _one_step(subject, 3, "gym", "one step, explicit Euler")


def step_mujoco(subject: Subject) -> Result:
    """Rung 4: one step of the file's integrator, against gymnasium's semi-implicit one."""
    title = "one step, the file's integrator"
    return _one_step(subject, 4, "mujoco", title)


def _one_step(subject: Subject, rung: int, integrator: Integrator, title: str) -> Result:
    terms = ", or of the terms that it adds" if subject.against == "itself" else ""
    if subject.against == "cartpole-v1" and subject.offset > FAR:
        terms = f", or of the terms that grow with {subject.offset:.3g} m from the world's origin"
    title += ", against " + _WITNESS[integrator if subject.against == "cartpole-v1" else "itself"]
    bound = STEP_BOUNDS[subject.against]
    reason = f"rounding: {bound:.0f} ulp of 1, or of the value{terms}, if that is larger"
    if subject.against == "itself":
        beyond = subject.beyond + (subject.beyond_step if integrator == "mujoco" else [])
        if beyond:
            return beyond_result(rung, title, reason, beyond)
    rows = [_against_equations(subject, rung, integrator)]
    absent = subject.gym_cannot
    if integrator == "mujoco" and subject.method not in {"Euler", "implicitfast"}:
        absent = absent or f"it has no {subject.method}"
    if not absent:
        rows += _against_gymnasium(subject, rung, integrator)
    figures = tuple(figure for figure, _ in rows)
    note = (f"gymnasium is no witness here: {absent}",) if absent else ()
    failed = [story for figure, story in rows if not figure.holds]
    return Result(rung, title, reason, figures, (), (*(failed[0] if failed else ()), *note))


Row = tuple[Figure, tuple[str, ...]]


def _against_equations(subject: Subject, rung: int, integrator: Integrator) -> Row:
    batch = subject.random_batch(rung, 10_000 if subject.quick else 100_000, wide_box())
    expected = _predict(subject, batch, integrator)(subject.reference)
    return _compare(subject, integrator, "equations", batch, expected)


def _predict(subject: Subject, batch: Batch, integrator: Integrator) -> Predict:
    """What the equations make of a batch, by the method that the integrator shall be."""

    def predict(p: Parameters) -> Vector:
        forces = np.array(p.forces)[batch.actions]
        if integrator == "mujoco":
            return file_step(p, batch.states, forces, subject.method)
        return equations.step(p, batch.states, forces)

    return predict


def _against_gymnasium(subject: Subject, rung: int, integrator: Integrator) -> list[Row]:
    """Gymnasium's own env, at random states and along three kinds of episodes."""
    n = 2_000 if subject.quick else 20_000
    env = subject.gyms(integrator)
    batches = {
        "CartPole-v1, random states": subject.random_batch(rung + 100, n, wide_box()),
        "CartPole-v1, random actions": _along(subject, rung, n, _random(subject.rng(rung))),
        "CartPole-v1, learned actions": _along(subject, rung, n, subject.policy),
        "CartPole-v1, adversarial actions": _along(subject, rung, n, _adversarial),
    }
    return [
        _compare(subject, integrator, name, batch, gym_steps(env, batch))
        for name, batch in batches.items()
    ]


def gym_steps(env: gymnasium.Env[Any, Any], batch: Batch) -> Vector:
    """One step of gymnasium's env from each state of a batch, shape (n, 4)."""
    cartpole: Any = env.unwrapped
    after = np.empty_like(batch.states)
    for index, (state, action) in enumerate(zip(batch.states, batch.actions.tolist(), strict=True)):
        cartpole.state = state
        cartpole.steps_beyond_terminated = None
        cartpole.step(action)
        after[index] = cartpole.state
    return after


def _along(
    subject: Subject, rung: int, n: int, choose: Callable[[npt.NDArray[np.float32]], int]
) -> Batch:
    """States and actions of episodes of our env, n steps in all, where the model moves freely."""
    env = subject.ours()
    observation, _ = env.reset(seed=subject.seed + rung)
    batch = Batch(np.empty((n, 4)), np.empty(n, dtype=np.intp))
    for index in range(n):
        batch.states[index] = env.unwrapped.state  # type: ignore[attr-defined]
        action = batch.actions[index] = choose(observation)
        observation, _, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            observation, _ = env.reset()
    inside = subject.region.holds(batch.states)
    return Batch(batch.states[inside], batch.actions[inside])


def _random(rng: np.random.Generator) -> Callable[[npt.NDArray[np.float32]], int]:
    return lambda observation: int(rng.random() * 2)


def _adversarial(observation: npt.NDArray[np.float32]) -> int:
    """Push so that the pole falls faster: the largest velocities that an episode can reach."""
    _, _, theta, theta_dot = observation.tolist()
    return int(theta + theta_dot < 0)


def _compare(
    subject: Subject, integrator: Integrator, name: str, batch: Batch, expected: Vector
) -> Row:
    found = subject.simulation(integrator).steps(batch.states, subject.controls(batch))
    error = np.abs(found - expected) / step_unit(subject, batch, expected)
    figure = Figure(
        f"{name} ({len(error):,})", float(error.max()), STEP_BOUNDS[subject.against], "ulp"
    )
    if figure.holds:
        return figure, ()
    beyond = subject.beyond + (subject.beyond_step if integrator == "mujoco" else [])
    cause = likely_cause(subject, _predict(subject, batch, integrator), found, beyond)
    return figure, (*_worst_case(batch, error, found, expected, name), cause)


def _worst_case(
    batch: Batch, error: Vector, found: Vector, expected: Vector, witness: str
) -> tuple[str, str]:
    """Where the error is largest, and what both said."""
    # A NaN is worse than any number.
    worst = int(np.nan_to_num(error, nan=np.inf).max(axis=1).argmax())
    return (
        f"worst state {_numbers(batch.states[worst])}, action {batch.actions[worst]}",
        f"MuJoCo {_numbers(found[worst])}, {witness} {_numbers(expected[worst])}",
    )


def _numbers(values: Vector) -> str:
    return "(" + ", ".join(f"{value:.10g}" for value in values) + ")"


def beyond_result(rung: int, title: str, reason: str, beyond: list[str]) -> Result:
    """A rung that says nothing, since the model has what the equations do not cover."""
    why = "the equations do not cover: " + "; ".join(beyond)
    return Result(rung, title, reason, skipped=why, beyond=True)
