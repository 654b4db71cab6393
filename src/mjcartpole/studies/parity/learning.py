"""Rung 8: the same learner on both backends, and whether it comes to the same."""

import multiprocessing
import os
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy import stats

from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.loop import play_episode
from mjcartpole.learning.training import Training
from mjcartpole.studies.evaluation import SEED
from mjcartpole.studies.parity.dynamics import beyond_result
from mjcartpole.studies.parity.result import Figure, Result
from mjcartpole.studies.parity.subject import Subject, Vector

SEEDS: Final = 20
BLOCKS: Final = 10
"""The return curve is compared in this many blocks of episodes."""

CONFIDENCE: Final = 0.90
"""Of each interval: two one-sided tests at 5 % (Schuirmann, 1987, doi:10.1007/BF01068419)."""

CURVE_MARGIN: Final = 25.0
GREEDY_MARGIN: Final = 50.0
"""Differences in mean return, of 500, that nobody would act on: 5 % and 10 %."""


@dataclass(frozen=True)
class _Job:
    subject: Subject
    seed: int
    episodes: int
    evaluations: int


def learning(subject: Subject) -> Result:
    """Rung 8: equivalence of the return curves and of the final greedy return."""
    title = "learning: the same learner on both backends"
    reason = (
        f"equivalence, not mere lack of difference: the {CONFIDENCE:.0%} interval of the mean "
        f"difference over {SEEDS} seeds must lie within ±{CURVE_MARGIN:g} (curve) and "
        f"±{GREEDY_MARGIN:g} (greedy)"
    )
    if subject.against == "itself" and subject.beyond:
        return beyond_result(8, title, reason, subject.beyond)
    if subject.gym_cannot:
        return Result(
            8, title, reason, skipped=f"gymnasium cannot play this cart-pole: {subject.gym_cannot}"
        )
    episodes, evaluations = (80, 3) if subject.quick else (1_000, 50)
    jobs = [_Job(subject, seed, episodes, evaluations) for seed in range(SEEDS)]
    rows = np.array(_run_all(jobs, subject.quick))
    ours, gyms = rows[:, 0], rows[:, 1]
    low, high = _interval(ours - gyms)
    # An interval lies within a margin if the end that is further from zero does.
    furthest = np.maximum(np.abs(low), np.abs(high))
    values: list[tuple[str, float, float | None]] = [
        ("curve: furthest end of an interval", furthest[:BLOCKS].max(), CURVE_MARGIN),
        ("greedy: furthest end of the interval", furthest[-1], GREEDY_MARGIN),
        ("greedy: interval from", low[-1], None),
        ("greedy: interval to", high[-1], None),
        ("mean greedy return on MuJoCo", ours[:, -1].mean(), None),
        ("mean greedy return on gymnasium", gyms[:, -1].mean(), None),
    ]
    figures = tuple(Figure(name, float(value), bound) for name, value, bound in values)
    return Result(8, title, reason, figures)


def _interval(differences: Vector) -> tuple[Vector, Vector]:
    """Student's interval of the mean of each column, shape (columns,) twice.

    The seeds are paired: both backends start from the same table, draws and states.
    """
    n = len(differences)
    mean, deviation = differences.mean(axis=0), differences.std(axis=0, ddof=1)
    half = stats.t.ppf(0.5 + CONFIDENCE / 2, n - 1) * deviation / np.sqrt(n)
    return mean - half, mean + half


def _run_all(jobs: list[_Job], quick: bool) -> list[list[list[float]]]:
    workers = 1 if quick else min(os.cpu_count() or 1, len(jobs))
    if workers == 1:
        return [_run_one(job) for job in jobs]
    # A fresh interpreter each: nothing of OpenGL or threads is inherited.
    with multiprocessing.get_context("spawn").Pool(workers) as pool:
        return pool.map(_run_one, jobs, chunksize=1)


def _run_one(job: _Job) -> list[list[float]]:
    """Block means of the returns, and the mean greedy return, on either backend."""
    config = TrainConfig.preset("tuned", episodes=job.episodes, seed=job.seed)
    rows = []
    for env in (job.subject.ours(), job.subject.gyms()):
        training = Training(config, env)
        for _ in training.run():
            pass
        result = training.result()
        blocks = [float(block.mean()) for block in np.array_split(result.returns, BLOCKS)]
        greedy = [
            play_episode(env, result.policy, seed=SEED if number == 0 else None)[0].total
            for number in range(job.evaluations)
        ]
        rows.append([*blocks, float(np.mean(greedy))])
    return rows
