"""What a study says: each factor and pair of factors, the best points, the worst seeds.

Averages are interquartile means with bootstrap intervals, after Agarwal et al. 2021
(arXiv:2108.13264). On a full grid the points of a level are its tasks, and seeds its runs;
elsewhere all runs of a level are pooled.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from mjcartpole.studies.profiles import shares_above, variance_shares
from mjcartpole.studies.statistics import (
    Array,
    Interval,
    bootstrap_interval,
    improvement_interval,
    iqm,
    probability_of_improvement,
)
from mjcartpole.studies.study.measures import MEASURES
from mjcartpole.studies.study.results import Levels, Results

RESAMPLES: Final = 2_000
_MOST_DRAWN: Final = 4_000_000
"""Scores that are drawn for an interval: a second's work."""
_LEAST_RESAMPLES: Final = 200
BEST: Final = 10
WORST: Final = 5
MOST_CELLS: Final = 64
"""Of a pair of factors that has a table."""
THRESHOLDS: Final = 5
_ROUNDING: Final = 1e-9
"""A share of variance that is none."""

Labels = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Table:
    """A table of a report, as text.

    Attributes:
        title: What it shows.
        columns: Their names.
        rows: A cell for each column.
        note: What is to be said of it.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""


@dataclass(frozen=True)
class Section:
    """What a study says of one measure.

    Attributes:
        measure: Its name.
        sentence: All of it in one.
        tables: In order.
    """

    measure: str
    sentence: str
    tables: tuple[Table, ...]


def sections(results: Results, baseline: dict[str, str]) -> list[Section]:
    """Return what a study says of each measure; levels are held against those of the base line."""
    return [_section(results, measure, baseline) for measure in results.study.measure]


def _section(results: Results, measure: str, baseline: dict[str, str]) -> Section:
    of = OfMeasure(results, measure)
    points, shares = of.points(), of.shares()
    tables = [_best(of, points)]
    for levels in results.levels:
        tables += [_factor(of, levels, baseline[levels.name]), _profile(of, levels)]
    for one, other in itertools.combinations(results.levels, 2):
        if len(one.names) * len(other.names) <= MOST_CELLS:
            tables.append(_pair(of, one, other))
    tables += [_sensitivity(of, shares), *_worst(of)]
    return Section(measure, _sentence(of, points, shares), tuple(tables))


@dataclass(frozen=True, eq=False)
class OfMeasure:
    """Results of one measure, as scores of which more are better."""

    results: Results
    measure: str

    @property
    def scores(self) -> Array:
        """Each run's figure."""
        return np.asarray(self.results.scores[self.measure])

    @property
    def solved(self) -> npt.NDArray[np.bool_]:
        """Whether each run came to it."""
        return np.asarray(self.results.solved[self.measure])

    @property
    def sign(self) -> int:
        """1 where more is better, else -1."""
        return 1 if MEASURES[self.measure].more_is_better else -1

    def of_level(self, levels: Levels, level: int) -> Array:
        """Return the scores of a level: a column for each point on a full grid, else pooled."""
        return self.of_runs(runs_at((levels, level)))

    def of_runs(self, chosen: Labels) -> Array:
        """Return the scores of some runs, likewise."""
        scores: Array = self.scores[chosen]
        points = self.results.points[chosen]
        numbers, counts = np.unique(points, return_counts=True)
        # A task with a single run would leave the bootstrap nothing to draw.
        if self.results.study.design != "grid" or (counts != max(2, counts[0])).any():
            return scores
        order = np.argsort(points, kind="stable")
        by_point: Array = scores[order].reshape(len(numbers), -1).T
        return by_point

    def points(self) -> list[Labels]:
        """Return the runs of each point, the best first."""
        numbers = self.results.points
        return sorted(
            (np.flatnonzero(numbers == each) for each in np.unique(numbers)), key=self.rank
        )

    def rank(self, runs: Labels) -> tuple[float, float]:
        """Return what is less of better runs; equal averages differ in what they leave out."""
        scores = -self.sign * self.scores[runs]
        return iqm(scores), float(scores.mean())

    def shares(self) -> dict[tuple[str, ...], float]:
        """Return the share of variance of each factor and pair."""
        return variance_shares(
            self.scores, {each.name: each.labels for each in self.results.levels}
        )

    def by_chance(self, names: Sequence[str]) -> float:
        """Return which share of variance a factor, or a pair, explains that has no effect."""
        free = [len(each.names) - 1 for each in self.results.levels if each.name in names]
        return math.prod(free) / max(1, self.scores.size - 1)

    def together(self, shares: dict[tuple[str, ...], float]) -> tuple[float, float] | None:
        """Return which share more than two factors explain, and by chance; None if none can."""
        numbers, labels = np.unique(self.results.points, return_inverse=True)
        full = math.prod(len(each.names) for each in self.results.levels) == len(numbers)
        if len(self.results.levels) < 3 or not full or len(numbers) == self.scores.size:
            return None
        all_of_it = variance_shares(self.scores, {"point": labels})["point",]
        chance = (len(numbers) - 1) / (self.scores.size - 1)
        fewer = sum(shares.values()), sum(map(self.by_chance, shares))
        return max(0.0, all_of_it - fewer[0]), chance - fewer[1]


