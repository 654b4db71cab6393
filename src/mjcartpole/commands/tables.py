"""Policies on models as tables: printed, and written as CSV, JSON and a picture."""

import json
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mjcartpole.commands.printing import with_added
from mjcartpole.files import (
    check_free,
    check_writable,
    csv_text,
    free_path,
    make_folder,
    write_whole,
)
from mjcartpole.media import plots
from mjcartpole.output import FAILED
from mjcartpole.studies.sweep import SweepResult
from mjcartpole.studies.transfer import Cell, TransferResult

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TRANSFER = Path("transfer")
"""Where the files go, unless told otherwise."""

SUFFIXES = (".csv", ".json", ".png")


def free_table(output: Path | None, name: str, overwrite: bool) -> Path:
    """Return where a table goes; the JSON and the picture lie beside it.

    Raises:
        FileError: One of them is there already, or none can be written.
    """
    table = (output or TRANSFER) / f"{name}{SUFFIXES[0]}"
    if not overwrite and output is None:
        table = free_path(table, SUFFIXES)
    elif not overwrite:
        check_free([table.with_suffix(suffix) for suffix in SUFFIXES])
    check_writable(make_folder(table.parent))
    return table


def print_matrix(result: TransferResult) -> None:
    """Print one line per model, one column per policy."""
    added = with_added(result.disturbances)
    print(f"mean greedy return and 95 % interval, seed {result.seed}{added}\n")
    first = max(len(name) for name in result.places)
    labels = [f"{place:{first}}" for place in result.places]
    _print_grid(" " * first, labels, result)


def print_sweep(result: SweepResult) -> None:
    """Print one line per value, one column per policy; then where each policy holds."""
    added = with_added(result.played.disturbances)
    print(f"mean greedy return on {result.model}, seed {result.played.seed}{added}\n")
    first = max(10, len(result.key))
    labels = [f"{value:{first}g}" for value in result.values]
    _print_grid(f"{result.key:>{first}}", labels, result.played)
    if result.threshold is None:
        return
    print()
    for name in result.played.policies:
        stretch = result.longest(name)
        where = f"at {result.key} from {stretch}" if stretch else "nowhere in this sweep"
        print(f"{name}: the mean return is at least {result.threshold:g} {where}")


def _print_grid(corner: str, labels: Iterable[str], result: TransferResult) -> None:
    names = [_short(name) for name in result.policies]
    wide = max(20, *(len(name) + 2 for name in names))
    print(corner + "".join(f"{name:>{wide}}" for name in names))
    for label, cells in zip(labels, zip(*result.rows, strict=True), strict=True):
        print(label + "".join(f"{_cell(cell):>{wide}}" for cell in cells))


def _cell(cell: Cell) -> str:
    if cell.interval is None:
        return "failed"
    return f"{cell.mean:.1f} ({cell.interval.low:.0f}-{cell.interval.high:.0f})"


def _short(name: str, most: int = 30) -> str:
    return name if len(name) <= most else f"…{name[1 - most :]}"


def write_tables(
    table: Path,
    rows: Sequence[Mapping[str, Any]],
    summary: Mapping[str, Any],
    plot: "Callable[[], Figure]",
) -> None:
    """Write rows as CSV, the summary as JSON and a plot, if that can be drawn; say where.

    Raises:
        FileError: One cannot be written.
    """
    _, as_json, drawn = (table.with_suffix(suffix) for suffix in SUFFIXES)
    write_whole(table, csv_text(rows))
    text = json.dumps(summary, indent=2, allow_nan=False)
    write_whole(as_json, text + "\n")
    if plots.is_installed():
        plots.write_plot(plot(), drawn)
        print(f"\nwritten {table}, {as_json.suffix} and {drawn.suffix}")
        return
    print(f"\nwritten {table} and {as_json.suffix}")
    print(f"mjcartpole: no {drawn.suffix}: {plots.MISSING_LIBRARY}", file=sys.stderr)


def tell_failed(result: TransferResult) -> int:
    """Say on stderr what could not be played, and return the exit code."""
    for cell in result.failed:
        message = f"{cell.policy} on {cell.place} failed: {cell.error}"
        print(f"mjcartpole: error: {message}", file=sys.stderr)
    return FAILED if result.failed else 0
