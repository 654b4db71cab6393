"""Jobs side by side: each once, so many ahead, in threads and in processes."""

import itertools
import os
import signal
import subprocess
import sys
from concurrent.futures import BrokenExecutor, Future

import pytest

from mjcartpole.studies.side_by_side import as_they_come, side_by_side


def square(job, stop):
    """Return nothing once it is to stop."""
    return None if stop() else job * job


def die(job, stop):
    os._exit(3)


def results(found):
    return {job: future.result() for job, future in filter(None, found)}


@pytest.mark.parametrize(
    "threads", [True, pytest.param(False, marks=pytest.mark.slow)], ids=["threads", "processes"]
)
def test_each_job_is_done_once(threads):
    found = side_by_side(square, range(50), 2, lambda: False, threads=threads)
    assert results(found) == {n: n * n for n in range(50)}


def test_no_more_are_submitted_than_are_wanted():
    waiting, most = set[Future](), 3

    def submit(job):
        waiting.add(future := Future())
        assert len(waiting) <= most
        return future

    found, came = as_they_come(submit, range(7), lambda: most), []
    while True:
        for future in list(waiting):
            waiting.remove(future)
            future.set_result(None)
        one = next(found, "over")
        if one == "over":
            break
        came += [one[0]] if one else []
    assert sorted(came) == list(range(7))


def test_work_that_is_to_stop_does_less():
    asked = itertools.count()
    found = results(side_by_side(square, range(9), 1, lambda: next(asked) > 4, threads=True))
    assert sorted(found) == list(range(9))
    assert list(found.values()).count(None) == 4


@pytest.mark.slow
def test_a_process_that_dies_fails_its_jobs_and_those_behind_it():
    found = side_by_side(die, range(9), 2, lambda: False, threads=False)
    failed = [future.exception() for _, future in filter(None, found)]
    assert len(failed) == 9
    assert all(isinstance(each, BrokenExecutor) for each in failed)


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="there are no such signals")
def test_the_workers_of_parity_end_with_it_and_in_silence():
    code = """
import os, signal, threading
from mjcartpole.physics.load import load_model
from mjcartpole.studies.parity import Subject, learning
learning.worker_count = lambda *_: 2
threading.Timer(8, os.kill, (os.getpid(), signal.SIGTERM)).start()
learning.learning(Subject(load_model("cartpole")))
"""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == -signal.SIGTERM
    assert "Traceback" not in done.stderr
