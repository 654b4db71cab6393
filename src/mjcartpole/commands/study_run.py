"""A study, from its file to its tables."""

import contextlib
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

from mjcartpole.commands import progress
from mjcartpole.commands.printing import counted
from mjcartpole.commands.study_options import StudyOptions
from mjcartpole.cores import available_cores, worker_count
from mjcartpole.output import FAILED
from mjcartpole.physics.simulation import silence_mujoco
from mjcartpole.signals import Interrupted, StopSignals
from mjcartpole.studies.study.cluster import connected, run_there, threads_of
from mjcartpole.studies.study.expect import expect
from mjcartpole.studies.study.folder import claimed_study
from mjcartpole.studies.study.measures import MEASURES
from mjcartpole.studies.study.plan import Plan, PlannedRun, in_words, plan
from mjcartpole.studies.study.records import RecordLog, versions
from mjcartpole.studies.study.runner import keep, left_of, run_here, unique
from mjcartpole.studies.study.study_file import read_study
from mjcartpole.studies.study.tables import RUNS, write_tables

SHOWN = 10
"""Failed runs that are told one by one."""


def run(file: Path, folder: Path, how: StudyOptions) -> int:
    """Do what a study's file asks and is not done yet. Returns the exit code.

    Raises:
        Interrupted: After Ctrl-C, SIGTERM or SIGHUP, when what is done is kept.
    """
    silence_mujoco()
    worker_count(how.workers, 1)  # What makes no sense is refused before a folder is claimed.
    planned, signals = plan(read_study(file), how.engine), StopSignals()
    cluster = connected(how.scheduler) if how.scheduler is not None else contextlib.nullcontext()
    with signals.caught(), cluster as client:
        if how.dry_run:
            return _dry_run(planned, folder, how, threads_of(client) if client else None)
        with claimed_study(folder, planned.study.text, how.resume, how.overwrite):
            log = RecordLog(folder)
            left = left_of(planned, log)
            _print_head(planned, left, log)
            with signals.deferred():
                if client:
                    found = run_there(left, client, signals.stop)
                else:
                    found = run_here(left, how.workers, signals.stop)
                with contextlib.closing(keep(found, log)) as kept:
                    progress.study_runs(kept, len(left))
            digest = write_tables(folder, planned, log.found)
            print(f"\nstudy  {folder}\ntable  {folder / RUNS}\ndigest {digest}")
            there = f" --scheduler {how.scheduler}" if how.scheduler else ""
            again = f"mjcartpole study {shlex.quote(str(file))}{there}"
            return _tell_failed(planned, log, folder, signals, again)


def _dry_run(planned: Plan, folder: Path, how: StudyOptions, there: int | None) -> int:
    left = left_of(planned, RecordLog(folder)) if how.resume else unique(planned)
    _print_size(planned)
    for name in planned.study.measure:
        print(f"measure  {name}: {MEASURES[name].text}")
    if how.resume:
        print(f"left     {counted(len(left), 'run')}")
    if left:
        expected, (cores, at_once) = expect(left), _at_once(len(left), how, there)
        print(
            f"steps    about {expected.steps:.2g}\n"
            f"time     about {in_time(expected.seconds / cores)} with {at_once}"
        )
    return 0


def _at_once(runs: int, how: StudyOptions, there: int | None) -> tuple[int, str]:
    """Return how many cores do runs, here or of a cluster that has so many, and that in words."""
    if there is None:
        workers = worker_count(how.workers, runs)
        return min(workers, available_cores()), f"{workers} at once"
    if not there:
        return 1, "one worker; the scheduler has none yet"
    return (workers := min(there, runs)), f"{workers} at once"


def in_time(seconds: float) -> str:
    """Return a stretch of time in words.

    >>> in_time(4.2), in_time(150), in_time(20_000)
    ('4 s', '2 min 30 s', '5 h 33 min')
    """
    whole = max(1, round(seconds))
    minutes, hours = whole // 60, whole // 3600
    if hours:
        return f"{hours} h {minutes % 60} min"
    return f"{minutes} min {whole % 60} s" if minutes else f"{whole} s"


def _print_size(planned: Plan) -> None:
    study = planned.study
    factors = ", ".join(f"{each.name}" for each in study.factors)
    print(f"{counted(planned.points, 'point')} ({study.design}: {factors})")
    seeds = counted(len(study.seeds), "seed")
    print(f"{counted(len(planned.runs), 'run')}, {seeds} each")


def _print_head(planned: Plan, left: Sequence[PlannedRun], log: RecordLog) -> None:
    _print_size(planned)
    if log.damaged:
        what = counted(log.damaged, "line")
        print(f"mjcartpole: {log.path}: {what} cut short or damaged, left out", file=sys.stderr)
    if done := len(unique(planned)) - len(left):
        print(f"{counted(done, 'run')} done before, {len(left):,} left")
    if others := _other_versions(planned, log):
        what = f"some runs were done before with {', '.join(others[:SHOWN])}"
        print(f"mjcartpole: {what}; --overwrite does all anew", file=sys.stderr)
    sys.stdout.flush()


def _other_versions(planned: Plan, log: RecordLog) -> list[str]:
    done = [log.found[run.key].versions for run in planned.runs if run.key in log.found]
    return sorted(
        {
            f"{name} {there[name]!r} (here {here!r})"
            for name, here in versions().items()
            for there in done
            if there[name] != here
        }
    )


def _tell_failed(
    planned: Plan, log: RecordLog, folder: Path, signals: StopSignals, again: str
) -> int:
    """Say what failed and what is not done, and return the exit code."""
    left = left_of(planned, log)
    failed = [run for run in planned.runs if run.key in log.found and log.found[run.key].error]
    for run in failed[:SHOWN]:
        where = f"{in_words(run.factors)} seed={run.job.config.seed}"
        print(f"mjcartpole: error: {where} failed: {log.found[run.key].error}", file=sys.stderr)
    if failed[SHOWN:]:
        print(f"mjcartpole: error: and {len(failed) - SHOWN} more failed", file=sys.stderr)
    if left:
        done = len(unique(planned)) - len(left)
        said = (
            f"{done:,} of {done + len(left):,} runs done and kept in {folder}; go on with: "
            f"{again} --run-dir {shlex.quote(str(folder))} --resume"
        )
        if signals.stop():
            raise Interrupted(f"interrupted with {said}", signals.number)
        print(f"mjcartpole: error: {said}", file=sys.stderr)
    return FAILED if left or failed else 0
