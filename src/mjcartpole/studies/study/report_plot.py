"""A report as a plot: averages by level, and performance profiles beside them."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from mjcartpole.media.plots import plot_style, short
from mjcartpole.studies.profiles import Profile, performance_profile
from mjcartpole.studies.statistics import iqm
from mjcartpole.studies.study.report import OfMeasure, interval_of
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
    """The first measure of a study, a row of plots for each factor.

    Attributes:
        results: What the study has come to.
    """

    results: Results

    @property
    def measure(self) -> str:
        """What is drawn."""
        return self.results.study.measure[0]

    def averages(self, levels: Levels) -> Iterator[tuple[str, float, float, float]]:
        """Yield each level's name, IQM and interval."""
        of = OfMeasure(self.results, self.measure)
        for place, name in enumerate(levels.names[:MOST_LEVELS]):
            scores = of.of_level(levels, place)
            yield (name, iqm(scores), *interval_of(scores))

    def profile(self, levels: Levels, place: int) -> Profile:
        """Return the performance profile of a level: of its scores, whichever are better."""
        of = OfMeasure(self.results, self.measure)
        at = np.linspace(of.scores.min(), of.scores.max(), _POINTS)
        return performance_profile(of.of_level(levels, place), at, resamples=_RESAMPLES)

    def rows(self) -> Iterator[Mapping[str, object]]:
        """Yield exactly what is drawn, as the lines of a table."""
        for levels in self.results.levels:
            for name, middle, low, high in self.averages(levels):
                about = {"factor": levels.name, "level": name}
                yield {
                    **about,
                    "what": "iqm",
                    "at": None,
                    "value": middle,
                    "low": low,
                    "high": high,
                }
            for place, name in enumerate(levels.names[:MOST_LEVELS]):
                found = self.profile(levels, place)
                columns = (found.thresholds, found.shares, found.low, found.high)
                for at, share, low, high in np.transpose(columns).tolist():
                    about = {"factor": levels.name, "level": name, "what": "profile"}
                    yield {**about, "at": at, "value": share, "low": low, "high": high}

    @plot_style()
    def figure(self) -> "Figure":
        """Draw it.

        Raises:
            RenderError: matplotlib is not installed.
        """
        from matplotlib.figure import Figure  # noqa: PLC0415 - an optional package

        rows = len(self.results.levels)
        figure = Figure(figsize=(10, 0.6 + 3.2 * rows), layout="constrained")
        for pair, levels in zip(
            figure.subplots(rows, 2, squeeze=False), self.results.levels, strict=True
        ):
            self._draw_averages(pair[0], levels)
            self._draw_profiles(pair[1], levels)
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
            axes.plot(found.thresholds, found.shares, color=f"C{place}", label=short(name, 24))
            axes.fill_between(
                found.thresholds, found.low, found.high, color=f"C{place}", alpha=0.15, linewidth=0
            )
        axes.set(title="share of runs above", xlabel=self.measure, ylim=(0, 1.02))
        axes.legend(title=short(levels.name))
