"""Slices of a table: what it says over two dimensions of the state, the others held."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from mjcartpole.errors import ConfigError, check_known
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.many_states import actions_in, homes_in, values_in
from mjcartpole.media.grid_plot import Field, Grid, Kind
from mjcartpole.rules import FARTHEST
from mjcartpole.task import N_ACTIONS, state_names

Floats = npt.NDArray[np.float64]

SHOWN: Final = ("action", "advantage", "visits")
MOST_COLUMNS: Final = 5
"""Slices side by side."""
_FINE: Final = 120
"""Cells along a dimension between whose nodes is interpolated, at the least."""


@dataclass(frozen=True)
class Axes:
    """Which dimensions of a state are shown.

    Attributes:
        dims: Indices of the horizontal and the vertical one.
        over: Index of the one that differs from slice to slice; None: there is one slice.
        held: Value of each dimension that is neither.
    """

    dims: tuple[int, int]
    over: int | None
    held: tuple[float, ...]


def names_of(grid: Discretizer) -> tuple[str, ...]:
    """Return what the dimensions of a table are called.

    Raises:
        ConfigError: It is for no cart-pole's observations.
    """
    n = len(grid.bins) - grid.actions
    if n < 4 or n % 2:
        raise ConfigError(f"a policy for observations of {n} values is for no cart-pole")
    actions = (f"action_{number}_before" for number in range(1, grid.actions + 1))
    return *state_names(n // 2 - 1), *actions


def check_of_state(grid: Discretizer, names: Iterable[str]) -> None:
    """Refuse dimensions of a table that are none of a state (ConfigError)."""
    known = names_of(grid)
    for name in names:
        check_known("dimension of a state", name, known[: len(known) - grid.actions])


def choose_axes(
    grid: Discretizer,
    dims: Sequence[str] = (),
    over: str | None = None,
    at: Mapping[str, float] | None = None,
) -> Axes:
    """Return which dimensions of a table are shown; what is left out is chosen.

    `dims` are the horizontal and the vertical one, angle and angular velocity if left out; `over`
    is the one that differs from slice to slice, or "none". Others are held `at` a value: if left
    out at 0, or in the middle of their range; an action before at 1.

    Raises:
        ConfigError: There is no such dimension, or one is asked for twice.
    """
    names, at = names_of(grid), dict(at or {})
    chosen = tuple(dims) or names[2:4]
    for name in (*chosen, *at, *([over] if over not in {None, "none"} else [])):
        check_known("dimension", name, names)
    if len(chosen) != 2 or chosen[0] == chosen[1]:
        raise ConfigError(f"dims needs two different dimensions of {', '.join(names)}")
    if over in chosen or set(at) & {*chosen, over}:
        raise ConfigError("a dimension is shown, differs from slice to slice, or is held: once")
    for name, value in at.items():
        if not abs(value) <= FARTHEST:
            raise ConfigError(f"{name} is held at a number up to {FARTHEST:g}, not {value!r}")
    others = [name for name in names if name not in {*chosen, *at}]
    if over is None:
        used = [name for name in others if grid.bins[names.index(name)] > 1]
        # Speed before place: it is what a step changes.
        over = next((name for name in ("x_dot", *used) if name in used), "none")
    held = [at.get(name, _middle(grid, index)) for index, name in enumerate(names)]
    index_of = {name: index for index, name in enumerate(names)}
    return Axes(
        (index_of[chosen[0]], index_of[chosen[1]]), index_of.get(over), tuple(map(float, held))
    )


def _middle(grid: Discretizer, dimension: int) -> float:
    low, high = grid.low[dimension], grid.high[dimension]
    if dimension >= len(grid.bins) - grid.actions:
        return high  # Pushed to the right, as it counts before the first one.
    return 0.0 if low <= 0 <= high else (low + high) / 2


def edges_along(grid: Discretizer, dimension: int) -> Floats:
    """Return the edges of the cells in which a table says the same along a dimension.

    Between nodes, where it changes everywhere, these are small parts of their gaps.
    """
    low, high = grid.low[dimension], grid.high[dimension]
    if dimension not in grid.grid.dimensions:
        return np.array([low, high])
    n = grid.bins[dimension]
    if grid.interpolated:
        return np.linspace(low, high, (n - 1) * -(-_FINE // (n - 1)) + 1)
    axis = list(grid.grid.dimensions).index(dimension)
    fine = grid.grid.low[axis] + grid.grid.width[axis] * np.arange(grid.grid.bins[axis] + 1)
    fine[0], fine[-1] = low, high
    return fine


def visit_edges(grid: Discretizer, dimension: int) -> Floats:
    """Return the edges of the cells in which visits are counted along a dimension."""
    low, high, n = grid.low[dimension], grid.high[dimension], grid.bins[dimension]
    if not grid.interpolated or n == 1:
        return np.linspace(low, high, n + 1)
    nodes = np.linspace(low, high, n)
    return np.concatenate([[low], (nodes[:-1] + nodes[1:]) / 2, [high]])


def stations(grid: Discretizer, dimension: int) -> list[tuple[str, float]]:
    """Return where a dimension is cut: in words, and as values; few, and evenly spaced."""
    n, low, high = grid.bins[dimension], grid.low[dimension], grid.high[dimension]
    name = names_of(grid)[dimension]
    chosen = np.unique(np.linspace(0, n - 1, min(n, MOST_COLUMNS)).round().astype(int))
    if grid.interpolated:
        values = np.linspace(low, high, n)[chosen].tolist() if n > 1 else [(low + high) / 2]
        return [(f"{name} = {value:.3g}", value) for value in values]
    edges = np.linspace(low, high, n + 1)
    middles = ((edges[:-1] + edges[1:]) / 2)[chosen].tolist()
    if grid.tilings > 1 or n == 1:
        return [(f"{name} = {value:.3g}", value) for value in middles]
    words = [f"{name} {edges[k]:.3g} to {edges[k + 1]:.3g}" for k in chosen]
    words[0], words[-1] = f"{name} below {edges[1]:.3g}", f"{name} above {edges[-2]:.3g}"
    return list(zip(words, middles, strict=True))


def slices(
    title: str,
    grid: Discretizer,
    table: Floats,
    axes: Axes,
    *,
    visits: npt.NDArray[np.int64] | None = None,
    shown: Sequence[Kind] = SHOWN,
    limits: tuple[float | None, float | None] = (None, None),
) -> Grid:
    """Return slices of a table, ready to be drawn: a row for each thing that is shown.

    The table has action values as a policy has them, and is called by the title. Visits, shape
    (*bins, 2), say how often each action was taken in each state; None: not known. Limits are where
    an episode ends along both dimensions.
    """
    for name in shown:
        check_known("picture of a table", name, SHOWN)
    names = names_of(grid)
    notes = [held] if (held := _held_words(names, axes, grid)) else []
    if "visits" in shown and visits is None:
        shown = [kind for kind in shown if kind != "visits"] or ["action"]
        notes.append("its visits were not counted")
    places = [("", axes.held)] if axes.over is None else _held_at(grid, axes)
    fields = [
        [_field(kind, *place, grid, table, axes, visits) for place in places] for kind in shown
    ]
    return Grid(
        title, (names[axes.dims[0]], names[axes.dims[1]]), fields, limits=limits, notes=notes
    )


def _held_at(grid: Discretizer, axes: Axes) -> list[tuple[str, tuple[float, ...]]]:
    assert axes.over is not None
    return [
        (words, (*axes.held[: axes.over], value, *axes.held[axes.over + 1 :]))
        for words, value in stations(grid, axes.over)
    ]


def _held_words(names: Sequence[str], axes: Axes, grid: Discretizer) -> str:
    """Return in words where the dimensions are held that a table tells apart."""
    held = [
        f"{name} = {axes.held[index]:.3g}"
        for index, name in enumerate(names)
        if index not in {*axes.dims, axes.over} and grid.bins[index] > 1
    ]
    return f"at {', '.join(held)}" if held else ""


def _field(
    kind: Kind,
    title: str,
    held: tuple[float, ...],
    grid: Discretizer,
    table: Floats,
    axes: Axes,
    visits: npt.NDArray[np.int64] | None,
) -> Field:
    along = visit_edges if kind == "visits" else edges_along
    edges = along(grid, axes.dims[0]), along(grid, axes.dims[1])
    states = states_over(edges, axes.dims, held)
    if kind == "visits":
        assert visits is not None
        drawn = visits.reshape(-1, N_ACTIONS).sum(axis=1)[homes_in(grid, states)]
    elif kind == "action":
        drawn = actions_in(grid, table, states)
    else:
        drawn = np.diff(values_in(grid, table, states), axis=1)
    shape = (len(edges[1]) - 1, len(edges[0]) - 1)
    return Field(kind, title, edges, drawn.astype(np.float64).reshape(shape))


def states_over(edges: tuple[Floats, Floats], dims: tuple[int, int], held: Any) -> Floats:
    """Return the states in the middle of all cells, row by row, shape (n, dimensions)."""
    across, up = ((each[:-1] + each[1:]) / 2 for each in edges)
    states = np.tile(np.asarray(held, np.float64), (len(across) * len(up), 1))
    states[:, dims[0]] = np.tile(across, len(up))
    states[:, dims[1]] = np.repeat(up, len(across))
    return states
