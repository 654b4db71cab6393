"""Rungs 6 and 7: how long two worlds stay together, open loop and closed loop."""

from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from scipy import stats

from mjcartpole.learning.loop import ENDINGS, ending_of
from mjcartpole.physics import equations
from mjcartpole.studies.parity.dynamics import EPS, beyond_result
from mjcartpole.studies.parity.result import Figure, Result
from mjcartpole.studies.parity.subject import Subject, Vector

HORIZON = 400
ENVELOPE_FACTOR = 32.0
"""An envelope may be exceeded this many times: every step adds its own rounding, and the sum of a
geometric series multiplies it by up to rho / (rho - 1), about 14 for CartPole-v1."""

LARGEST_ERROR = 1e-3
"""Beyond this the linearised growth means nothing."""

UNDECIDED = 1e-9
"""Two policies' observations this close almost never lie on two sides of a bin's edge."""

SIGNIFICANCE = 1e-3


def horizon(subject: Subject) -> Result:
    """Rung 6: the same pushes in both worlds; the error against eps rho^t."""
    title = "horizon: open-loop error against its predicted growth"
    reason = (
        f"an upright pole multiplies an error by rho each step: {ENVELOPE_FACTOR:.0f} eps rho^t, "
        f"up to {LARGEST_ERROR:g}"
    )
    if subject.against == "itself" and subject.beyond:
        return beyond_result(6, title, reason, subject.beyond)
    rho = equations.spectral_radius(subject.reference, "gym")
    runs = [_error_growth(subject, seed) for seed in range(4 if subject.quick else 20)]
    ratios, parted = [], []
    for error, float32_step in runs:
        envelope = EPS * rho ** np.arange(1, len(error) + 1)
        meant = envelope * ENVELOPE_FACTOR < LARGEST_ERROR
        ratios.append(float((error / envelope)[meant].max(initial=0.0)))
        parted.append(float32_step)
    figures = (
        Figure("largest error", max(ratios), ENVELOPE_FACTOR, "eps rho^t"),
        Figure("rho, growth per step", rho),
        Figure("float32 observations first differ at step, median", float(np.median(parted))),
        Figure("episodes", float(len(runs))),
    )
    story = () if figures[0].holds else tuple(subject.causes)
    return Result(6, title, reason, figures, (), story)


def _error_growth(subject: Subject, seed: int) -> tuple[Vector, int]:
    """Largest difference of the two states after each step, and when float32 first shows it."""
    rng = subject.rng(600 + seed)
    state = rng.uniform(-0.05, 0.05, size=4)
    simulation, other = subject.simulation("gym"), _Reference(subject, state)
    simulation.state = state
    gain = _stabilising_gain(subject)
    errors, parted = [], HORIZON
    for step in range(HORIZON):
        action = int(gain @ state > 0)
        state = np.array(simulation.step(subject.cartpole.controls[action]))
        expected = other.step(action)
        errors.append(float(np.abs(state - expected).max()))
        if parted == HORIZON and np.any(state.astype(np.float32) != expected.astype(np.float32)):
            parted = step + 1
        if abs(state[2]) > 0.5 or errors[-1] > 1:
            break
    return np.array(errors), parted


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
        """The state after one more step, shape (4,)."""
        if self._env is None:
            self._state = equations.step(self._p, self._state, self._p.forces[action], "gym")
            return self._state
        self._env.steps_beyond_terminated = None
        self._env.step(action)
        return np.array(self._env.state)


def _stabilising_gain(subject: Subject) -> Vector:
    """Signs of a push that keeps the pole up for a while: towards where it leans."""
    # The pole's slower mode decides: lean plus rate over its time constant.
    p = subject.reference
    arm = p.inertia / (p.pole_mass * abs(p.com_distance)) + abs(p.com_distance)
    time = float(np.sqrt(arm / max(abs(p.gravity), 1e-6)))
    return p.hinge_sign * np.array([0.02, 0.05, 1.0, time])


def closed_loop(subject: Subject) -> Result:
    """Rung 7: one policy in both worlds, from many starting states."""
    title = "closed loop: one policy, both backends"
    reason = (
        f"actions must be equal while the predicted error is below {UNDECIDED:g}; afterwards "
        f"lengths and endings are compared as distributions (p ≥ {SIGNIFICANCE:g})"
    )
    if subject.gym_cannot:
        why = f"gymnasium cannot play this cart-pole: {subject.gym_cannot}"
        return Result(7, title, reason, skipped=why)
    rho = equations.spectral_radius(subject.reference, "gym")
    safe = int(np.log(UNDECIDED / (ENVELOPE_FACTOR * EPS)) / np.log(rho)) if rho > 1 else HORIZON
    episodes = 40 if subject.quick else 300
    ours, gyms = (
        [_play(env, subject, seed) for seed in range(episodes)]
        for env in (subject.ours(), subject.gyms())
    )
    too_early = sum(a[0][:safe] != b[0][:safe] for a, b in zip(ours, gyms, strict=True))
    lengths = [[len(actions) for actions, _ in side] for side in (ours, gyms)]
    figures = (
        Figure(f"episodes that part within {safe} steps ({episodes})", float(too_early), 0.0),
        Figure("p of equal lengths", _ks(*lengths), SIGNIFICANCE, at_least=True),
        Figure("p of equal endings", _chi2(ours, gyms), SIGNIFICANCE, at_least=True),
        Figure("mean length on MuJoCo", float(np.mean(lengths[0]))),
        Figure("mean length on gymnasium", float(np.mean(lengths[1]))),
    )
    return Result(7, title, reason, figures, (), tuple(subject.causes) if too_early else ())


Played = tuple[list[int], str]


def _play(env: gymnasium.Env[Any, Any], subject: Subject, seed: int) -> Played:
    """Actions of one episode, and how it ended."""
    observation: npt.NDArray[np.float32]
    observation, _ = env.reset(seed=seed)
    actions: list[int] = []
    over = terminated = False
    while not over:
        actions.append(subject.policy(observation))
        observation, _, terminated, truncated, _ = env.step(actions[-1])
        over = terminated or truncated
    state = np.array(env.unwrapped.state)  # type: ignore[attr-defined]
    return actions, ending_of(terminated, state)


def _ks(a: list[int], b: list[int]) -> float:
    """P of the Kolmogorov-Smirnov test that two samples come from one distribution."""
    return float(stats.ks_2samp(a, b, method="asymp").pvalue)


def _chi2(ours: list[Played], gyms: list[Played]) -> float:
    """P of the chi-squared test that the three endings are as frequent on both sides."""
    counts = np.array(
        [[sum(end == name for _, end in side) for name in ENDINGS] for side in (ours, gyms)]
    )
    seen = counts[:, counts.sum(axis=0) > 0]
    if seen.shape[1] < 2:
        return 1.0
    return float(stats.chi2_contingency(seen).pvalue)
