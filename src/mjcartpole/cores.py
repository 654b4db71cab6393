"""Cores: how many this process may use, and how many things it does at once."""

import os

from mjcartpole.errors import ConfigError


def available_cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def worker_count(workers: int | None, jobs: int) -> int:
    """Return how many jobs to do at once: as many as there are cores if nothing was asked.

    Raises:
        ConfigError: The number that was asked makes no sense.
    """
    if workers is not None and workers < 1:
        raise ConfigError(f"workers must be a whole number from 1 up, not {workers}")
    return max(1, min(workers or available_cores(), jobs))
