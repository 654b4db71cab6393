"""What a study costs beside its trainings: the same ones alone and in a study, in turns.

`python benchmarks/study.py` prints, for each turn, the processor time of the trainings alone over
that of the study, which does them on so many threads and keeps them; and the same by the clock,
which says something where so many cores are free. Then the same of a Dask cluster with so many
worker processes on loopback, whose processor time is that of all of them and of the scheduler.
"""

import argparse
import contextlib
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

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


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=20, help="trainings with the preset tuned")
    parser.add_argument("--workers", type=int, default=2, help="threads, or worker processes")
    parser.add_argument("--turns", type=int, default=3)
    asked = parser.parse_args()
    stop_timers()  # As in a command.
    about = {"seeds": asked.runs, "measure": ["area_under_curve"]}
    runs = plan(study_of({"study": about, "factors": {"alpha": [0.3]}})).runs
    train(runs[0].job.config)  # What is compiled once is no part of it.
    with loopback(asked.workers, runs[0]) as client:
        for _ in range(asked.turns):
            alone = timed(lambda: [train(run.job.config) for run in runs])
            threads = timed(lambda: kept(run_here(runs, asked.workers, lambda: False)))
            told("threads", alone, threads, asked.workers, len(runs))
            if client is not None:
                dask = timed(lambda: kept(run_there(runs, client, lambda: False)), client)
                told("Dask", alone, dask, asked.workers, len(runs))


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


def kept(found: Found[Any, Record | None]) -> None:
    """Do runs as `mjcartpole study` does, and keep them."""
    with tempfile.TemporaryDirectory() as folder:
        for _ in keep(found, RecordLog(Path(folder))):
            pass


def timed(work: Callable[[], object], client: Any = None) -> tuple[float, float]:  # noqa: ANN401
    """Return the processor time, a cluster's too, and that by the clock, that work takes, s."""
    processor, clock = processor_time(client), time.perf_counter()
    work()
    clock = time.perf_counter() - clock
    return processor_time(client) - processor, clock


def processor_time(client: Any) -> float:  # noqa: ANN401
    """Return the processor time of this process, and of a cluster's workers, s."""
    workers = client.run(time.process_time).values() if client else ()
    return time.process_time() + float(sum(workers))


def told(
    what: str, alone: tuple[float, float], study: tuple[float, float], workers: int, runs: int
) -> None:
    """Print how fast a study was beside its trainings alone; both as `timed` has them."""
    print(
        f"{what}: {alone[0] / study[0]:.2f} of the speed by processor time, "
        f"{alone[1] / study[1] / workers:.2f} by the clock ({runs} trainings, {workers} workers)",
        flush=True,
    )


if __name__ == "__main__":
    main()
