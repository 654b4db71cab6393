"""How long a study will take: a few of its trainings are tried, each for a second."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from mjcartpole.errors import MjCartPoleError
from mjcartpole.learning.evaluation import EPISODES
from mjcartpole.learning.training import Training
from mjcartpole.studies.multi_seed import SeedJob, model_of
from mjcartpole.studies.study.plan import PlannedRun

TRIED: Final = 4
SECONDS: Final = 1.0


@dataclass(frozen=True)
class Expected:
    """What work is expected to be.

    Attributes:
        steps: Control steps, of greedy episodes too.
        seconds: With one worker.
    """

    steps: float
    seconds: float


def expect(runs: Sequence[PlannedRun], tried: int = TRIED, seconds: float = SECONDS) -> Expected:
    """Return what runs are expected to take, from a few of them that are evenly spread."""
    places = sorted({round(i * (len(runs) - 1) / max(1, tried - 1)) for i in range(tried)})
    found = [_tried(runs[place].job, seconds) for place in places if runs]
    share = len(runs) / max(1, len(found))
    return Expected(
        share * sum(each.steps for each in found), share * sum(each.seconds for each in found)
    )


def _tried(job: SeedJob, seconds: float) -> Expected:
    """Return what a run is expected to take; nothing of one that fails, as a study goes on then."""
    try:
        return _of_one(job, seconds)
    except MjCartPoleError:
        return Expected(0, 0)


def _of_one(job: SeedJob, seconds: float) -> Expected:
    training = Training(job.config, engine=job.engine, cartpole=model_of(job))
    until = None
    for _ in training.run():
        until = until or time.perf_counter() + seconds
        if time.perf_counter() > until:
            break
    result = training.result()
    done, lengths, config = len(result.returns), result.episodes.columns.steps, job.config
    # Where it was solved before they are over, the rest does not come.
    whole = done if training.is_over else config.episodes
    # Those that come are taken to be as long as the last ones.
    late = float(lengths[-max(1, done // 10) :].mean())
    period = config.evaluation_period
    evaluations = (whole // period if period else 0) + job.evaluated
    steps = result.steps + (whole - done + EPISODES * evaluations) * late
    return Expected(steps, steps * result.seconds / max(1, result.steps))
