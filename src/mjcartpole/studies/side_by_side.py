"""Jobs side by side: in threads, in processes, or wherever an executor brings them."""

import concurrent.futures
import contextlib
import itertools
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import BrokenExecutor, Future
from multiprocessing.synchronize import Event
from typing import TypeVar

Job = TypeVar("Job")
Result = TypeVar("Result")

Stop = Callable[[], bool]
"""Says whether the work is to end."""
Work = Callable[[Job, Stop], Result]
"""Does one job, or less of it once it is to stop; a function of a module, for processes."""
Found = Generator[tuple[Job, Future[Result]] | None, None, None]
"""Each job with its future when that is done, and None now and then while waiting; to be closed."""


def side_by_side(
    work: Work[Job, Result], jobs: Iterable[Job], workers: int, stop: Stop, *, threads: bool
) -> Found[Job, Result]:
    """Do jobs, so many at once, in threads or in processes of their own."""
    return (_in_threads if threads else _in_processes)(work, jobs, workers, stop)


def as_they_come(
    submit: Callable[[Job], Future[Result]], jobs: Iterable[Job], at_once: Callable[[], int]
) -> Found[Job, Result]:
    """Submit jobs, so many ahead at a time."""
    left, waiting = iter(jobs), dict[Future[Result], Job]()
    while True:
        for job in itertools.islice(left, max(0, at_once() - len(waiting))):
            waiting[_submitted(submit, job)] = job
        if not waiting:
            return
        done, _ = concurrent.futures.wait(
            waiting, timeout=0.1, return_when=concurrent.futures.FIRST_COMPLETED
        )
        yield from [(waiting.pop(future), future) for future in done]
        yield None


def _submitted(submit: Callable[[Job], Future[Result]], job: Job) -> Future[Result]:
    try:
        return submit(job)
    except (BrokenExecutor, OSError) as error:
        # A process was killed before, or there is no memory for one.
        failed = Future[Result]()
        failed.set_exception(error)
        return failed


def _in_threads(
    work: Work[Job, Result], jobs: Iterable[Job], workers: int, stop: Stop
) -> Found[Job, Result]:
    with concurrent.futures.ThreadPoolExecutor(workers) as pool:
        try:
            # As many again are in line, so that no thread waits for this one.
            yield from as_they_come(
                lambda job: pool.submit(work, job, stop), jobs, lambda: 2 * workers
            )
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def _in_processes(
    work: Work[Job, Result], jobs: Iterable[Job], workers: int, stop: Stop
) -> Found[Job, Result]:
    # A fresh interpreter each: nothing of OpenGL or threads is inherited.
    spawn = multiprocessing.get_context("spawn")
    with _signals_for_parent():
        stopped = spawn.Event()

    with concurrent.futures.ProcessPoolExecutor(
        workers, mp_context=spawn, initializer=_begin_worker, initargs=(stopped,)
    ) as pool:

        def submit(job: Job) -> Future[Result]:
            with _signals_for_parent():
                return pool.submit(_work_in_process, work, job)

        try:
            for found in as_they_come(submit, jobs, lambda: 2 * workers):
                if stop():
                    stopped.set()
                yield found
        finally:
            stopped.set()


@contextlib.contextmanager
def _signals_for_parent() -> Iterator[None]:
    """Have processes that are started inside never see signals that end a job.

    A terminal, and `timeout`, send them to all processes of a job.
    """
    if sys.platform == "win32":
        yield
        return
    ending = {signal.SIGINT, signal.SIGTERM, signal.SIGHUP}
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ending)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


_stopped: Event | None = None


def _begin_worker(stopped: Event) -> None:
    """Leave signals to the process that began the work; it says when to stop."""
    global _stopped  # noqa: PLW0603 - the pool has no other way to hand an event over
    _stopped = stopped
    leave_to_parent()


def leave_to_parent() -> None:
    """Leave Ctrl-C to the process that began this worker, and end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End with a parent that was killed: a worker would keep its folders locked."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


def _work_in_process(work: Work[Job, Result], job: Job) -> Result:
    assert _stopped is not None
    return work(job, _stopped.is_set)
