"""The tables of a study: a row for each run, and the points of all learning curves."""

import hashlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from mjcartpole.files import atomic_write, csv_text, write_whole
from mjcartpole.packages import is_installed
from mjcartpole.studies.study.measures import APART
from mjcartpole.studies.study.plan import Plan, PlannedRun
from mjcartpole.studies.study.records import Record
from mjcartpole.studies.study.settings import as_text

RUNS, CURVES, PARQUET = "runs.csv", "curves.csv", "runs.parquet"
TIMES: Final = (*APART, "host")
"""Columns that differ from time to time; the last ones."""

Row = dict[str, Any]


def rows_of(plan: Plan, found: Mapping[str, Record]) -> list[Row]:
    """Return a row for each run that is done, in the plan's order."""
    done = [run for run in plan.runs if run.key in found]
    return [_row(plan, run, found[run.key]) for run in done]


def _row(plan: Plan, run: PlannedRun, record: Record) -> Row:
    figures = {name: record.figures[name] for name in plan.study.measure if name not in APART}
    return {
        "point": run.point,
        **{name: as_text(value) for name, value in run.factors.items()},
        "seed": run.job.config.seed,
        **figures,
        "episodes_trained": record.episodes_trained,
        "steps_trained": record.steps_trained,
        "error": record.error,
        "key": run.key,
        **record.versions,
        **record.times,
        "host": record.host,
    }


def write_tables(folder: Path, plan: Plan, found: Mapping[str, Record]) -> str:
    """Write the tables, and return a digest of all that is the same wherever it was done.

    Raises:
        FileError: One cannot be written.
    """
    rows = rows_of(plan, found)
    curves = csv_text(list(_curve_rows(plan, found)))
    write_whole(folder / RUNS, csv_text(rows))
    write_whole(folder / CURVES, curves)
    if rows:
        write_parquet(folder / RUNS, folder / PARQUET)
    lasting = [{k: v for k, v in row.items() if k not in TIMES} for row in rows]
    return hashlib.sha256((csv_text(lasting) + curves).encode()).hexdigest()[:16]


def _curve_rows(plan: Plan, found: Mapping[str, Record]) -> Iterator[Row]:
    for run in plan.runs:
        record = found.get(run.key)
        about = {"key": run.key, "point": run.point, "seed": run.job.config.seed}
        for episode, mean in record.curve if record else ():
            yield {**about, "what": "training", "episode": episode, "mean": mean, "minimum": None}
        for episode, _, mean, least in record.greedy if record else ():
            yield {**about, "what": "greedy", "episode": episode, "mean": mean, "minimum": least}


def write_parquet(table: Path, target: Path) -> None:
    """Write a table as Parquet too, where a package is installed that can.

    Raises:
        FileError: It cannot be written.
    """
    # Digits alone would else be a number.
    if is_installed("pyarrow"):
        import pyarrow  # noqa: PLC0415 - an optional package
        from pyarrow import csv, parquet  # noqa: PLC0415

        options = csv.ConvertOptions(column_types={"key": pyarrow.string()})
        with atomic_write(target) as temporary:
            parquet.write_table(csv.read_csv(table, convert_options=options), temporary)
    elif is_installed("duckdb"):
        import duckdb  # noqa: PLC0415 - an optional package

        with atomic_write(target) as temporary, duckdb.connect() as connection:
            found = connection.read_csv(str(table), dtype={"key": "VARCHAR"})
            found.write_parquet(str(temporary))
