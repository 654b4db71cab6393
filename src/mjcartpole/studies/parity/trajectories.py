"""Rungs 6 and 7: how long two worlds stay together, open loop and closed loop."""

import math
from typing import Any, NamedTuple

import gymnasium
import numpy as np
import numpy.typing as npt

from mjcartpole.learning.episodes import ENDINGS
from mjcartpole.learning.loop import play_episode
from mjcartpole.physics import equations, linear
from mjcartpole.studies.parity.case import Batch, Subject, Vector
from mjcartpole.studies.parity.result import Figure, Question, Result
from mjcartpole.studies.parity.rounding import EPS, LEAST_ARM, STEP_BOUNDS, step_unit
from mjcartpole.studies.parity.significance import same_distribution, same_frequencies

HORIZON = 400

LARGEST_ERROR = 1e-3
"""Beyond this the linearised growth means nothing."""

UNDECIDED = 1e-9
"""Two policies' observations this close almost never lie on two sides of a bin's edge."""

SIGNIFICANCE = 1e-3


def horizon(subject: Subject) -> Result:
    """Rung 6: the same pushes in both worlds; the error against eps rho^t."""
    question = Question(
        6,
        "horizon: open-loop error against its predicted growth",
        f"each step may round by rung 3's {STEP_BOUNDS[subject.against]:.0f} ulp, and the steps "
        "that follow, linearised where they are taken, multiply that: near rest by rho each, "
        f"up to {LARGEST_ERROR:g}",
    )
    if uncovered := subject.uncovered():
        return question.leave(uncovered)
    runs = [error_growth(subject, seed) for seed in range(4 if subject.quick else 20)]
    ratios = []
    for run in runs:
        meant = run.predicted < LARGEST_ERROR
        ratios.append(float((run.error / run.predicted)[meant].max(initial=0.0)))
    figures = (
        Figure("largest error", max(ratios), 1.0, "of the predicted bound"),
        Figure("rho, growth per step", linear.spectral_radius(subject.reference, "gym")),
        Figure(
            "float32 observations first differ at step, median",
            float(np.median([run.parted for run in runs])),
        ),
        Figure("episodes", float(len(runs))),
    )
    story = () if figures[0].holds else subject.story
    return question.answer(figures, story=story)


class Growth(NamedTuple):
    """How an error grew in one open-loop episode.

    Attributes:
        error: Largest difference of the two states after each step, shape (t,).
        predicted: Bound for it, shape (t,).
        parted: Step at which float32 observations first differ.
    """

    error: Vector
    predicted: Vector
    parted: int


def error_growth(subject: Subject, seed: int) -> Growth:
    """Play the same actions in both worlds until the pole leans far, and watch the difference."""
    p, gain = subject.reference, _stabilising_gain(subject)
    start = subject.rng(600 + seed).uniform(-0.05, 0.05, size=4)
    simulation, other = subject.simulation("gym"), _Reference(subject, start)
    simulation.state = state = start
    errors: list[float] = []
    bounds: list[float] = []
    # What a step of the past has become by now: one matrix for each.
    carried, unit, parted = np.empty((0, 4, 4)), EPS, HORIZON
    while len(errors) < HORIZON and _goes_on(subject, state, errors):
        action = int(gain @ state > 0)
        batch = Batch(state[None, :], np.array([action]))
        jacobian = linear.step_matrix(p, "gym", state=state, force=p.forces[action])
        carried = np.concatenate([jacobian @ carried, np.eye(4)[None]])
        state = np.array(simulation.step(subject.cartpole.controls[action]))
        expected = other.step(action)
        unit = max(unit, float(step_unit(subject, batch, expected[None, :]).max()))
        growth = float(np.abs(carried).sum(axis=2).max(axis=1).sum())
        bounds.append(STEP_BOUNDS[subject.against] * unit * growth)
        errors.append(float(np.abs(state - expected).max()))
        if parted == HORIZON and np.any(state.astype(np.float32) != expected.astype(np.float32)):
            parted = len(errors)
    return Growth(np.array(errors), np.array(bounds), parted)


def _goes_on(subject: Subject, state: Vector, errors: list[float]) -> bool:
    apart = errors and errors[-1] > 1
    return bool(abs(state[2]) < 0.5 and subject.region.holds(state) and not apart)


