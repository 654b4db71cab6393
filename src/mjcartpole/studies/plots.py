"""Plots of transfers and sweeps: a heat map, and curves."""

from typing import TYPE_CHECKING, Any

import numpy as np

from mjcartpole.learning.naming import added_flags
from mjcartpole.media.palette import MISSING, PAPER
from mjcartpole.media.plots import css, ink_on, legend_below, level, plain, plot_style, short
from mjcartpole.studies.sweep import SweepResult
from mjcartpole.studies.transfer import Cell, TransferResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CELL = 0.96, 0.52
"""Width and height of a cell, inches."""


@plot_style()
def heat_map(result: TransferResult) -> "Figure":
    """Plot every policy (row) on every model (column): colour and number are the mean return.

    Without matplotlib it is a RenderError.
    """
    from matplotlib import colormaps  # noqa: PLC0415 - an optional package
    from matplotlib.figure import Figure  # noqa: PLC0415

    rows, columns = result.means.shape
    figure = Figure(figsize=(CELL[0] * columns, CELL[1] * rows))
    axes = figure.add_axes((0, 0, 1, 1))
    low, high = result.task.return_span
    colours = colormaps["viridis"].with_extremes(bad=css(MISSING))
    image = axes.imshow(result.means, colours, aspect="auto", vmin=low, vmax=high)
    axes.grid(visible=False)
    axes.set_xticks(np.arange(columns + 1) - 0.5, minor=True)
    axes.set_yticks(np.arange(rows + 1) - 0.5, minor=True)
    axes.grid(which="minor", color=css(PAPER), linewidth=2)
    for y, cells in enumerate(result.rows):
        for x, cell in enumerate(cells):
            _letter(axes, (x, y), cell, image.to_rgba(np.array(cell.mean)))
    names = [short(name) for name in result.places]
    axes.set_xticks(range(columns), names, rotation=45, ha="left", rotation_mode="anchor")
    axes.set_yticks(range(rows), [short(name, 34) for name in result.policies])
    axes.tick_params(which="both", length=0, labeltop=True, labelbottom=False)
    axes.spines[:].set_visible(False)
    episodes = max(len(cell.evaluation.episodes) if cell.evaluation else 0 for cell in result.cells)
    axes.set_xlabel(
        f"mean greedy return of {episodes} episodes\nbelow: 95 % interval{_added(result)}"
    )
    return figure


@plot_style()
def curves(result: SweepResult) -> "Figure":
    """Plot the mean return of every policy against the parameter, with 95 % bands.

    Where the simulation diverged there is a gap. Without matplotlib it is a RenderError.
    """
    from matplotlib.figure import Figure  # noqa: PLC0415 - an optional package

    policies = result.played.policies
    figure = Figure(figsize=(8.6, 5 + 0.24 * len(policies)), layout="constrained")
    axes = figure.add_subplot()
    for cells in result.played.rows:
        bands = [cell.interval or (np.nan, np.nan) for cell in cells]
        axes.fill_between(result.values, *np.transpose(bands), alpha=0.2, linewidth=0)
        axes.plot(result.values, [cell.mean for cell in cells], "o-", markersize=5, clip_on=False)
    title = f"mean greedy return on {short(result.model, 50)}{_added(result.played)}"
    axes.set(xlabel=plain(result.key), title=title)
    axes.set_ylim(*result.played.task.return_span)
    axes.margins(x=0)
    if result.threshold is not None:
        level(axes, result.threshold)
    words = [short(name) + _in_words(result, name) for name in policies]
    legend_below(figure, axes.lines[: len(policies)], words)
    return figure


def _added(result: TransferResult) -> str:
    """Return a line for what was added at all places; nothing where nothing was."""
    flags = added_flags(result.disturbances)
    return f"\nwith {short(flags, 60)}" if flags else ""


def _in_words(result: SweepResult, policy: str) -> str:
    if result.threshold is None:
        return ""
    stretch = result.longest(policy)
    return f": holds from {stretch}" if stretch else f": nowhere at {result.threshold:g}"


def _letter(axes: "Axes", place: tuple[int, int], cell: Cell, colour: Any) -> None:  # noqa: ANN401
    """Write a cell's mean and interval, in the ink that is seen on its colour."""
    x, y = place
    style: dict[str, Any] = {"color": ink_on(colour), "ha": "center", "va": "center"}
    if cell.interval is None:
        axes.text(x, y, "failed", **style)
        return
    axes.text(x, y - 0.12, f"{cell.mean:.1f}", fontsize=12, **style)
    axes.text(
        x, y + 0.25, f"{cell.interval.low:.0f} to {cell.interval.high:.0f}", fontsize=8, **style
    )
