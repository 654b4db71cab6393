"""Rung 8: the same learner on both backends, and whether it comes to the same."""

import multiprocessing
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from mjcartpole.cores import worker_count
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.evaluation import SEED
from mjcartpole.learning.loop import play_episode
from mjcartpole.learning.training import Training
from mjcartpole.learning.training_grid import training_grid
from mjcartpole.studies.parity.case import Subject, Vector
from mjcartpole.studies.parity.result import Figure, Question, Result
from mjcartpole.studies.parity.significance import STUDENT
from mjcartpole.studies.side_by_side import leave_to_parent

SEEDS: Final = 20
"""`STUDENT` is for as many."""
BLOCKS: Final = 10
"""The return curve is compared in this many blocks of episodes."""

CONFIDENCE: Final = 0.90
"""Of each interval: two one-sided tests at 5 % (Schuirmann, 1987, doi:10.1007/BF01068419)."""

MARGINS: Final = {"mean": 25.0, "block": 75.0, "greedy": 50.0}
"""Differences in return, of 500, that nobody would act on: 5 % for the mean of the whole curve,
10 % for the final greedy return, and 15 % for a block of the curve, since in the middle of learning
seeds differ by so much that 20 of them cannot tell less."""

PARTS: Final[dict[str, Callable[[Vector], Vector]]] = {
    "mean": lambda rows: rows[:, :-1].mean(axis=1, keepdims=True),
    "block": lambda rows: rows[:, :-1],
    "greedy": lambda rows: rows[:, -1:],
}
"""What is compared of each seed's row: the blocks of its curve and, last, the greedy return."""

SPREAD_FACTOR: Final = 1.5
"""A model that is asked about itself may learn as it likes: there a margin is at least this many
standard deviations between seeds."""


@dataclass(frozen=True)
class _Job:
    subject: Subject
    seed: int
    episodes: int
    evaluations: int
    mirror: bool


def learning(subject: Subject) -> Result:
    """Rung 8: equivalence of the return curves and of the final greedy return."""
    margins = ", ".join(f"{name} ±{margin:g}" for name, margin in MARGINS.items())
    reason = (
        f"equivalence, not mere lack of difference: the {CONFIDENCE:.0%} interval of the mean "
        f"difference over {SEEDS} seeds must lie within a margin that nobody would act on "
        f"({margins})"
    )
    if subject.against == "itself":
        reason += f", or {SPREAD_FACTOR:g} standard deviations between seeds"
    question = Question(8, "learning: the same learner on both backends", reason)
    if uncovered := subject.uncovered():
        return question.leave(uncovered)
    if subject.gym_cannot:
        return question.skip(f"gymnasium cannot play this cart-pole: {subject.gym_cannot}")
    episodes, evaluations = (40, 3) if subject.quick else (1_000, 30)
    mirror = _is_symmetric(subject)
    jobs = [_Job(subject, seed, episodes, evaluations, mirror) for seed in range(SEEDS)]
    rows = np.array(_run_all(jobs, subject.quick))
    figures = _figures(rows[:, 0], rows[:, 1], relaxed=subject.against == "itself")
    return question.answer(figures)


def _is_symmetric(subject: Subject) -> bool:
    """Return whether a training learns of one side what the other one teaches."""
    return training_grid(TrainConfig.preset("tuned"), subject.cartpole).mirror


def _figures(ours: Vector, gyms: Vector, *, relaxed: bool) -> tuple[Figure, ...]:
    """Return how far the rows of both backends are apart."""
    figures = []
    for name, part in PARTS.items():
        low, high = _interval(part(ours) - part(gyms))
        # An interval lies within ±margin if the end that is further from zero does.
        furthest = np.maximum(np.abs(low), np.abs(high))
        worst = int(furthest.argmax())
        margin = MARGINS[name]
        if relaxed:
            margin = max(margin, SPREAD_FACTOR * float(gyms.std(axis=0, ddof=1).max()))
        figures += [
            Figure(f"{name}: furthest end of the interval", float(furthest[worst]), margin),
            Figure(f"{name}: interval from", float(low[worst])),
            Figure(f"{name}: interval to", float(high[worst])),
        ]
    figures += [
        Figure("mean greedy return on MuJoCo", float(ours[:, -1].mean())),
        Figure("mean greedy return on gymnasium", float(gyms[:, -1].mean())),
    ]
    return tuple(figures)


def _interval(differences: Vector) -> tuple[Vector, Vector]:
    """Return Student's interval of the mean of each column, shape (columns,) twice.

    The seeds are paired: both backends start from the same table, draws and states.
    """
    mean, deviation = differences.mean(axis=0), differences.std(axis=0, ddof=1)
    half = STUDENT * deviation / np.sqrt(SEEDS)
    return mean - half, mean + half


def _run_all(jobs: list[_Job], quick: bool) -> list[list[list[float]]]:
    workers = worker_count(1 if quick else None, len(jobs))
    if workers == 1:
        return [_run_one(job) for job in jobs]
    # A fresh interpreter each: nothing of OpenGL or threads is inherited.
    with multiprocessing.get_context("spawn").Pool(workers, leave_to_parent) as pool:
        return pool.map(_run_one, jobs, chunksize=1)


def _run_one(job: _Job) -> list[list[float]]:
    """Return block means of the returns, and the mean greedy return, on either backend."""
    config = TrainConfig.preset("tuned", episodes=job.episodes, seed=job.seed, mirror=job.mirror)
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
