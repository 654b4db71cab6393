"""What a study costs beside its trainings: the same ones alone and in a study, in turns.

`python benchmarks/study.py` prints, for each turn and for all of them, the processor time of the
trainings alone over that of the study, which does them on so many threads and keeps them; and the
same by the clock, which says something where so many cores are free. Beside it the same of so many
processes that know nothing of each other, which do them twice: what these cores can do at all. Then
of a Dask cluster with so many worker processes on loopback, with the time of its scheduler.
"""

import argparse
import contextlib
import multiprocessing
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

from mjcartpole.learning.training import train
from mjcartpole.packages import is_installed, missing
from mjcartpole.physics.library import stop_timers
from mjcartpole.studies.side_by_side import Found
from mjcartpole.studies.study.cluster import Parcel, connected, run_parcel, run_there
from mjcartpole.studies.study.plan import PlannedRun, plan
from mjcartpole.studies.study.records import Record, RecordLog
from mjcartpole.studies.study.runner import keep, run_here
from mjcartpole.studies.study.study_file import study_of

Runs = tuple[PlannedRun, ...]


class Took(NamedTuple):
    """What trainings took, s.

    Attributes:
        processor: Processor time, of all processes.
        clock: Time by the clock.
        runs: How many trainings there were.
    """

    processor: float
    clock: float
    runs: int


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=20, help="trainings with the preset tuned")
    parser.add_argument("--backend", default="mujoco")
    parser.add_argument("--workers", type=int, default=2, help="threads, or worker processes")
    parser.add_argument("--turns", type=int, default=3)
    asked = parser.parse_args()
    about = {"seeds": asked.runs, "measure": ["area_under_curve"]}
    study = {"study": about, "base": {"backend": asked.backend}, "factors": {"alpha": [0.3]}}
    runs = plan(study_of(study)).runs
    warm(runs)
    found = defaultdict[str, list[Took]](list)
    with loopback(asked.workers, runs[0]) as client, apart(asked.workers, runs) as processes:
        for _ in range(asked.turns):
            for name, took in turn(runs, asked.workers, client, processes):
                found[name].append(took)
                told(name, found["alone"][-1:], [took], asked.workers)
    print("all turns together:")
    for name, each in found.items():
        told(name, found["alone"], each, asked.workers)


def turn(
    runs: Runs,
    workers: int,
    client: Any,  # noqa: ANN401
    processes: ProcessPoolExecutor,
) -> Iterator[tuple[str, Took]]:
    """Yield what the trainings take in each way."""
    yield "alone", alone(runs)
    clock = time.perf_counter()
    each = list(processes.map(alone, [runs] * workers))
    clock = time.perf_counter() - clock
    yield "processes", Took(sum(one.processor for one in each), clock, workers * len(runs))
    yield "threads", timed(lambda: kept(run_here(runs, workers, lambda: False)), len(runs))
    if client is not None:
        there = timed(lambda: kept(run_there(runs, client, lambda: False)), len(runs), client)
        yield "Dask", there


def warm(runs: Runs) -> None:
    """Do a training, since what is compiled once is no part of it, in a process as a command's."""
    stop_timers()
    train(runs[0].job.config)


@contextlib.contextmanager
def apart(workers: int, runs: Runs) -> Iterator[ProcessPoolExecutor]:
    """Yield so many processes that have done a training."""
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, spawn, initializer=warm, initargs=(runs[:1],)) as pool:
        list(pool.map(alone, [runs[:1]] * workers))  # Each is there, and warm.
        yield pool


@contextlib.contextmanager
def loopback(workers: int, first: PlannedRun) -> Iterator[Any]:
    """Yield a client of a Dask cluster on this machine, on which a run was done; None without."""
    if not is_installed("distributed"):
        print(missing("Dask's overhead", "distributed"))
        yield None
        return
    from distributed import LocalCluster  # noqa: PLC0415 - an optional package

    with (
        LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address="") as cluster,
        connected(cluster.scheduler_address) as client,
    ):
        client.run(run_parcel, Parcel.of(first))
        yield client


def alone(runs: Runs) -> Took:
    """Return what the trainings take in this process, one after another."""
    return timed(lambda: [train(run.job.config) for run in runs], len(runs))


def kept(found: Found[Any, Record | None]) -> None:
    """Do runs as `mjcartpole study` does, and keep them."""
    with tempfile.TemporaryDirectory() as folder:
        for _ in keep(found, RecordLog(Path(folder))):
            pass


def timed(work: Callable[[], object], runs: int, client: Any = None) -> Took:  # noqa: ANN401
    """Return what work takes here and on a cluster's workers."""
    processor, clock = processor_time(client), time.perf_counter()
    work()
    clock = time.perf_counter() - clock
    return Took(processor_time(client) - processor, clock, runs)


def processor_time(client: Any) -> float:  # noqa: ANN401
    """Return the processor time of this process, and of a cluster's workers, s."""
    workers = client.run(time.process_time).values() if client else ()
    return time.process_time() + float(sum(workers))


def told(what: str, before: Sequence[Took], after: Sequence[Took], workers: int) -> None:
    """Print how fast trainings were beside those alone."""
    if what == "alone":
        return
    (cpu, clock, runs), (cpu_then, clock_then, runs_then) = map(total, (before, after))
    print(
        f"{what}: {cpu / runs * runs_then / cpu_then:.2f} of the speed by processor time, "
        f"{clock / runs * runs_then / clock_then / workers:.2f} by the clock "
        f"({runs_then} trainings, {workers} workers)",
        flush=True,
    )


def total(some: Sequence[Took]) -> Took:
    """Return the sums."""
    return Took(*(sum(values) for values in zip(*some, strict=True)))


if __name__ == "__main__":
    main()
