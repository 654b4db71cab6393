"""Rungs 2 to 4: accelerations, and single steps with both integrators."""

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt

from mjcartpole.integrator import Integrator
from mjcartpole.physics import equations
from mjcartpole.physics.equations import Parameters
from mjcartpole.physics.file_steps import file_step
from mjcartpole.physics.free_region import wide_box
from mjcartpole.studies.parity.case import Batch, Subject, Vector
from mjcartpole.studies.parity.diagnosis import Predict, likely_cause
from mjcartpole.studies.parity.result import Figure, Question, Result
from mjcartpole.studies.parity.rounding import EPS, STEP_BOUNDS, acceleration_scale, step_unit

FAR = 2.0
"""Metres from the world's origin that are worth a word."""

_WITNESS = {
    "gym": "CartPole-v1's default",
    "mujoco": "CartPole-v1's semi-implicit one",
    "itself": "its equations",
}

ACCELERATION_BOUND = 16.0


def accelerations(subject: Subject) -> Result:
    """Rung 2: MuJoCo's accelerations against the equations."""
    question = Question(
        2,
        "accelerations, MuJoCo against the equations",
        f"rounding: {ACCELERATION_BOUND:.0f} eps of the terms that the two equations add up, "
        "times the condition of their mass matrix",
    )
    if uncovered := subject.uncovered():
        return question.leave(uncovered)
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
        return question.answer(figures)
    worst = _worst_case(batch, error, found, expected, "equations")
    return question.answer(figures, story=(*worst, likely_cause(subject, predict, found)))


def step_gym(subject: Subject) -> Result:
    """Rung 3: one step of explicit Euler, against CartPole-v1's default."""
    return _one_step(subject, 3, "gym", "one step, explicit Euler")


def step_mujoco(subject: Subject) -> Result:
    """Rung 4: one step of the file's integrator, against gymnasium's semi-implicit one."""
    return _one_step(subject, 4, "mujoco", "one step, the file's integrator")


def _one_step(subject: Subject, rung: int, integrator: Integrator, title: str) -> Result:
    terms = ", or of the terms that it adds" if subject.against == "itself" else ""
    if subject.against == "cartpole-v1" and subject.offset > FAR:
        terms = f", or of the terms that grow with {subject.offset:.3g} m from the world's origin"
    title += ", against " + _WITNESS[integrator if subject.against == "cartpole-v1" else "itself"]
    bound = STEP_BOUNDS[subject.against]
    reason = f"rounding: {bound:.0f} ulp of 1, or of the value{terms}, if that is larger"
    question = Question(rung, title, reason)
    if uncovered := subject.uncovered(integrator):
        return question.leave(uncovered)
    rows = [_against_equations(subject, rung, integrator)]
    absent = subject.gym_cannot
    if integrator == "mujoco" and subject.method not in {"Euler", "implicitfast"}:
        absent = absent or f"it has no {subject.method}"
    if not absent:
        rows += _against_gymnasium(subject, rung, integrator)
    figures = tuple(figure for figure, _ in rows)
    note = (f"gymnasium is no witness here: {absent}",) if absent else ()
    failed = [story for figure, story in rows if not figure.holds]
    return question.answer(figures, story=(*(failed[0] if failed else ()), *note))


Row = tuple[Figure, tuple[str, ...]]


def _against_equations(subject: Subject, rung: int, integrator: Integrator) -> Row:
    batch = subject.random_batch(rung, 10_000 if subject.quick else 100_000, wide_box())
    expected = _predict(subject, batch, integrator)(subject.reference)
    return _compare(subject, integrator, "equations", batch, expected)


def _predict(subject: Subject, batch: Batch, integrator: Integrator) -> Predict:
    """Return what the equations make of a batch, by the method that the integrator shall be."""

    def predict(p: Parameters) -> Vector:
        forces = np.array(p.forces)[batch.actions]
        if integrator == "mujoco":
            return file_step(p, batch.states, forces, subject.method)
        return equations.step(p, batch.states, forces)

    return predict


def _against_gymnasium(subject: Subject, rung: int, integrator: Integrator) -> list[Row]:
    """Compare with gymnasium's own env, at random states and along three kinds of episodes."""
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
    """Return one step of gymnasium's env from each state of a batch, shape (n, 4)."""
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
    """Return states and actions of n steps of our env, those where the model moves freely."""
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
    predict, acting = _predict(subject, batch, integrator), subject.acting(integrator)
    cause = likely_cause(subject, predict, found, acting)
    return figure, (*_worst_case(batch, error, found, expected, name), cause)


def _worst_case(
    batch: Batch, error: Vector, found: Vector, expected: Vector, witness: str
) -> tuple[str, str]:
    """Return where the error is largest, and what both said."""
    # A NaN is worse than any number.
    worst = int(np.nan_to_num(error, nan=np.inf).max(axis=1).argmax())
    return (
        f"worst state {_numbers(batch.states[worst])}, action {batch.actions[worst]}",
        f"MuJoCo {_numbers(found[worst])}, {witness} {_numbers(expected[worst])}",
    )


def _numbers(values: Vector) -> str:
    return "(" + ", ".join(f"{value:.10g}" for value in values) + ")"
