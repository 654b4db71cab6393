"""Two things timed in turn, and how their rates compare."""

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

Work = Callable[[], object]


@dataclass(frozen=True)
class Ratio:
    """How many times faster one thing is than another, in one run.

    Attributes:
        section: What it is about.
        name: What is compared with what.
        wanted: A bound that the project sets itself; None where there is none.
        values: One ratio per repeat.
        seconds: Median time of one repeat of each.
    """

    section: str
    name: str
    wanted: float | None
    values: tuple[float, ...]
    seconds: tuple[float, float]

    @property
    def median(self) -> float:
        """The middle of the repeats."""
        return statistics.median(self.values)

    def row(self) -> str:
        """A line of the table."""
        wanted = f"(wanted {self.wanted:g})" if self.wanted is not None else ""
        spread = f"{min(self.values):.3g} to {max(self.values):.3g}"
        return f"  {self.name:66s} {self.median:8.3g}   {spread:18s} {wanted}"

    def summary(self) -> dict[str, Any]:
        """The same for JSON."""
        return {
            "section": self.section,
            "name": self.name,
            "wanted": self.wanted,
            "median": self.median,
            "values": list(self.values),
            "median_seconds": list(self.seconds),
        }


def seconds(work: Work) -> float:
    """Time of one call."""
    started = time.perf_counter()
    work()
    return time.perf_counter() - started


def compare(
    section: str,
    name: str,
    ours: Work,
    theirs: Work,
    *,
    repeats: int,
    wanted: float | None = None,
    share: float = 1.0,
) -> Ratio:
    """Time two things in turn, each once before it counts.

    Args:
        section: What it is about.
        name: What is compared with what.
        ours: The one whose rate is asked for.
        theirs: The one that it is held against.
        repeats: How often.
        wanted: The bound.
        share: Work of `ours` over work of `theirs`, where they do not do equally much.
    """
    ours()
    theirs()
    pairs = []
    for repeat in range(repeats):
        # Whoever comes second finds warmer caches, so they take turns.
        if repeat % 2:
            mine, other = seconds(ours), seconds(theirs)
        else:
            other, mine = seconds(theirs), seconds(ours)
        pairs.append((mine, other))
    values = tuple(share * other / mine for mine, other in pairs)
    mines, others = zip(*pairs, strict=True)
    return Ratio(
        section, name, wanted, values, (statistics.median(mines), statistics.median(others))
    )
