"""A queue of numbered things, the most urgent first: a binary heap in flat arrays.

A memory that has such a queue has the arrays of `Queue`; each thing stands in it once at most.
"""

from typing import Any, NamedTuple

import numpy as np

from mjcartpole.learning.methods.action_values import FloatMemory
from mjcartpole.learning.methods.limits import PairCounts, Pairs, refuse


class Queue(NamedTuple):
    """A queue."""

    heap: Pairs
    """Things; none is more urgent than the one at (k - 1) // 2 before it at k."""
    place: PairCounts
    """Of each thing in the heap, counted from 1; 0 where it is not in it."""
    priority: FloatMemory
    """Of each thing that is in it."""
    n_queued: PairCounts
    """How many are, shape (1,)."""


def make_queue(n: int) -> Queue:
    """Return an empty queue for things 0 to n - 1."""
    heap, place, n_queued = (np.zeros(size, np.int64) for size in (n, n, 1))
    return Queue(heap, place, np.zeros(n), n_queued)


def check_queue(memory: Any) -> None:
    """Refuse a queue that contradicts itself (ValueError)."""
    waiting, places = memory.heap[: memory.n_queued[0]], np.arange(memory.n_queued[0])
    refuse("place", "is not where things are in heap", memory.place[waiting] != places + 1)
    refuse("place", "has things that wait nowhere", np.count_nonzero(memory.place) != len(waiting))
    urgency = memory.priority[waiting]
    refuse("priority", "is not in the order of heap", urgency[(places[1:] - 1) // 2] < urgency[1:])


def push(memory: Any, thing: int, priority: float) -> None:
    """Put a thing in, or make it more urgent if it is in already."""
    if memory.place[thing] > 0 and memory.priority[thing] >= priority:
        return
    if memory.place[thing] == 0:
        memory.n_queued[0] += 1
        memory.place[thing] = memory.n_queued[0]
    memory.priority[thing] = priority
    here = memory.place[thing] - 1
    while here > 0 and memory.priority[memory.heap[(here - 1) // 2]] < priority:
        _put(memory, here, memory.heap[(here - 1) // 2])
        here = (here - 1) // 2
    _put(memory, here, thing)


def pop(memory: Any) -> int:
    """Take out the most urgent thing of a queue that is not empty."""
    first = memory.heap[0]
    memory.place[first] = 0
    memory.n_queued[0] -= 1
    n = memory.n_queued[0]
    if n > 0:
        _sink(memory, memory.heap[n], n)
    return int(first)


def _sink(memory: Any, thing: int, n: int) -> None:
    """Put a thing at the top, and let it sink below what is more urgent."""
    here = 0
    while 2 * here + 1 < n:
        child = 2 * here + 1
        if child + 1 < n and _urgency(memory, child + 1) > _urgency(memory, child):
            child += 1
        if _urgency(memory, child) <= memory.priority[thing]:
            break
        _put(memory, here, memory.heap[child])
        here = child
    _put(memory, here, thing)


def _urgency(memory: Any, here: int) -> Any:
    return memory.priority[memory.heap[here]]


def _put(memory: Any, here: int, thing: int) -> None:
    memory.heap[here] = thing
    memory.place[thing] = here + 1
