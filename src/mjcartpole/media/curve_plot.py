"""Learning curves: the return by episode, of one run or as a band over many seeds."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from mjcartpole.media.palette import PAPER
from mjcartpole.media.plots import css, legend_below, level, plot_style, short

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_POINTS: Final = 400
"""Of a line: more than there are pixels to tell apart."""
MOST_RAW: Final = 2_000
"""Returns that are drawn one by one; of more, the least and the largest in equal stretches."""
MOST_WITH_RAW: Final = 2
"""Lines that have their raw returns behind them; with more, nothing could be told apart."""
_DASHES: Final = ("-", "--", ":", "-.")

Floats = npt.NDArray[np.float64]
Ends = tuple[float, float]


@dataclass(frozen=True, eq=False)
class Line:
    """The curve of one run, or of many seeds.

    Attributes:
        name: What a person calls it.
        episodes: After how many episodes, shape (k,).
        middle: The running mean of the returns there; of many seeds their average.
        seeds: How many seeds these are, shape (k,).
        interval: Lower and upper end of what the average may be; None of one run.
        raw: Episodes, and the least and the largest return since the ones before; None of many.
        greedy: Training episodes before greedy evaluations, and the mean return of each.
    """

    name: str
    episodes: npt.NDArray[np.int64]
    middle: Floats
    seeds: npt.NDArray[np.int64]
    interval: tuple[Floats, Floats] | None = None
    raw: tuple[npt.NDArray[np.int64], Floats, Floats] | None = None
    greedy: tuple[npt.NDArray[np.int64], Floats] | None = None


@dataclass(frozen=True, eq=False)
class Curves:
    """Learning curves on one pair of axes.

    Attributes:
        lines: Each.
        window: Episodes of the running mean.
        span: What returns lie between, where that is known.
        solved_at: A return to mark; None where nothing is agreed.
        of: Of what the band is the interval, in words.
    """

    lines: Sequence[Line]
    window: int
    span: tuple[float | None, float | None] = (None, None)
    solved_at: float | None = None
    of: str = "mean"

    @property
    def shown(self) -> list[Line]:
        """The lines, with raw returns where these can be told apart."""
        few = sum(line.raw is not None for line in self.lines) <= MOST_WITH_RAW
        lines = ({**vars(line), "raw": line.raw if few else None} for line in self.lines)
        return [Line(**fields) for fields in lines]

    def rows(self) -> Iterator[Mapping[str, object]]:
        """Yield a row for each point of each line."""
        for line in self.shown:
            if line.raw is not None:
                for episode, low, high in zip(*line.raw, strict=True):
                    yield _row(line, "raw", episode, None, 1, (low, high))
            ends = np.transpose(line.interval) if line.interval else [None] * len(line.middle)
            points = zip(line.episodes, line.middle, line.seeds, ends, strict=True)
            for episode, middle, seeds, pair in points:
                yield _row(line, "smoothed", episode, middle, seeds, pair)
            for episode, mean in zip(*line.greedy, strict=True) if line.greedy else ():
                yield _row(line, "greedy", episode, mean, line.seeds.max(), None)

    @plot_style()
    def figure(self) -> "Figure":
        """Draw them (RenderError without matplotlib)."""
        from matplotlib.figure import Figure  # noqa: PLC0415 - an optional package

        figure = Figure(figsize=(8.6, 5 + 0.24 * len(self.lines)), layout="constrained")
        axes = figure.add_subplot()
        drawn = [self._draw(axes, line, number) for number, line in enumerate(self.shown)]
        axes.set(xlabel="episode", title=self._title())
        low, high = self.span
        axes.set_ylim(low, None if high is None else 1.02 * high)
        axes.set_xlim(1, max(2, *(int(line.episodes[-1]) for line in self.lines)))
        axes.xaxis.set_major_formatter("{x:,.0f}")
        if self.solved_at is not None:
            level(axes, self.solved_at)
        legend_below(figure, drawn, [short(x.name, 60) + _in_words(x) for x in self.lines])
        return figure

    def _title(self) -> str:
        band = f"; {self.of} and its 95 % interval" if any(x.interval for x in self.lines) else ""
        over = f", over {self.window:,} episodes" if self.window > 1 else ""
        return f"return while learning{over}{band}"

    def _draw(self, axes: "Axes", line: Line, number: int) -> Any:  # noqa: ANN401
        # Dashes first: in print without colours they are what tells lines apart.
        dashes = _DASHES[number % len(_DASHES)]
        if line.raw is not None:
            self._draw_raw(axes, line.raw, f"C{number}")
        if line.interval is not None:
            axes.fill_between(
                line.episodes, *line.interval, color=f"C{number}", alpha=0.2, linewidth=0
            )
        dashes = "o" if len(line.episodes) == 1 else dashes
        (drawn,) = axes.plot(line.episodes, line.middle, dashes, color=f"C{number}", zorder=3)
        if line.greedy is not None:
            style: Any = {"markerfacecolor": css(PAPER), "color": f"C{number}", "clip_on": False}
            mark = _MARKS[number % len(_MARKS)]
            axes.plot(*line.greedy, mark, markersize=5, zorder=4, **style)
        return drawn

    def _draw_raw(self, axes: "Axes", raw: Any, colour: str) -> None:  # noqa: ANN401
        episodes, low, high = raw
        if (low == high).all():
            axes.plot(episodes, low, color=colour, alpha=0.35, linewidth=0.6)
        else:
            axes.fill_between(episodes, low, high, color=colour, alpha=0.15, linewidth=0)


_MARKS: Final = ("o", "s", "^", "D")


def running_mean(returns: Floats, window: int) -> Floats:
    """Return the mean of the last `window` values, from the first place that has so many."""
    sums = np.cumsum(np.concatenate([[0.0], returns]))
    means: Floats = (sums[window:] - sums[:-window]) / window
    return means


def places(n: int, first: int, most: int = MOST_POINTS) -> npt.NDArray[np.int64]:
    """Return at most so many whole numbers from `first` to `n`, evenly spaced, both included."""
    return np.unique(np.linspace(first, n, min(most, n - first + 1)).round().astype(np.int64))


def line_of_run(
    name: str, returns: Floats, window: int, greedy: Sequence[tuple[int, float]] = ()
) -> Line:
    """Return the curve of one run with an episode at least.

    The running mean is over a window of no more episodes than there are. `greedy` has training
    episodes before an evaluation, and its mean return.
    """
    at = places(len(returns), window)
    middle = running_mean(returns, window)[at - window]
    return Line(
        name, at, middle, np.ones(len(at), np.int64), None, _raw(returns), greedy_points(greedy)
    )


def curve_of(
    name: str,
    returns: Floats,
    greedy: Sequence[tuple[int, float]],
    span: tuple[float | None, float | None],
    solved_at: float | None,
) -> Curves:
    """Return the curve of one run as a whole plot; see `line_of_run` and `Curves`."""
    window = usual_window(len(returns))
    return Curves([line_of_run(name, returns, window, greedy)], window, span, solved_at)


def usual_window(episodes: int) -> int:
    """Return over how many episodes means run, of so many: a fortieth."""
    return max(1, round(episodes / 40))


def greedy_points(
    greedy: Sequence[tuple[int, float]],
) -> tuple[npt.NDArray[np.int64], Floats] | None:
    """Return episodes and means of evaluations; None where there were none."""
    if not greedy:
        return None
    episodes, means = zip(*greedy, strict=True)
    return np.array(episodes, np.int64), np.array(means, np.float64)


def _raw(returns: Floats) -> tuple[npt.NDArray[np.int64], Floats, Floats]:
    ends = places(len(returns), 1, MOST_RAW)
    starts = np.concatenate([[0], ends[:-1]])
    return ends, np.minimum.reduceat(returns, starts), np.maximum.reduceat(returns, starts)


def _row(
    line: Line, kind: str, episode: int, value: float | None, seeds: int, ends: Ends | None
) -> dict[str, object]:
    low, high = (None, None) if ends is None else map(float, ends)
    return {
        "run": line.name,
        "what": kind,
        "episode": int(episode),
        "return": None if value is None else float(value),
        "low": low,
        "high": high,
        "seeds": int(seeds),
    }


def _in_words(line: Line) -> str:
    least, most = int(line.seeds.min()), int(line.seeds.max())
    count = f"{least:,} to {most:,}" if least < most else f"{most:,}"
    seeds = f" ({count} seeds)" if most > 1 else ""
    return seeds + ("; marks: greedy evaluations" if line.greedy is not None else "")
