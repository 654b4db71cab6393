"""What imports leave is not looked through again and again."""

import gc
import subprocess
import sys

from mjcartpole.garbage import kept


class Cycle:
    """Garbage that only the collector finds."""

    alive = 0

    def __init__(self):
        Cycle.alive += 1
        self.itself = self

    def __del__(self):
        Cycle.alive -= 1


def test_nothing_is_looked_through_meanwhile_and_garbage_is_found_later():
    gc.collect()
    with kept():
        before = gc.get_stats()[0]["collections"]
        others = [[] for _ in range(10 * gc.get_threshold()[0])]
        Cycle()
        assert gc.get_stats()[0]["collections"] == before
    assert gc.isenabled()
    assert gc.get_count()[0] < len(others)
    assert Cycle.alive == 1
    gc.collect()
    assert Cycle.alive == 0


def test_a_collector_that_was_off_stays_off_and_what_was_frozen_stays_frozen():
    gc.disable()
    gc.freeze()
    try:
        with kept():
            pass
        assert not gc.isenabled()
        assert gc.get_freeze_count() > 1_000
    finally:
        gc.unfreeze()
        gc.enable()


def test_importing_the_package_looks_for_garbage_less_often_than_importing_gymnasium():
    code = "import gc, sys, {}; print(sum(each['collections'] for each in gc.get_stats()))"
    ours, others = (
        int(subprocess.check_output([sys.executable, "-c", code.format(name)]))
        for name in ("mjcartpole", "gymnasium")
    )
    assert ours < others / 2
