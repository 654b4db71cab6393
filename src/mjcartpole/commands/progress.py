"""Progress bars on stderr: on terminals only, and gone when the work is done."""

import sys
import time
from collections.abc import Iterable
from typing import TYPE_CHECKING, Final

from mjcartpole.commands.bar import Bar
from mjcartpole.learning.compiling import compiling
from mjcartpole.learning.session import Session
from mjcartpole.signals import StopSignals

if TYPE_CHECKING:
    from mjcartpole.studies.multi_seed import SeedRunner

RUNNING_MEAN = 100
"""Episodes in the progress bar's mean."""
REPORT_EVERY: Final = 60.0
"""Seconds between two lines where there is no terminal for a bar: a cluster's log, for instance."""


def doing() -> str:
    """Return what a training is at."""
    return "compiling" if compiling else "training"


def train_session(session: Session, signals: StopSignals) -> None:
    """Train to the end or to a signal; print on a terminal how fast it was."""
    training = session.training
    bar = Bar(doing, training.config.episodes, "episodes")
    bar.done = len(training.log)
    with bar:
        for finished in session.run(signals.stop):
            recent = training.log.storage.totals[max(0, finished - RUNNING_MEAN) : finished]
            greedy = "".join(f", greedy {its.mean:.1f}" for its in training.evaluations[-1:])
            bar.done, bar.said = finished, f", mean return {recent.mean():5.1f}{greedy}"
    if bar.shown:
        # No two runs take the same time: what stdout says is the same each time.
        result = training.result()
        rate = result.steps / result.seconds if result.seconds else 0.0
        speed = f"{result.steps:,} steps in {result.seconds:.1f} s ({rate:,.0f} per second)"
        print(speed, file=sys.stderr, flush=True)


def train_seeds(runner: "SeedRunner", signals: StopSignals) -> None:
    """Train all seeds to the end or to a signal."""
    with Bar(doing, len(runner.seeds), "seeds") as bar:
        for found in runner.run(signals.stop):
            bar.done += found is not None


def study_runs(found: Iterable[object], total: int) -> None:
    """Follow the runs of a study to the end; None among them is no run."""
    done, started = 0, time.monotonic()
    said = started
    with Bar(doing, total, "runs") as bar:
        for record in found:
            done += record is not None
            bar.done = done
            now = time.monotonic()
            if not bar.shown and done and now - said > REPORT_EVERY:
                said, left = now, (now - started) / done * (total - done)
                print(
                    f"{done:,} of {total:,} runs, {left:,.0f} s left", file=sys.stderr, flush=True
                )
