"""Designs: which points of the factors' space a study looks at."""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
import numpy.typing as npt

from mjcartpole.errors import ConfigError

Design = Literal["grid", "random", "latin"]
Point = dict[str, Any]
"""A level for each factor."""

MOST_POINTS: Final = 100_000


@dataclass(frozen=True)
class Range:
    """Every number between two.

    Attributes:
        low: The least.
        high: The largest.
        log: Whether its logarithm is what is evenly spread.
        whole: Whether only whole numbers are meant.
        levels: How many levels a grid has of it; None where none was said.
    """

    low: float
    high: float
    log: bool = False
    whole: bool = False
    levels: int | None = None

    def __contains__(self, number: object) -> bool:
        """Return whether it is one of the levels, or where none were said a number of the range."""
        if self.levels is not None:
            return number in self.evenly()
        return isinstance(number, int | float) and self.low <= number <= self.high

    def at(self, share: float) -> float:
        """Return the number at a share of the way, from 0 to 1.

        >>> Range(0.01, 1, log=True).at(0.5)
        0.1
        """
        if self.whole:
            # Each whole number has as much of the way.
            return min(math.floor(self._between(self.low, self.high + 1, share)), int(self.high))
        # Fifteen digits: the same on every machine, and 0.1 where 0.1 is meant.
        return float(f"{self._between(self.low, self.high, share):.15g}")

    def evenly(self) -> tuple[float, ...]:
        """Return the levels of a grid, both ends included."""
        n = self.levels or 1
        ends = self.low, self.high
        found = [self._between(*ends, index / max(1, n - 1)) for index in range(n)]
        return tuple(round(x) if self.whole else float(f"{x:.15g}") for x in found)

    def _between(self, low: float, high: float, share: float) -> float:
        if self.log:
            return math.exp(math.log(low) + share * (math.log(high) - math.log(low)))
        return low + share * (high - low)


@dataclass(frozen=True)
class Factor:
    """What differs from point to point.

    Attributes:
        name: A setting; see settings.py.
        levels: The values that it takes, or a range of numbers.
    """

    name: str
    levels: tuple[Any, ...] | Range

    def at(self, share: float) -> Any:  # noqa: ANN401 - whatever a field holds
        """Return the level at a share of the way, from 0 up to 1."""
        if isinstance(self.levels, Range):
            return self.levels.at(share)
        return self.levels[min(int(share * len(self.levels)), len(self.levels) - 1)]

    def on_grid(self) -> tuple[Any, ...]:
        """Return the levels that a grid has of it."""
        return self.levels.evenly() if isinstance(self.levels, Range) else self.levels


def points_of(factors: Sequence[Factor], design: Design, samples: int, seed: int) -> list[Point]:
    """Return the points of a design, each once.

    grid: every combination of levels. random: so many samples, drawn independently by a seed; more
    samples keep those before. latin: a Latin hypercube (McKay, Beckman and Conover 1979,
    doi:10.2307/1268522) of as many, which spreads the levels of each factor evenly.

    Raises:
        ConfigError: There are too many.
    """
    count = math.prod(len(each.on_grid()) for each in factors) if design == "grid" else samples
    if count > MOST_POINTS:
        raise ConfigError(
            f"[factors] make {count:,} points, and at most {MOST_POINTS:,} are studied; give fewer "
            'levels, or design = "latin" with samples'
        )
    names = [each.name for each in factors]
    found = (
        dict(zip(names, levels, strict=True)) for levels in _levels(factors, design, samples, seed)
    )
    return list({tuple(map(repr, point.values())): point for point in found}.values())


def _levels(
    factors: Sequence[Factor], design: Design, samples: int, seed: int
) -> Iterator[tuple[Any, ...]]:
    if design == "grid":
        yield from itertools.product(*(each.on_grid() for each in factors))
        return
    for shares in _shares(len(factors), design, samples, seed).tolist():
        yield tuple(factor.at(share) for factor, share in zip(factors, shares, strict=True))


def _shares(n: int, design: Design, samples: int, seed: int) -> npt.NDArray[np.float64]:
    """Return shares from 0 to 1, shape (samples, n)."""
    rng = np.random.default_rng(seed)
    if design == "random":
        return rng.random((samples, n))
    # McKay, Beckman and Conover (1979, doi:10.2307/1268522): one point in each of as many strata.
    (rng,) = rng.spawn(1)
    within, strata = rng.random((samples, n)), np.tile(np.arange(1, samples + 1), (n, 1))
    for column in strata:
        rng.shuffle(column)
    return np.asarray((strata.T - within) / samples)
