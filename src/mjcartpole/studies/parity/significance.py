"""What chance would do to two samples, in closed form: the tests of the rungs that compare them."""

import itertools
import math
from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

STUDENT: Final = 1.729132811521368
"""Student's quantile of 95 % for 19 degrees of freedom: half a 90 % interval of 20 values."""


def same_distribution(a: Sequence[int], b: Sequence[int]) -> float:
    """Return p of the two-sided Kolmogorov-Smirnov test of two samples of one size.

    Exact where no two values are equal, and otherwise larger than it need be. Gnedenko and
    Korolyuk (1951): the largest distance of two walks of n steps, counted by reflections.

    >>> round(same_distribution([1, 2, 3, 4], [5, 6, 7, 8]), 6)
    0.028571
    """
    n, values = len(a), np.union1d(a, b)
    below = (np.searchsorted(np.sort(each), values, side="right") for each in (a, b))
    apart = int(np.abs(next(below) - next(below)).max())
    if apart == 0:
        return 1.0
    reflected = (math.comb(2 * n, n - apart * k) for k in range(1, n // apart + 1))
    signed = sum(count * sign for count, sign in zip(reflected, itertools.cycle((1, -1))))
    return min(1.0, 2 * signed / math.comb(2 * n, n))


def same_frequencies(counts: npt.NDArray[np.int64]) -> float:
    """Return p of the chi-squared test that both rows fall into up to three columns alike.

    Counts have the shape (2, columns). With two columns Yates's correction is made (1934,
    doi:10.2307/2983604).
    """
    seen = counts[:, counts.sum(axis=0) > 0]
    if seen.shape[1] < 2:
        return 1.0
    expected = np.outer(seen.sum(axis=1), seen.sum(axis=0)) / seen.sum()
    apart = np.abs(seen - expected)
    if seen.shape[1] == 2:
        apart -= np.minimum(0.5, apart)
    half = float((apart**2 / expected).sum()) / 2
    return math.erfc(math.sqrt(half)) if seen.shape[1] == 2 else math.exp(-half)
