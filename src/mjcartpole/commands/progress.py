"""Progress bars on stderr: on terminals only, and gone when the work is done."""

import sys
import time
from collections.abc import Iterable
from typing import Final

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeRemainingColumn,
)
from rich.text import Text

from mjcartpole.learning.compiling import compiling
from mjcartpole.learning.session import Session
from mjcartpole.signals import StopSignals
from mjcartpole.studies.multi_seed import SeedRunner

RUNNING_MEAN = 100
"""Episodes in the progress bar's mean."""
REPORT_EVERY: Final = 60.0
"""Seconds between two lines where there is no terminal for a bar: a cluster's log, for instance."""


class _Doing(ProgressColumn):
    def render(self, task: Task) -> Text:
        return Text("compiling" if compiling else "training")


def progress_bar(*columns: ProgressColumn) -> Progress:
    """Return a bar; the usual one if no columns are given."""
    console = Console(stderr=True)
    return Progress(*columns, console=console, transient=True, disable=not console.is_terminal)


def train_session(session: Session, signals: StopSignals) -> None:
    """Train to the end or to a signal; print on a terminal how fast it was."""
    columns = (
        _Doing(),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("episodes, mean return {task.fields[mean]:5.1f}{task.fields[greedy]}"),
        TimeRemainingColumn(),
    )
    training = session.training
    with progress_bar(*columns) as progress:
        done = len(training.log)
        total = training.config.episodes
        bar = progress.add_task("", total=total, completed=done, mean=0.0, greedy="")
        for finished in session.run(signals.stop):
            recent = training.log.storage.totals[max(0, finished - RUNNING_MEAN) : finished]
            greedy = "".join(f", greedy {its.mean:.1f}" for its in training.evaluations[-1:])
            progress.update(bar, completed=finished, mean=recent.mean(), greedy=greedy)
    if progress.console.is_terminal:
        # No two runs take the same time: what stdout says is the same each time.
        result = training.result()
        rate = result.steps / result.seconds if result.seconds else 0.0
        speed = f"{result.steps:,} steps in {result.seconds:.1f} s ({rate:,.0f} per second)"
        print(speed, file=sys.stderr, flush=True)


def train_seeds(runner: SeedRunner, signals: StopSignals) -> None:
    """Train all seeds to the end or to a signal."""
    columns = (_Doing(), BarColumn(), MofNCompleteColumn(), TextColumn("seeds"))
    with progress_bar(*columns) as progress:
        bar = progress.add_task("", total=len(runner.seeds))
        for found in runner.run(signals.stop):
            progress.update(bar, advance=0 if found is None else 1)


def study_runs(found: Iterable[object], total: int) -> None:
    """Follow the runs of a study to the end; None among them is no run."""
    columns = (_Doing(), BarColumn(), MofNCompleteColumn(), TextColumn("runs"))
    done, started = 0, time.monotonic()
    said = started
    with progress_bar(*columns, TimeRemainingColumn()) as progress:
        bar = progress.add_task("", total=total)
        for record in found:
            done += record is not None
            progress.update(bar, completed=done)
            now = time.monotonic()
            if progress.disable and done and now - said > REPORT_EVERY:
                said, left = now, (now - started) / done * (total - done)
                print(
                    f"{done:,} of {total:,} runs, {left:,.0f} s left", file=sys.stderr, flush=True
                )
