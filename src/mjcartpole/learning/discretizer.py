"""From a continuous observation to the row of a table."""

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from mjcartpole.errors import ConfigError

MAX_STATES = 1_000_000
"""More rows than anybody can visit; a table beyond this is taken for a slip of the finger."""

TILINGS: Final = (1, 2, 4, 8, 16, 32, 64)
"""How many grids there may be: powers of two are told apart without a division."""

UNFOLDED: Final = 2**62
"""More states than any grid has: none of its rows stands for another one."""

_CELL_BITS: Final = 42
"""Of a state's number for its place between nodes; 20 are left for which nodes these are."""

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
    folding: int
    """How many states are folded in half, see `folded`; `UNFOLDED` where none are."""


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


def folded(row: int, folding: int) -> tuple[int, bool]:
    """Return the row that stands for a state and its mirror image, and whether it is the image's.

    In a grid that is symmetric about 0 the mirror image of the first row is the last one, that of
    the second the last but one; Numba compiles this as it is.
    """
    if 2 * row >= folding:
        return folding - 1 - row, True
    return row, False


@dataclass(frozen=True)
class Discretizer:
    """A regular grid over the observation.

    Each dimension is cut into equal bins between `low` and `high`; values outside belong to the
    first or the last bin, so every observation has a row. One bin means: ignore this dimension.

    Attributes:
        bins: Number of bins per dimension, shape (d,).
        low: Lower end of the grid per dimension (m, m/s, rad, rad/s).
        high: Upper end.
        mirror: Whether a learner takes a state and its mirror image for the same one.
        tilings: How many such grids, each a little offset, are summed (see tiles.py).
        interpolated: Whether bins are nodes, evenly from `low` to `high`, with values in between
            (see tiles.py).
        actions: How many of the dimensions, the last ones, are actions before.
        grid: The same for `row_of`; of several tilings the fine one that all their edges make, and
            between nodes a fine one with a cell around each.
    """

    bins: tuple[int, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    mirror: bool = False
    tilings: int = 1
    interpolated: bool = False
    actions: int = 0
    grid: Grid = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        self._check()
        used = tuple(dimension for dimension, n in enumerate(self.bins) if n > 1)
        bins = tuple(self.bins[dimension] for dimension in used)
        low = tuple(float(self.low[dimension]) for dimension in used)
        high = tuple(float(self.high[dimension]) for dimension in used)
        gaps = tuple(n - self.interpolated for n in bins)
        width = tuple((b - a) / n for n, a, b in zip(gaps, low, high, strict=True))
        if (parts := self.parts) > 1:
            # The first cell has the first node in its middle, or ends where the first bins do.
            edge = 0 if self.interpolated else 1
            low = tuple(a + (edge * w - w / parts) / 2 for a, w in zip(low, width, strict=True))
            bins = tuple((n - 1) * parts + 1 for n in bins)
            width = tuple(w / parts for w in width)
            high = tuple(a + n * w for a, n, w in zip(low, bins, width, strict=True))
        folding = math.prod(bins) if self.mirror else UNFOLDED
        object.__setattr__(self, "grid", Grid(used, bins, low, high, width, folding))

    @property
    def parts(self) -> int:
        """Into how many cells a bin, or the gap between two nodes, is cut: a power of two."""
        dimensions = sum(n > 1 for n in self.bins)
        if not (self.interpolated and dimensions):
            return self.tilings
        return 1 << min(10, _CELL_BITS // dimensions)

    @property
    def n_states(self) -> int:
        """Number of states that are told apart."""
        return math.prod(self.grid.bins)

    @property
    def n_rows(self) -> int:
        """Number of rows of a table; of a mirrored grid a learner leaves the second half alone."""
        return self.tilings * math.prod(self.bins)

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of a policy's table, but for the actions."""
        return self.bins if self.tilings == 1 else (self.tilings, *self.bins)

    def __call__(self, values: Sequence[float]) -> int:
        """State of an observation, plain floats of shape (d,); of one grid its row in C order."""
        return row_of(values, self.grid)

    def folded(self, values: Sequence[float]) -> tuple[int, bool]:
        """Return a learner's row of an observation, and whether left is right there."""
        return folded(row_of(values, self.grid), self.grid.folding)

    def unfolded(self, learned: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Return the values of both actions in all rows of one mirrored grid.

        Of equal values the first is played, which is the second one in the mirror: where a learned
        state has a tie, its first action is put ahead by the last digit. In the second half of
        `learned`, shape (n_rows, 2), nothing counts.
        """
        half = self.n_rows // 2
        values = learned[: self.n_rows - half].copy()
        ties = values[:half, 0] == values[:half, 1]
        values[:half, 1][ties] = np.nextafter(values[:half, 1][ties], -np.inf)
        return np.concatenate([values, values[:half][::-1, ::-1]])

    def _check(self) -> None:
        if not len(self.bins) == len(self.low) == len(self.high):
            raise ConfigError(
                "bins, low and high need one value per dimension of the observation; "
                f"found {len(self.bins)}, {len(self.low)} and {len(self.high)} values"
            )
        if not all(type(n) is int and n >= 1 for n in self.bins):
            raise ConfigError(f"bins must be whole numbers from 1 up, not {self.bins}")
        self._check_ranges()
        self._check_size()

    def _check_ranges(self) -> None:
        for n, low, high in zip(self.bins, self.low, self.high, strict=True):
            if not (is_finite(low) and is_finite(high) and low < high):
                raise ConfigError(
                    "a dimension's range must be two finite numbers with low < high, "
                    f"not {low!r} to {high!r}"
                )
            if not 0 < (high - low) / n < math.inf:
                bins = f"{n} bin{'s' if n > 1 else ''}"
                raise ConfigError(f"the range {low!r} to {high!r} cannot be cut into {bins}")
            if self.mirror and n > 1 and low != -high:
                raise ConfigError(
                    "mirror needs ranges that are as long to the left as to the right; "
                    f"{low!r} to {high!r} is not"
                )

    def _check_size(self) -> None:
        if self.tilings not in TILINGS:
            known = ", ".join(map(str, TILINGS))
            raise ConfigError(f"tilings must be one of {known}, not {self.tilings!r}")
        if self.tilings > 1 and self.interpolated:
            raise ConfigError("tilings are for bins, not for nodes between which is interpolated")
        if self.tilings > 1 and max(self.bins) == 1:
            raise ConfigError(
                "tilings differ where a bin ends and the next one begins, and bins "
                f"{self.bins} end nowhere; give more bins, or 1 for the tilings"
            )
        rows = self.tilings * math.prod(self.bins)
        if rows > MAX_STATES:
            times = f" in {self.tilings} tilings" if self.tilings > 1 else ""
            raise ConfigError(
                f"bins {self.bins}{times} make {rows} states; the most is {MAX_STATES}"
            )
        if math.prod((n - 1) * self.tilings + 1 for n in self.bins) >= UNFOLDED:
            raise ConfigError(f"bins {self.bins} in {self.tilings} tilings are too many to count")


def is_finite(value: object) -> bool:
    """Whether a value is a number, and neither infinite nor NaN."""
    # math.isfinite fails for a whole number that no float can hold.
    return isinstance(value, int | float) and abs(value) <= sys.float_info.max
