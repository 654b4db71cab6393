"""Rungs 2 to 4: accelerations, and single steps with both integrators."""

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt

from mjcartpole import task
from mjcartpole.physics import equations
from mjcartpole.physics.equations import Parameters, coefficients
from mjcartpole.physics.integrator import Integrator
from mjcartpole.studies.parity.diagnosis import likely_cause
from mjcartpole.studies.parity.result import Figure, Result
from mjcartpole.studies.parity.subject import Subject, Vector

EPS = float(np.finfo(np.float64).eps)

WIDE_BOX = (2 * task.X_LIMIT, 10.0, np.pi, 10.0)
"""Far beyond an episode: m, m/s, rad, rad/s."""

ACCELERATION_BOUND = 32.0
STEP_BOUND = 4.0


def accelerations(subject: Subject) -> Result:
    """Rung 2: MuJoCo's accelerations against the equations."""
    title = "accelerations, MuJoCo against the equations"
    reason = (
        f"rounding: {ACCELERATION_BOUND:.0f} eps of the terms that the two equations add up, "
        "times the condition of their mass matrix"
    )
    if subject.against == "itself" and subject.beyond:
        return _beyond(2, title, reason, subject.beyond)
    states, actions = subject.states(2, 10_000 if subject.quick else 100_000, WIDE_BOX)
    controls = np.array(subject.cartpole.controls)[actions]
    forces = np.array(subject.reference.forces)[actions]
    found = subject.simulation("gym").accelerations(states, controls)
    _, x_dot, theta, theta_dot = states.T
    p = subject.reference
    expected = np.column_stack(equations.accelerations(p, x_dot, theta, theta_dot, forces))
    unit = EPS * acceleration_scale(p, states, forces)
    error = np.abs(found - expected) / unit
    worst = int(np.nanargmax(error.max(axis=1)))
    figures = (
        Figure("largest error", _largest(error), ACCELERATION_BOUND, "eps of the terms"),
        Figure("largest error, as it is", _largest(np.abs(found - expected)), None, "m/s², rad/s²"),
        Figure("states", float(len(states))),
    )
    problems = tuple(subject.causes)
    story: tuple[str, ...] = ()
    if problems or not figures[0].holds:
        story = (
            f"worst state {_numbers(states[worst])}, action {actions[worst]}",
            f"MuJoCo {_numbers(found[worst])}, equations {_numbers(expected[worst])}",
        )
    return Result(2, title, reason, figures, problems, story)


def acceleration_scale(p: Parameters, states: Vector, forces: Vector) -> Vector:
    """How large the terms of both accelerations are before they cancel, shape (n, 2)."""
    k = coefficients(p)
    x, x_dot, theta, theta_dot = np.abs(states).T
    sin, cos = np.abs(np.sin(theta)), np.abs(np.cos(theta))
    coupled = abs(k.coupling) * cos
    push = np.abs(forces) + k.slider_damping * x_dot + abs(k.coupling) * sin * theta_dot**2
    torque = abs(k.weight) * sin + k.hinge_damping * theta_dot
    product = k.slider_inertia * k.hinge_inertia
    determinant = product - coupled**2
    # MuJoCo works with points in the world, so lever arms round with the cart's distance.
    arms = 1 + x / abs(p.com_distance)
    factor = arms * product / determinant**2
    return np.column_stack(
        [
            factor * (k.hinge_inertia * push + coupled * torque),
            factor * (k.slider_inertia * torque + coupled * push),
        ]
    )


def step_gym(subject: Subject) -> Result:
    """Rung 3: one step of explicit Euler, against CartPole-v1's default."""
    return _one_step(subject, 3, "gym", "one step, explicit Euler, against CartPole-v1's default")


def step_mujoco(subject: Subject) -> Result:
    """Rung 4: one step of the file's integrator, against gymnasium's semi-implicit one."""
    title = "one step, the file's integrator, against CartPole-v1's semi-implicit one"
    return _one_step(subject, 4, "mujoco", title)


def _one_step(subject: Subject, rung: int, integrator: Integrator, title: str) -> Result:
    reason = f"rounding: {STEP_BOUND:.0f} ulp of 1, of the value, or of what the step adds to it"
    if subject.against == "itself":
        beyond = subject.beyond + (subject.beyond_step if integrator == "mujoco" else [])
        if subject.cartpole.integrator == "RK4":
            beyond = subject.beyond
        if beyond:
            return _beyond(rung, title, reason, beyond)
    rows = [_against_equations(subject, rung, integrator)]
    if not subject.gym_cannot:
        rows += _against_gymnasium(subject, rung, integrator)
    figures = tuple(figure for figure, _ in rows)
    note = (f"gymnasium is no witness here: {subject.gym_cannot}",) if subject.gym_cannot else ()
    failed = [story for figure, story in rows if not figure.holds]
    return Result(rung, title, reason, figures, (), (*(failed[0] if failed else ()), *note))


