"""A report as a plot: averages by level, profiles beside them, and the pair that interacts most."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from mjcartpole.media.palette import CURVES
from mjcartpole.media.plots import plot_style, short
from mjcartpole.studies.profiles import Profile, performance_profile
from mjcartpole.studies.statistics import iqm
from mjcartpole.studies.study.report import OfMeasure, interval_of, runs_at
from mjcartpole.studies.study.results import Levels, Results

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_LEVELS: Final = 12
"""Lines that can be told apart, and more besides."""
_POINTS: Final = 101
_RESAMPLES: Final = 200


@dataclass(frozen=True, eq=False)
class ReportPlot:
    """The first measure of a study: a row of plots for each factor, and one for a pair of them.

    Attributes:
        results: What the study has come to.
    """

    results: Results

    @property
    def measure(self) -> str:
        """What is drawn."""
        return self.results.study.measure[0]

    @property
    def of(self) -> OfMeasure:
        """Its scores."""
        return OfMeasure(self.results, self.measure)

    def pair(self) -> tuple[Levels, Levels] | None:
        """Return the pair that explains most beyond both, the one that is best drawn along last."""
        by_name = {each.name: each for each in self.results.levels}
        shares = {names: share for names, share in self.of.shares().items() if names[1:]}
        if not shares:
            return None
        one, other = (by_name[name] for name in max(shares, key=lambda names: shares[names]))
        return (one, other) if _is_number(other) or not _is_number(one) else (other, one)

    def cells(
        self, one: Levels, place: int, other: Levels
    ) -> Iterator[tuple[int, float, float, float]]:
        """Yield IQM and interval of a level with each level of another factor that it met."""
        of = self.of
        for column in range(len(other.names)):
            chosen = runs_at((one, place), (other, column))
            if chosen.size:
                scores = of.of_runs(chosen)
                yield (column, iqm(scores), *interval_of(scores))

    def averages(self, levels: Levels) -> Iterator[tuple[str, float, float, float]]:
        """Yield each level's name, IQM and interval."""
        of = self.of
        for place, name in enumerate(levels.names[:MOST_LEVELS]):
            scores = of.of_level(levels, place)
            yield (name, iqm(scores), *interval_of(scores))

    def profile(self, levels: Levels, place: int) -> Profile:
        """Return the performance profile of a level: of its scores, whichever are better."""
        of = self.of
        at = np.linspace(of.scores.min(), of.scores.max(), _POINTS)
        return performance_profile(of.of_level(levels, place), at, resamples=_RESAMPLES)

    def rows(self) -> Iterator[Mapping[str, object]]:
        """Yield exactly what is drawn, as the lines of a table."""
        for levels in self.results.levels:
            for name, middle, low, high in self.averages(levels):
                about = {"factor": levels.name, "level": name, "what": "iqm"}
                yield {**about, "at": None, "value": middle, "low": low, "high": high}
            for place, name in enumerate(levels.names[:MOST_LEVELS]):
                found = self.profile(levels, place)
                columns = (found.thresholds, found.shares, found.low, found.high)
                for at, share, low, high in np.transpose(columns).tolist():
                    about = {"factor": levels.name, "level": name, "what": "profile"}
                    yield {**about, "at": at, "value": share, "low": low, "high": high}
        if pair := self.pair():
            yield from self._pair_rows(*pair)

    def _pair_rows(self, one: Levels, other: Levels) -> Iterator[Mapping[str, object]]:
        for place, name in enumerate(one.names[:MOST_LEVELS]):
            about = {"factor": one.name, "level": name, "what": f"iqm by {other.name}"}
            for column, middle, low, high in self.cells(one, place, other):
                at = other.names[column]
                yield {**about, "at": at, "value": middle, "low": low, "high": high}

    @plot_style()
    def figure(self) -> "Figure":
        """Draw it (RenderError without matplotlib)."""
        from matplotlib.figure import Figure  # noqa: PLC0415 - an optional package

        pair, factors = self.pair(), self.results.levels
        rows = len(factors) + (pair is not None)
        figure = Figure(figsize=(10, 0.6 + 3.2 * rows), layout="constrained")
        grid = figure.add_gridspec(rows, 2)
        for row, levels in enumerate(factors):
            self._draw_averages(figure.add_subplot(grid[row, 0]), levels)
            self._draw_profiles(figure.add_subplot(grid[row, 1]), levels)
        if pair:
            self._draw_pair(figure.add_subplot(grid[-1, :]), *pair)
        return figure

    def _draw_averages(self, axes: "Axes", levels: Levels) -> None:
        names, middle, low, high = zip(*self.averages(levels), strict=True)
        for place, ends in enumerate(zip(middle, low, high, strict=True)):
            axes.plot(ends[1:], [place] * 2, color=f"C{place}", linewidth=6, alpha=0.35)
            axes.plot(ends[0], place, "o", color=f"C{place}")
        axes.set_yticks(range(len(names)), [short(name, 24) for name in names])
        axes.set_ylim(len(names) - 0.5, -0.5)
        left_out = f" (the first {MOST_LEVELS})" if len(levels.names) > MOST_LEVELS else ""
        title = f"{short(levels.name)}{left_out}: IQM and its 95 % interval"
        axes.set(title=title, xlabel=self.measure)

    def _draw_profiles(self, axes: "Axes", levels: Levels) -> None:
        for place, name in enumerate(levels.names[:MOST_LEVELS]):
            found = self.profile(levels, place)
            axes.plot(found.thresholds, found.shares, **_look(place, name))
            axes.fill_between(
                found.thresholds, found.low, found.high, color=f"C{place}", alpha=0.15, linewidth=0
            )
        axes.set(title="share of runs above", xlabel=self.measure, ylim=(0, 1.02))
        _legend(axes, levels)

    def _draw_pair(self, axes: "Axes", one: Levels, other: Levels) -> None:
        # The intervals of more lines than there are colours hide each other.
        told = len(one.names) <= len(CURVES)
        for place, name in enumerate(one.names[:MOST_LEVELS]):
            at, middle, low, high = zip(*self.cells(one, place, other), strict=True)
            axes.plot(at, middle, marker="o", **_look(place, name))
            if told:
                axes.fill_between(at, low, high, color=f"C{place}", alpha=0.1, linewidth=0)
        axes.set_xticks(range(len(other.names)), [short(name, 24) for name in other.names])
        title = f"{short(one.name)} and {short(other.name)}: IQM"
        title += " and its 95 % interval" if told else ""
        axes.set(title=title, xlabel=short(other.name), ylabel=self.measure)
        _legend(axes, one)


def _look(place: int, name: str) -> dict[str, Any]:
    style = "-" if place < len(CURVES) else "--"
    return {"linestyle": style, "color": f"C{place}", "label": short(name, 24)}


def _legend(axes: "Axes", levels: Levels) -> None:
    axes.legend(title=short(levels.name), loc="center left", bbox_to_anchor=(1, 0.5))


def _is_number(levels: Levels) -> bool:
    return all(re.fullmatch(r"-?[\d.]+(e-?\d+)?", name) for name in levels.names)
