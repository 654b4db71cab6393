"""How episodes end: along a training, and those of the greedy policy after it."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from mjcartpole.media.palette import INK
from mjcartpole.media.plots import css, plot_style, short

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Endings:
    """Shares of endings of one run, or of many seeds together.

    Attributes:
        name: What a person calls it.
        episodes: The last episode of each stretch of the training, shape (k,).
        shares: Of each ending in each stretch, shape (endings, k).
        greedy: Of each ending of the greedy policy, shape (endings,).
    """

    name: str
    episodes: npt.NDArray[np.int64]
    shares: Floats
    greedy: Floats


@dataclass(frozen=True, eq=False)
class EndingsPlot:
    """Endings of runs, one above the other.

    Attributes:
        runs: Each.
        looks: Number and name of each ending, in the order of their shares; the number says how
            it looks: the same in every plot.
    """

    runs: Sequence[Endings]
    looks: Sequence[tuple[int, str]]

    def rows(self) -> Iterator[Mapping[str, object]]:
        """Yield a row for each stretch of each training, and one for each greedy policy."""
        names = [name for _, name in self.looks]
        for run in self.runs:
            for episode, shares in zip(run.episodes.tolist(), run.shares.T.tolist(), strict=True):
                named = dict(zip(names, shares, strict=True))
                yield {"run": run.name, "what": "training", "episode": episode, **named}
            named = dict(zip(names, run.greedy.tolist(), strict=True))
            yield {"run": run.name, "what": "greedy", **named}

    @plot_style()
    def figure(self) -> "Figure":
        """Draw them (RenderError without matplotlib)."""
        from matplotlib.figure import Figure  # noqa: PLC0415 - an optional package

        n = len(self.runs)
        figure = Figure(figsize=(8.6, 1.5 + 2.3 * n), layout="constrained")
        axes = figure.subplots(n, 2, squeeze=False, width_ratios=(9, 1), sharey=True)
        for (left, right), run in zip(axes, self.runs, strict=True):
            self._draw_training(left, run)
            self._draw_greedy(right, run)
        axes[-1, 0].set_xlabel("episode")
        figure.legend(
            axes[0, 0].collections[::-1],
            [name for _, name in self.looks[::-1]],
            loc="outside right upper",
        )
        return figure

    def _draw_training(self, axes: "Axes", run: Endings) -> None:
        edges = np.concatenate([[0], run.episodes])
        tops = np.cumsum(run.shares, axis=0)
        for (number, _), top, share in zip(self.looks, tops, run.shares, strict=True):
            ends = np.append(top - share, (top - share)[-1]), np.append(top, top[-1])
            axes.fill_between(edges, *ends, step="post", **_look(number))
        axes.set_title(short(run.name, 60), fontsize="medium")
        axes.set(xlim=(0, edges[-1]), ylim=(0, 1))
        axes.xaxis.set_major_formatter("{x:,.0f}")
        axes.yaxis.set_major_formatter(lambda share, _: f"{share:.0%}")
        axes.grid(visible=False)

    def _draw_greedy(self, axes: "Axes", run: Endings) -> None:
        axes.set_title("greedy", fontsize="medium")
        axes.set_xticks([])
        axes.grid(visible=False)
        tops = np.cumsum(run.greedy)
        for (number, _), top, share in zip(self.looks, tops, run.greedy, strict=True):
            axes.bar(0, share, 1, top - share, **_look(number))


LOOKS: Final = (
    *(((230, 159, 0), ""), ((214, 134, 0), ""), ((252, 214, 128), "")),
    *(((213, 94, 0), "//"), ((178, 62, 0), "\\\\"), ((240, 150, 84), "//")),
    ((0, 90, 150), ""),
)
"""Colour and hatch of a fall, of a cart off the track (with no side, left, right each), and of the
time limit: in grey they are told apart by lightness, and by hatches."""


def _look(number: int) -> dict[str, Any]:
    colour, hatch = LOOKS[min(number, len(LOOKS) - 1)]
    return {"facecolor": css(colour), "edgecolor": css(INK), "hatch": hatch, "linewidth": 0.3}


def stretches(n: int, most: int) -> npt.NDArray[np.int64]:
    """Return the ends of at most so many equal stretches of n episodes."""
    return np.unique(np.linspace(0, n, min(n, most) + 1).round().astype(np.int64))[1:]
