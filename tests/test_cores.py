"""How many things are done at once."""

import os

import pytest

from mjcartpole.cores import available_cores, worker_count
from mjcartpole.errors import ConfigError


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="the system pins no process")
def test_cores_are_those_that_this_process_may_use():
    before = os.sched_getaffinity(0)
    assert available_cores() == len(before)
    try:
        os.sched_setaffinity(0, {min(before)})
        assert available_cores() == 1
        assert worker_count(None, 9) == 1
    finally:
        os.sched_setaffinity(0, before)


@pytest.mark.parametrize(
    ("asked", "jobs", "workers"), [(3, 9, 3), (9, 3, 3), (1, 1, 1), (None, 1, 1), (2, 0, 1)]
)
def test_no_more_workers_than_jobs(asked, jobs, workers):
    assert worker_count(asked, jobs) == workers


@pytest.mark.parametrize("asked", [0, -1])
def test_refused(asked):
    with pytest.raises(ConfigError, match="workers must be a whole number from 1 up"):
        worker_count(asked, 2)
