"""A study at work: what is not done yet is done, and each run is kept as soon as it has come."""

import contextlib
from collections.abc import Generator, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Future
from typing import Any

from mjcartpole.cores import worker_count
from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.studies.multi_seed import SeedJob
from mjcartpole.studies.side_by_side import Found, Stop, side_by_side
from mjcartpole.studies.study.plan import Plan, PlannedRun
from mjcartpole.studies.study.records import Record, RecordLog, do_run

Runs = Sequence[PlannedRun]


def left_of(plan: Plan, log: RecordLog) -> list[PlannedRun]:
    """Return the runs that are not done yet, each once."""
    return [run for run in unique(plan) if not _is_done(run, plan, log)]


def unique(plan: Plan) -> list[PlannedRun]:
    """Return the runs of a plan; of some that are the same training under two names, one."""
    return list({run.key: run for run in plan.runs}.values())


def _is_done(run: PlannedRun, plan: Plan, log: RecordLog) -> bool:
    record = log.found.get(run.key)
    return record is not None and record.has(plan.study.measure)


def run_here(runs: Runs, workers: int | None, stop: Stop) -> Found[Any, Record | None]:
    """Do runs on this machine: see `side_by_side`.

    Raises:
        ConfigError: The number of workers makes no sense.
    """
    # The compiled engine leaves Python's lock alone.
    threads = all(run.job.engine == "compiled" for run in runs)
    jobs = ((run.key, run.job, run.tested) for run in runs if not stop())
    return side_by_side(_do, jobs, worker_count(workers, len(runs)), stop, threads=threads)


def _do(run: tuple[str, SeedJob, Disturbances | None], stop: Stop) -> Record | None:
    return do_run(*run, stop)


def keep(found: Found[Any, Record | None], log: RecordLog) -> Generator[Record | None, None, None]:
    """Write each result into the log as it comes, and yield it, or None now and then while waiting.

    A run whose process was killed has no result.

    Raises:
        FileError: The log cannot be written.
    """
    with log.writing() as add, contextlib.closing(found):
        for one in found:
            record = None if one is None else _result_of(one[1])
            if record is not None:
                add(record)
            yield record


def _result_of(future: Future[Record | None]) -> Record | None:
    try:
        return future.result()
    except (BrokenExecutor, CancelledError, OSError):
        return None  # Its process was killed: the run is as if it had not begun.
