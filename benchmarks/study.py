"""What a study costs beside its trainings: the same ones alone and in a study, in turns.

`python benchmarks/study.py` prints, for each turn, the processor time of the trainings alone over
that of the study, which does them on so many threads and keeps them; and the same by the clock,
which says something where so many cores are free.
"""

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from mjcartpole.learning.training import train
from mjcartpole.studies.study.plan import PlannedRun, plan
from mjcartpole.studies.study.records import RecordLog
from mjcartpole.studies.study.runner import keep, run_here
from mjcartpole.studies.study.study_file import study_of


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=20, help="trainings with the preset tuned")
    parser.add_argument("--workers", type=int, default=2, help="threads of the study")
    parser.add_argument("--turns", type=int, default=3)
    asked = parser.parse_args()
    about = {"seeds": asked.runs, "measure": ["area_under_curve"]}
    runs = plan(study_of({"study": about, "factors": {"alpha": [0.3]}})).runs
    train(runs[0].job.config)  # What is compiled once is no part of it.
    for _ in range(asked.turns):
        alone, alone_wall = timed(lambda: [train(run.job.config) for run in runs])
        study, study_wall = timed(lambda: in_study(runs, asked.workers))
        print(
            f"{alone / study:.2f} of the speed by processor time, "
            f"{alone_wall / study_wall / asked.workers:.2f} by the clock "
            f"({len(runs)} trainings, {asked.workers} workers)",
            flush=True,
        )


def in_study(runs: tuple[PlannedRun, ...], workers: int) -> None:
    """Do runs as `mjcartpole study` does, and keep them."""
    with tempfile.TemporaryDirectory() as folder:
        for _ in keep(run_here(runs, workers, lambda: False), RecordLog(Path(folder))):
            pass


def timed(work: Callable[[], object]) -> tuple[float, float]:
    """Return the processor time and the time by the clock that some work takes, s."""
    processor, clock = time.process_time(), time.perf_counter()
    work()
    return time.process_time() - processor, time.perf_counter() - clock


if __name__ == "__main__":
    main()
