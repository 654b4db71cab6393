"""Python's garbage collector, which need not look through what imports leave: that stays."""

import atexit
import contextlib
import gc
from collections.abc import Iterator


@contextlib.contextmanager
def kept() -> Iterator[None]:
    """Have what is made meanwhile looked through once and late, not a tenth of the time.

    It counts as old then, as if it had been looked through often.
    """
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        # What somebody froze would be old as well; Python 3.12 itself freezes some hundred objects.
        if gc.get_freeze_count() < 1_000:
            gc.freeze()
            gc.unfreeze()
        if was_on:
            gc.enable()


def collect_rarely() -> None:
    """Look for garbage seldom, and not at exit: for a process of our own."""
    gc.set_threshold(100_000)
    atexit.register(gc.freeze)
