"""The greedy curve of a training: evaluations in its midst, and where it is solved by them."""

from collections.abc import Iterable, Sequence
from typing import Final, NamedTuple

CURVE_SEED: Final = 2_000_000
"""Seeds their starting states: others than those of the evaluation after a training, which would
else confirm the luck of one that stopped at these."""


class GreedyPoint(NamedTuple):
    """What greedy episodes in the midst of a training came to."""

    episodes: int
    """Training episodes before them."""
    steps: int
    """Their steps."""
    seconds: float
    """Time that those took."""
    mean: float
    """Mean greedy return."""
    minimum: float
    """The least."""


def first_reached(curve: Iterable[GreedyPoint], threshold: float | None) -> GreedyPoint | None:
    """Return the first point whose mean reaches the threshold; None where there is none."""
    if threshold is None:
        return None
    return next((point for point in curve if point.mean >= threshold), None)


def as_csv(curve: Sequence[GreedyPoint]) -> str:
    """Return one line per point under a line of names; without seconds, which differ each time."""
    lines = [f"{p.episodes},{p.steps},{p.mean},{p.minimum}\n" for p in curve]
    return "".join(["episode,steps,mean,minimum\n", *lines])