Row = tuple[Figure, tuple[str, ...]]


def _against_equations(subject: Subject, rung: int, integrator: Integrator) -> Row:
    states, actions = subject.states(rung, 10_000 if subject.quick else 100_000, WIDE_BOX)
    forces = np.array(subject.reference.forces)[actions]
    p = subject.reference
    if integrator == "mujoco" and subject.cartpole.integrator == "RK4":
        expected = equations.rk4_step(p, states, forces)
    else:
        expected = equations.step(p, states, forces, integrator)
    return _compare(subject, integrator, "equations", states, actions, expected)


def _against_gymnasium(subject: Subject, rung: int, integrator: Integrator) -> list[Row]:
    """Gymnasium's own env, at random states and along three kinds of episodes."""
    n = 2_000 if subject.quick else 20_000
    env = subject.gyms(integrator)
    batches = {
        "CartPole-v1, random states": subject.states(rung + 100, n, WIDE_BOX),
        "CartPole-v1, random actions": _along(subject, rung, n, _random(subject.rng(rung))),
        "CartPole-v1, learned actions": _along(subject, rung, n, subject.policy),
        "CartPole-v1, adversarial actions": _along(subject, rung, n, _adversarial),
    }
    return [
        _compare(subject, integrator, name, states, actions, gym_steps(env, states, actions))
        for name, (states, actions) in batches.items()
    ]


def gym_steps(
    env: gymnasium.Env[Any, Any], states: Vector, actions: npt.NDArray[np.intp]
) -> Vector:
    """One step of gymnasium's env from each of many states, shape (n, 4)."""
    cartpole: Any = env.unwrapped
    after = np.empty_like(states)
    for index, (state, action) in enumerate(zip(states, actions.tolist(), strict=True)):
        cartpole.state = state
        cartpole.steps_beyond_terminated = None
        cartpole.step(action)
        after[index] = cartpole.state
    return after


def _along(
    subject: Subject, rung: int, n: int, choose: Callable[[npt.NDArray[np.float32]], int]
) -> tuple[Vector, npt.NDArray[np.intp]]:
    """States and actions of episodes of our env, n steps in all."""
    env = subject.ours()
    observation, _ = env.reset(seed=subject.seed + rung)
    states, actions = np.empty((n, 4)), np.empty(n, dtype=np.intp)
    for index in range(n):
        states[index] = env.unwrapped.state  # type: ignore[attr-defined]
        actions[index] = choose(observation)
        observation, _, terminated, truncated, _ = env.step(int(actions[index]))
        if terminated or truncated:
            observation, _ = env.reset()
    return states, actions


def _random(rng: np.random.Generator) -> Callable[[npt.NDArray[np.float32]], int]:
    return lambda observation: int(rng.random() * 2)


def _adversarial(observation: npt.NDArray[np.float32]) -> int:
    """Push so that the pole falls faster: the largest velocities that an episode can reach."""
    _, _, theta, theta_dot = observation.tolist()
    return int(theta + theta_dot < 0)


def _compare(
    subject: Subject,
    integrator: Integrator,
    name: str,
    states: Vector,
    actions: npt.NDArray[np.intp],
    expected: Vector,
) -> Row:
    controls = np.array(subject.cartpole.controls)[actions]
    forces = np.array(subject.reference.forces)[actions]
    found = subject.simulation(integrator).steps(states, controls)
    p = subject.reference
    added = p.timestep * acceleration_scale(p, states, forces)[:, [0, 0, 1, 1]]
    unit = EPS * np.maximum(np.maximum(1.0, np.abs(expected)), added)
    error = np.abs(found - expected) / unit
    figure = Figure(f"{name}, {len(states):,}", _largest(error), STEP_BOUND, "ulp")
    if figure.holds:
        return figure, ()
    worst = int(np.nanargmax(error.max(axis=1)))
    story = (
        f"worst state {_numbers(states[worst])}, action {actions[worst]}",
        f"MuJoCo {_numbers(found[worst])}, {name.split(',')[0]} {_numbers(expected[worst])}",
        likely_cause(subject, integrator, states, actions, found),
    )
    return figure, story


def _largest(error: Vector) -> float:
    """The largest value; NaN if there is one, which no bound lets pass."""
    return float(error.max())


def _numbers(values: Vector) -> str:
    return "(" + ", ".join(f"{value:.10g}" for value in values) + ")"


def _beyond(rung: int, title: str, reason: str, beyond: list[str]) -> Result:
    why = "the equations do not cover: " + "; ".join(beyond)
    return Result(rung, title, reason, skipped=why, beyond=True)
