"""From a continuous observation to the row of a table."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from mjcartpole.errors import ConfigError

MAX_STATES = 1_000_000
"""More rows than anybody can visit; a table beyond this is taken for a slip of the finger."""


@dataclass(frozen=True)
class Discretizer:
    """A regular grid over the observation.

    Each dimension is cut into equal bins between `low` and `high`; values outside belong to the
    first or the last bin, so every observation has a row. One bin means: ignore this dimension.

    Attributes:
        bins: Number of bins per dimension, shape (d,).
        low: Lower end of the grid per dimension (m, m/s, rad, rad/s).
        high: Upper end.
    """

    bins: tuple[int, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    _axes: tuple[tuple[int, int, float, float, float], ...] = field(
        init=False, repr=False, compare=False
    )

    def __post_init__(self) -> None:
        self._check()
        axes = tuple(
            (dimension, n, low, high, (high - low) / n)
            for dimension, (n, low, high) in enumerate(
                zip(self.bins, self.low, self.high, strict=True)
            )
            if n > 1
        )
        object.__setattr__(self, "_axes", axes)

    @property
    def n_states(self) -> int:
        """Number of rows."""
        return math.prod(self.bins)

    def __call__(self, values: Sequence[float]) -> int:
        """Row of an observation, counted as in a C-ordered array of shape `bins`.

        Args:
            values: The observation as plain floats, shape (d,).
        """
        row = 0
        for dimension, n, low, high, width in self._axes:
            value = values[dimension]
            if value < low:
                row *= n
            elif value >= high:
                row = row * n + n - 1
            else:
                # Rounding may lift the last value below `high` into bin n.
                row = row * n + min(int((value - low) / width), n - 1)
        return row

    def _check(self) -> None:
        if not len(self.bins) == len(self.low) == len(self.high):
            raise ConfigError(
                "bins, low and high need one value per dimension (x, x_dot, theta, theta_dot); "
                f"found {len(self.bins)}, {len(self.low)} and {len(self.high)} values"
            )
        if not all(type(n) is int and n >= 1 for n in self.bins):
            raise ConfigError(f"bins must be whole numbers from 1 up, not {self.bins}")
        for low, high in zip(self.low, self.high, strict=True):
            if not (is_finite(low) and is_finite(high) and low < high):
                raise ConfigError(
                    "a dimension's range must be two finite numbers with low < high, "
                    f"not {low!r} to {high!r}"
                )
        if self.n_states > MAX_STATES:
            raise ConfigError(
                f"bins {self.bins} make {self.n_states} states; the most is {MAX_STATES}"
            )


def is_finite(value: object) -> bool:
    """Whether a value is a number, and neither infinite nor NaN."""
    return isinstance(value, int | float) and math.isfinite(value)
