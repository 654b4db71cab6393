"""Fields over two dimensions of the state: a table's slices, basins, paths in the phase plane."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
import numpy.typing as npt

from mjcartpole.media.palette import CURVES, INK, MISSING, PAPER
from mjcartpole.media.plots import css, plot_style, short

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Kind = Literal["action", "advantage", "visits", "steps"]
Floats = npt.NDArray[np.float64]

LEGENDS: Final[dict[Kind, str]] = {
    "action": "greedy action",
    "advantage": "advantage of right: Q(right) - Q(left)",
    "visits": "visits while learning",
    "steps": "steps until the end",
}
"""What a field shows, in words."""

UNITS: Final = {"x": "m", "x_dot": "m/s", "theta": "rad", "theta_dot": "rad/s"}
NEARLY: Final = 0.02
"""A limit that is so near to the end of a table is not drawn."""
_LEFT, _RIGHT = 0.08, 0.95
"""Places of both actions in the map of the advantage: dark and light to every kind of eye."""


@dataclass(frozen=True, eq=False)
class Field:
    """Numbers over a rectangle that is cut into cells.

    Attributes:
        kind: What they are.
        title: Which slice of the state's space it is; empty where there is one only.
        edges: Of the cells: along the horizontal dimension, and along the vertical one.
        values: Shape (vertical cells, horizontal cells); NaN where there is none.
    """

    kind: Kind
    title: str
    edges: tuple[Floats, Floats]
    values: Floats


@dataclass(frozen=True, eq=False)
class Path:
    """One episode in the plane.

    Attributes:
        points: Shape (steps + 1, 2).
        ending: How it ended.
        lasted: Whether it was the time limit that ended it.
    """

    points: Floats
    ending: str
    lasted: bool


@dataclass(frozen=True, eq=False)
class Grid:
    """Fields in rows and columns, over the same two dimensions.

    Attributes:
        title: What a person calls it.
        names: The horizontal dimension, and the vertical one.
        fields: Row by row.
        paths: Episodes that are drawn over the first field.
        limits: Where an episode ends along each of the two dimensions; None along others.
        most: The largest value that the colours are for; None: what is found.
    """

    title: str
    names: tuple[str, str]
    fields: Sequence[Sequence[Field]]
    paths: Sequence[Path] = ()
    limits: tuple[float | None, float | None] = (None, None)
    most: float | None = None
    notes: Sequence[str] = field(default=())

    def rows(self) -> Iterator[Mapping[str, object]]:
        """Yield a row for each cell of each field, then for each point of each path."""
        (a, b), every = self.names, [each for row in self.fields for each in row]
        for each in every:
            across, up = each.edges
            for j, i in np.ndindex(each.values.shape):
                value = float(each.values[j, i])
                yield {
                    "what": each.kind,
                    "slice": each.title,
                    f"{a}_low": float(across[i]),
                    f"{a}_high": float(across[i + 1]),
                    f"{b}_low": float(up[j]),
                    f"{b}_high": float(up[j + 1]),
                    "value": None if math.isnan(value) else value,
                }
        for number, path in enumerate(self.paths, start=1):
            for step, (across_at, up_at) in enumerate(path.points.tolist()):
                yield {"what": "path", "episode": number, "step": step, a: across_at, b: up_at}

    @plot_style()
    def figure(self) -> "Figure":
        """Draw it (RenderError without matplotlib)."""
        from matplotlib.figure import Figure  # noqa: PLC0415 - an optional package

        height, width = len(self.fields), len(self.fields[0])
        size = (1.9 + max(2.3 * width, 4.6), 1.1 + 2.1 * height) if height > 1 else (7.6, 5.2)
        figure = Figure(figsize=size, layout="constrained")
        axes = figure.subplots(height, width, sharex=True, sharey=True, squeeze=False)
        for row, fields in zip(axes, self.fields, strict=True):
            scale = _scale(fields, self.most)
            for ax, each in zip(row, fields, strict=True):
                mesh = _draw(ax, each, scale, 0.45 if self.paths else 1.0)
                self._mark_limits(ax, each)
            _explain(figure, row, fields[0].kind, mesh)
        for ax, each in zip(axes[0], self.fields[0], strict=True):
            ax.set_title(short(each.title), fontsize="medium")
        for number, path in enumerate(self.paths):
            _draw_path(axes[0, 0], path, number)
        if width > 1:
            axes[0, 0].locator_params(axis="x", nbins=3)
        figure.supxlabel(_labelled(self.names[0]), fontsize="medium")
        figure.supylabel(_labelled(self.names[1]), fontsize="medium")
        said = [short(self.title, 60), *self.notes]
        figure.suptitle("\n".join(said), x=0.01, ha="left", fontsize="large")
        return figure

    def _mark_limits(self, axes: "Axes", each: Field) -> None:
        """Draw where episodes end, and let the axes be as long as the field."""
        lines = zip(self.limits, (axes.axvline, axes.axhline), each.edges, strict=True)
        for limit, draw, edges in lines:
            # A table reaches as far as the limit, or a little further: its edge says it.
            if limit is None or abs(limit / edges[-1] - 1) < NEARLY:
                continue
            for side in (-limit, limit):
                draw(side, color=css(INK), linewidth=0.8, linestyle="--")
        if not self.paths:
            axes.set(xlim=each.edges[0][[0, -1]], ylim=each.edges[1][[0, -1]])


def _scale(fields: Sequence[Field], most: float | None) -> Any:  # noqa: ANN401
    """Return colours and what they stand for, for a row of fields of one kind."""
    from matplotlib import colormaps  # noqa: PLC0415 - an optional package
    from matplotlib.colors import ListedColormap, LogNorm, Normalize  # noqa: PLC0415

    kind = fields[0].kind
    found = np.concatenate([each.values.ravel() for each in fields])
    largest = float(np.nanmax(np.abs(found), initial=0.0)) or 1.0
    if kind == "action":
        ends = [colormaps["cividis"](place) for place in (_LEFT, _RIGHT)]
        return ListedColormap(ends), Normalize(0, 1)
    if kind == "advantage":
        return colormaps["cividis"], Normalize(-largest, largest)
    if kind == "visits":
        shades = colormaps["viridis_r"](np.linspace(0.08, 1.0, 256))
        return ListedColormap(shades), LogNorm(1, max(largest, 10))
    return colormaps["viridis"], Normalize(0, most or largest)


def _draw(axes: "Axes", each: Field, scale: Any, alpha: float) -> Any:  # noqa: ANN401
    colours, norm = scale
    axes.set_facecolor(css(PAPER if each.kind == "visits" else MISSING))
    if each.kind == "visits":
        # What is blank was never seen; hatched, it is no colour of the scale.
        axes.patch.set(hatch="////", edgecolor=css(MISSING), linewidth=0)
    masked = np.ma.masked_invalid(each.values)
    if each.kind == "visits":
        masked = np.ma.masked_less(masked, 1)
    mesh = axes.pcolormesh(
        *each.edges, masked, cmap=colours, norm=norm, alpha=alpha, rasterized=True
    )
    axes.grid(visible=False)
    return mesh


def _explain(figure: "Figure", row: Any, kind: Kind, mesh: Any) -> None:  # noqa: ANN401
    bar = figure.colorbar(mesh, ax=list(row), pad=0.02, aspect=14)
    bar.outline.set_visible(False)
    bar.set_label("\n".join(_wrapped(LEGENDS[kind])), fontsize="small")
    if kind == "action":
        bar.set_ticks([0.25, 0.75], labels=["left", "right"])


def _wrapped(text: str) -> list[str]:
    return text.replace(": ", ":|").split("|")


def _draw_path(axes: "Axes", path: Path, number: int) -> None:
    colour = css((INK, CURVES[1], CURVES[0], CURVES[3])[number % 4])
    edge: Any = {"markeredgecolor": css(INK), "color": colour, "zorder": 4}
    axes.plot(*path.points.T, "-", color=colour, linewidth=0.6, zorder=3)
    axes.plot(*path.points[0], "o", markersize=5, **edge)
    axes.plot(*path.points[-1], "s" if path.lasted else "X", markersize=7, **edge)


def _labelled(name: str) -> str:
    """Return a dimension with its unit: theta2_dot is an angular velocity like theta_dot."""
    plain = "".join(letter for letter in name if not letter.isdigit())
    return f"{name}, {UNITS[plain]}" if plain in UNITS else name