def predicted_growth(subject: Subject, steps: int) -> Vector:
    """Return the bound near rest for the error after each step, shape (steps,).

    What each step may round, carried on: sum over k < t of |J^k| u, with J the linearised step and
    u the bound of one step; it grows as rho^t, with rho the spectral radius of J.
    """
    matrix = linear.step_matrix(subject.reference, "gym")
    power, total, bounds = np.eye(4), 0.0, np.empty(steps)
    for step in range(steps):
        total += float(np.linalg.norm(power, np.inf))
        bounds[step] = STEP_BOUNDS[subject.against] * EPS * total
        power = power @ matrix
    return bounds


class _Reference:
    """The other world: gymnasium's environment, or the equations where it cannot follow."""

    def __init__(self, subject: Subject, state: Vector) -> None:
        self._p = subject.reference
        self._state = state.copy()
        self._env: Any = None
        if not subject.gym_cannot:
            self._env = subject.gyms().unwrapped
            self._env.reset(seed=0)
            self._env.state = state.copy()

    def step(self, action: int) -> Vector:
        """Return the state after one more step, shape (4,)."""
        if self._env is None:
            self._state = equations.step(self._p, self._state, self._p.forces[action], "gym")
            return self._state
        self._env.steps_beyond_terminated = None
        self._env.step(action)
        return np.array(self._env.state)


def _stabilising_gain(subject: Subject) -> Vector:
    """Return the signs of a push that keeps the pole up for a while: towards where it leans."""
    # The pole's slower mode decides: lean plus rate over its time constant.
    p = subject.reference
    distance = max(abs(p.com_distance), LEAST_ARM)
    arm = p.inertia / (p.pole_mass * distance) + distance
    time = float(np.sqrt(arm / max(abs(p.gravity), 1e-6)))
    sign = math.copysign(1.0, linear.linearisation(p)[1][3, 0])
    return -sign * np.array([0.02, 0.05, 1.0, time])


def closed_loop(subject: Subject) -> Result:
    """Rung 7: one policy in both worlds, from many starting states."""
    question = Question(
        7,
        "closed loop: one policy, both backends",
        f"actions must be equal while the predicted error is below {UNDECIDED:g}; afterwards "
        f"lengths and endings are compared as distributions (p ≥ {SIGNIFICANCE:g})",
    )
    if uncovered := subject.uncovered():
        return question.leave(uncovered)
    if subject.gym_cannot:
        return question.skip(f"gymnasium cannot play this cart-pole: {subject.gym_cannot}")
    safe = int(np.sum(predicted_growth(subject, HORIZON) < UNDECIDED))
    episodes = 40 if subject.quick else 300
    ours, gyms = (
        [_play(env, subject, seed) for seed in range(episodes)]
        for env in (subject.ours(), subject.gyms())
    )
    too_early = sum(a[0][:safe] != b[0][:safe] for a, b in zip(ours, gyms, strict=True))
    lengths = [[len(actions) for actions, _ in side] for side in (ours, gyms)]
    figures = (
        Figure(f"episodes that part within {safe} steps ({episodes})", float(too_early), 0.0),
        Figure("p of equal lengths", same_distribution(*lengths), SIGNIFICANCE, at_least=True),
        Figure("p of equal endings", _chi2(ours, gyms), SIGNIFICANCE, at_least=True),
        Figure("mean length on MuJoCo", float(np.mean(lengths[0]))),
        Figure("mean length on gymnasium", float(np.mean(lengths[1]))),
    )
    return question.answer(figures, story=subject.story if too_early else ())


Played = tuple[list[int], str]


def _play(env: gymnasium.Env[Any, Any], subject: Subject, seed: int) -> Played:
    """Return the actions of one episode, and how it ended."""
    actions: list[int] = []

    def choose(observation: npt.NDArray[np.float32]) -> int:
        actions.append(subject.policy(observation))
        return actions[-1]

    episode, _ = play_episode(env, choose, seed=seed)
    return actions, episode.ending


def _chi2(ours: list[Played], gyms: list[Played]) -> float:
    """Return p of the chi-squared test that the three endings are as frequent on both sides."""
    counts = np.array(
        [[sum(end == name for _, end in side) for name in ENDINGS] for side in (ours, gyms)]
    )
    return same_frequencies(counts)
