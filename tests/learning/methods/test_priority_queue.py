"""A queue in flat arrays against a list that is searched."""

import numpy as np
import pytest

from mjcartpole.learning.methods.priority_queue import make_queue, pop, push


@pytest.mark.parametrize("n", [1, 2, 7, 50])
def test_the_most_urgent_comes_first_whatever_was_done_before(n):
    rng, queue, expected = np.random.default_rng(n), make_queue(n), {}
    for _ in range(1_000):
        if rng.random() < 0.6 or not expected:
            thing, priority = int(rng.integers(n)), float(rng.random())
            push(queue, thing, priority)
            expected[thing] = max(priority, expected.get(thing, 0.0))
        else:
            first = pop(queue)
            assert expected.pop(first) == max([queue.priority[first], *expected.values()])
        assert queue.n_queued[0] == len(expected)
        assert set(queue.heap[: len(expected)].tolist()) == set(expected)
        assert set(np.flatnonzero(queue.place).tolist()) == set(expected)
    for thing, priority in expected.items():
        assert queue.priority[thing] == priority
        assert queue.heap[queue.place[thing] - 1] == thing