def interval_of(scores: Array) -> Interval:
    """Return the 95 % interval of the interquartile mean of scores; of equal ones no width."""
    if (scores == scores.flat[0]).all():
        return Interval(float(scores.flat[0]), float(scores.flat[0]))
    return bootstrap_interval(scores, resamples=_resamples(scores.size))


def runs_at(*levels: tuple[Levels, int]) -> Labels:
    """Return which runs have a level of each of these factors."""
    return np.flatnonzero(np.all([each.labels == level for each, level in levels], axis=0))


def _resamples(size: int) -> int:
    return max(_LEAST_RESAMPLES, min(RESAMPLES, _MOST_DRAWN // size))


def _best(of: OfMeasure, points: Sequence[Labels]) -> Table:
    rows = [(of.results.words[runs[0]], *_of_runs(of, runs)) for runs in points[:BEST]]
    note = f"The best {len(rows)} of {len(points)} points."
    return Table("points", ("point", *_columns(of)), tuple(rows), note)


def _columns(of: OfMeasure) -> tuple[str, ...]:
    return ("runs", "IQM", "95 %", "worst", *([] if of.solved.all() else ["solved"]))


def _of_runs(of: OfMeasure, chosen: Labels) -> tuple[str, ...]:
    """Return what is told of some runs, for `_columns`."""
    scores = of.of_runs(chosen)
    worst = _number(of.sign * float((of.sign * scores).min()))
    solved = () if of.solved.all() else (f"{of.solved[chosen].mean():.0%}",)
    return (str(scores.size), *_average(scores), worst, *solved)


def _factor(of: OfMeasure, levels: Levels, base: str) -> Table:
    """Return the averages of a factor's levels, and how likely each is better than the base."""
    against = of.of_level(levels, levels.names.index(base))
    rows = []
    for place, name in enumerate(levels.names):
        scores = of.of_level(levels, place)
        better = ("", "") if name == base else _improvement(of.sign * scores, of.sign * against)
        rows.append((name, *_of_runs(of, runs_at((levels, place))), *better))
    columns = (levels.name, *_columns(of), f"P(better than {base})", "95 % of P")
    return Table(levels.name, columns, tuple(rows), _unsolved(of))


def _improvement(x: Array, y: Array) -> tuple[str, str]:
    if x.shape[1:] != y.shape[1:]:
        x, y = x.ravel(), y.ravel()
    times = max(_LEAST_RESAMPLES, min(RESAMPLES, _MOST_DRAWN // (100 * (x.size + y.size))))
    low, high = improvement_interval(x, y, resamples=times)
    return f"{probability_of_improvement(x, y):.2f}", f"{low:.2f} to {high:.2f}"


def _profile(of: OfMeasure, levels: Levels) -> Table:
    """Return which share of a level's runs is better than each of some values."""
    ends = float(of.scores.min()), float(of.scores.max())
    at = np.unique(np.linspace(*ends, THRESHOLDS + 2)[1:-1])
    rows = []
    for place, name in enumerate(levels.names):
        scores = of.sign * of.of_level(levels, place)
        shares = shares_above(scores, of.sign * at)
        rows.append((name, *(f"{share:.0%}" for share in shares)))
    beyond = "more" if of.sign > 0 else "less"
    columns = (levels.name, *(f"{beyond} than {_number(value, 4)}" for value in at))
    return Table(f"{levels.name}: performance profile", columns, tuple(rows))


def _pair(of: OfMeasure, one: Levels, other: Levels) -> Table:
    rows = []
    for place, name in enumerate(one.names):
        cells = []
        for column in range(len(other.names)):
            chosen = runs_at((one, place), (other, column))
            cells.append(_cell(of.of_runs(chosen)) if chosen.size else "")
        rows.append((name, *cells))
    columns = (f"{one.name} \\ {other.name}", *other.names)
    return Table(f"{one.name} and {other.name}: IQM", columns, tuple(rows))


def _cell(scores: Array) -> str:
    middle, interval = _average(scores, digits=4)
    return f"{middle} ({interval})" if interval else middle


def _sensitivity(of: OfMeasure, shares: dict[tuple[str, ...], float]) -> Table:
    rows: list[tuple[str, ...]] = [
        (" and ".join(names), f"{share:.1%}", f"{of.by_chance(names):.1%}")
        for names, share in sorted(shares.items(), key=lambda item: -item[1])
    ]
    rest = 1 - sum(shares.values()) if np.ptp(of.scores) > 0 else 0.0
    if together := of.together(shares):
        rest -= together[0]
        rows.append(("more than two together", *(f"{share:.1%}" for share in together)))
    rows.append(("seeds and the rest", f"{max(0.0, rest):.1%}", ""))
    note = (
        "A pair's share is what both explain together beyond each; by chance: of no effect at all."
    )
    return Table("sensitivity", ("factor", "share of variance", "by chance"), tuple(rows), note)


def _worst(of: OfMeasure) -> list[Table]:
    """Return the worst runs, and the worst seeds over all points."""
    order = np.argsort(of.sign * of.scores, kind="stable")[:WORST]
    seeds = np.array(of.results.seeds, dtype=object)
    rows = [(str(seeds[run]), of.results.words[run], _number(of.scores[run])) for run in order]
    alike = of.scores == of.scores[order[-1]]
    more = np.count_nonzero(alike) - np.count_nonzero(alike[order])
    note = f"As bad as the last of these: {more} more." if more else ""
    means = {seed: float(of.scores[seeds == seed].mean()) for seed in dict.fromkeys(seeds)}
    ranked = sorted(means, key=lambda seed: of.sign * means[seed])[:WORST]
    return [
        Table("worst runs", ("seed", "point", of.measure), tuple(rows), note),
        Table(
            "worst seeds",
            ("seed", f"mean {of.measure} over all points"),
            tuple((str(seed), _number(means[seed])) for seed in ranked),
        ),
    ]


def _number(value: float, digits: int = 5) -> str:
    """Return a number as a person reads it.

    >>> _number(269.3333), _number(12000), _number(0.00123456), _number(2.5, digits=1)
    ('269.33', '12,000', '0.0012346', '2')
    """
    return f"{value:,.0f}" if abs(value) >= 10_000 else f"{value:.{digits}g}"


def _average(scores: Array, digits: int = 5) -> tuple[str, str]:
    """Return an average, and its interval; of a single run there is none."""
    low, high = (_number(end, digits) for end in interval_of(scores))
    return _number(iqm(scores), digits), f"{low} to {high}" if scores.size > 1 else ""


def _unsolved(of: OfMeasure) -> str:
    solved = of.solved
    if solved.all():
        return ""
    return (
        f"{np.count_nonzero(~solved)} of {solved.size} runs never came to it, and count as all "
        "that they spent: a lower bound."
    )


def _sentence(of: OfMeasure, points: Sequence[Labels], shares: dict[tuple[str, ...], float]) -> str:
    best = points[0]
    middle, interval = _average(of.scores[best])
    trust = f"95 % {interval}, {len(best)} runs" if interval else "1 run"
    alike = sum(of.rank(runs) == of.rank(best) for runs in points[1:])
    said = (
        f"Best by {of.measure} is {of.results.words[best[0]]}"
        + (f" (and {alike} of {len(points)} points that are as good)" if alike else "")
        + f": IQM {middle} ({trust})"
    )
    names, share = max(shares.items(), key=lambda item: item[1])
    if share < of.by_chance(names) + _ROUNDING:
        return f"{said}; no factor explains more of the variance than chance would."
    what = f"the interaction of {' and '.join(names)}" if names[1:] else names[0]
    return f"{said}; {what} explains most: {share:.0%} of the variance."
