"""From a continuous observation to the row of a table."""

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from mjcartpole.errors import ConfigError

MAX_STATES = 1_000_000
"""More rows than anybody can visit; a table beyond this is taken for a slip of the finger."""


Ints: TypeAlias = Sequence[int] | npt.NDArray[np.int64]
Floats: TypeAlias = Sequence[float] | npt.NDArray[np.float64]
"""Plain Python is quicker with the one, compiled code with the other."""


class Grid(NamedTuple):
    """The dimensions that have more than one bin, each field of shape (used dimensions,)."""

    dimensions: Ints
    bins: Ints
    low: Floats
    high: Floats
    width: Floats
    """Of one bin."""


def row_of(values: Sequence[float], grid: Grid) -> int:
    """Row of an observation, shape (d,), in a table of C order; Numba compiles it as it is."""
    row = 0
    for axis in range(len(grid.bins)):
        value, n = values[grid.dimensions[axis]], grid.bins[axis]
        if value < grid.low[axis]:
            row *= n
        elif value >= grid.high[axis]:
            row = row * n + n - 1
        else:
            # Rounding may lift the last value below `high` into bin n.
            row = row * n + min(int((value - grid.low[axis]) / grid.width[axis]), n - 1)
    return row


@dataclass(frozen=True)
class Discretizer:
    """A regular grid over the observation.

    Each dimension is cut into equal bins between `low` and `high`; values outside belong to the
    first or the last bin, so every observation has a row. One bin means: ignore this dimension.

    Attributes:
        bins: Number of bins per dimension, shape (d,).
        low: Lower end of the grid per dimension (m, m/s, rad, rad/s).
        high: Upper end.
        grid: The same for `row_of`.
    """

    bins: tuple[int, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    grid: Grid = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        self._check()
        used = tuple(dimension for dimension, n in enumerate(self.bins) if n > 1)
        bins = tuple(self.bins[dimension] for dimension in used)
        low = tuple(float(self.low[dimension]) for dimension in used)
        high = tuple(float(self.high[dimension]) for dimension in used)
        width = tuple((b - a) / n for n, a, b in zip(bins, low, high, strict=True))
        object.__setattr__(self, "grid", Grid(used, bins, low, high, width))

    @property
    def n_states(self) -> int:
        """Number of rows."""
        return math.prod(self.bins)

    def __call__(self, values: Sequence[float]) -> int:
        """Row of an observation, counted as in a C-ordered array of shape `bins`.

        Args:
            values: The observation as plain floats, shape (d,).
        """
        return row_of(values, self.grid)

    def _check(self) -> None:
        if not len(self.bins) == len(self.low) == len(self.high):
            raise ConfigError(
                "bins, low and high need one value per dimension of the observation; "
                f"found {len(self.bins)}, {len(self.low)} and {len(self.high)} values"
            )
        if not all(type(n) is int and n >= 1 for n in self.bins):
            raise ConfigError(f"bins must be whole numbers from 1 up, not {self.bins}")
        for n, low, high in zip(self.bins, self.low, self.high, strict=True):
            if not (is_finite(low) and is_finite(high) and low < high):
                raise ConfigError(
                    "a dimension's range must be two finite numbers with low < high, "
                    f"not {low!r} to {high!r}"
                )
            if not 0 < (high - low) / n < math.inf:
                raise ConfigError(f"the range {low!r} to {high!r} cannot be cut into {n} bins")
        if self.n_states > MAX_STATES:
            raise ConfigError(
                f"bins {self.bins} make {self.n_states} states; the most is {MAX_STATES}"
            )


def is_finite(value: object) -> bool:
    """Whether a value is a number, and neither infinite nor NaN."""
    # math.isfinite fails for a whole number that no float can hold.
    return isinstance(value, int | float) and abs(value) <= sys.float_info.max
