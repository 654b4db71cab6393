"""How scores are spread, and what they depend on: profiles, and shares of variance."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mjcartpole.errors import ConfigError
from mjcartpole.studies.statistics import CONFIDENCE, Array, checked_scores, resampled

Labels = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Profile:
    """A performance profile: which share of runs scores more than each of some thresholds.

    Attributes:
        thresholds: In the unit of the scores, shape (k,).
        shares: From 0 to 1, shape (k,).
        low: Lower end of the interval of each share.
        high: Upper end.
    """

    thresholds: Array
    shares: Array
    low: Array
    high: Array


def performance_profile(
    scores: npt.ArrayLike,
    thresholds: Sequence[float] | Array,
    *,
    confidence: float = CONFIDENCE,
    resamples: int = 1_000,
    seed: int = 0,
) -> Profile:
    """Return the run-score distribution of Agarwal et al. 2021 (arXiv:2108.13264), section 4.2.

    F(t) is the share of runs with a score above t, as a mean over tasks; its interval is that of
    the stratified bootstrap, for each threshold by itself. Scores, shape (n,) or (n, m), and
    settings are as in `bootstrap_interval`.

    Raises:
        ConfigError: The scores are empty, not finite or of another shape.
    """
    values, at = checked_scores(scores), np.asarray(thresholds, np.float64)
    drawn = resampled(values, times=resamples, seed=seed)
    shares = np.concatenate([_shares_above(samples, at) for (samples,) in drawn])
    tail = (1 - confidence) / 2
    low, high = np.quantile(shares, (tail, 1 - tail), axis=0)
    return Profile(at, shares_above(values, at), low, high)


def shares_above(scores: npt.ArrayLike, thresholds: npt.ArrayLike) -> Array:
    """Return the shares of a `performance_profile`.

    Raises:
        ConfigError: The scores are empty, not finite or of another shape.
    """
    values, at = checked_scores(scores), np.asarray(thresholds, np.float64)
    shares: Array = _shares_above(values[None], at)[0]
    return shares


def _shares_above(samples: Array, thresholds: Array) -> Array:
    """Return shares of scores above each threshold, shape (samples, thresholds)."""
    # Every task has as many runs as the others, so the mean over tasks is that over all.
    pooled = np.sort(samples.reshape(len(samples), -1), axis=1)
    below = np.array([row.searchsorted(thresholds, "right") for row in pooled])
    shares: Array = 1 - below / pooled.shape[1]
    return shares


def variance_shares(
    scores: npt.ArrayLike, factors: Mapping[str, Labels]
) -> dict[tuple[str, ...], float]:
    """Return which share of the scores' variance each factor explains, and each pair beyond both.

    The share of a factor is the variance of its levels' means over that of all scores: eta squared
    of an analysis of variance (Fisher 1925), and an estimate of the first-order index of Sobol
    (1993; Saltelli et al. 2010, doi:10.1016/j.cpc.2009.09.018). That of a pair is what the means of
    its cells explain beyond both. On a full grid with as many runs in each cell the shares, with
    those of more than two factors and of seeds, add up to 1; elsewhere they overlap.

    A factor has the level of each score, counted from 0; both have the shape (n,). Shares go by the
    names of a factor or of a pair, and are all 0 where the scores do not vary.

    Raises:
        ConfigError: The scores are empty or not finite, or labels do not fit them.
    """
    values = checked_scores(scores)
    if any(labels.shape != values.shape for labels in factors.values()):
        raise ConfigError(f"a level is needed for each score, shape {values.shape}")
    # Of equal values, the mean may be another number by a rounding.
    total = float(((values - values.mean()) ** 2).sum()) if np.ptp(values) > 0 else 0.0
    found: dict[tuple[str, ...], float] = {}
    for name, labels in factors.items():
        found[name,] = _between(values, labels, total)
    for one, other in itertools.combinations(factors, 2):
        cells = factors[one] * (factors[other].max() + 1) + factors[other]
        beyond = _between(values, cells, total) - found[one,] - found[other,]
        found[one, other] = max(0.0, beyond)
    return found


def _between(values: Array, labels: Labels, total: float) -> float:
    """Return the sum of squares between groups, over that of all."""
    counts = np.bincount(labels)
    sums = np.bincount(labels, values - values.mean())
    there = counts > 0
    return float((sums[there] ** 2 / counts[there]).sum() / total) if total > 0 else 0.0
