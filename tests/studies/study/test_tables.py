"""The tables of a study: the same bytes, whatever came first; Parquet where it can be written."""

import importlib.util

import pytest

from mjcartpole.files import csv_text
from mjcartpole.studies.study import tables
from mjcartpole.studies.study.plan import plan
from mjcartpole.studies.study.records import do_run
from mjcartpole.studies.study.study_file import study_of
from mjcartpole.studies.study.tables import PARQUET, RUNS, rows_of, write_parquet, write_tables

READERS = {
    "pyarrow": lambda path: importlib.import_module("pyarrow.parquet").read_table(path).to_pylist(),
    "duckdb": lambda path: [
        dict(zip(("key", "alpha"), row, strict=True))
        for row in importlib.import_module("duckdb").read_parquet(str(path)).fetchall()
    ],
}


@pytest.fixture(scope="module")
def done():
    base = {"backend": "gym", "episodes": 3}
    study = {"study": {"seeds": 2}, "base": base, "factors": {"alpha": [0.1], "mirror": ["none"]}}
    planned = plan(study_of(study))
    return planned, {run.key: do_run(run.key, run.job, None, lambda: False) for run in planned.runs}


def test_rows_are_in_the_plans_order(done, tmp_path):
    planned, found = done
    turned = dict(reversed(found.items()))
    assert rows_of(planned, turned) == rows_of(planned, found)
    assert [row["seed"] for row in rows_of(planned, found)] == [0, 1]
    assert rows_of(planned, found)[0]["mirror"] == "none"
    assert write_tables(tmp_path, planned, found) == write_tables(tmp_path, planned, turned)


def test_where_nothing_is_done_there_are_no_rows(done, tmp_path):
    write_tables(tmp_path, done[0], {})
    assert (tmp_path / RUNS).read_text() == "\n"
    assert not (tmp_path / PARQUET).exists()


@pytest.mark.parametrize("package", READERS)
def test_parquet_says_what_the_table_says(package, tmp_path, monkeypatch):
    pytest.importorskip(package, reason=f"{package} is not installed")
    monkeypatch.setattr(tables, "is_installed", lambda name: name == package)
    rows = [{"key": "0123456789012345", "alpha": 0.1}, {"key": "12e4567890123456", "alpha": None}]
    (tmp_path / RUNS).write_text(csv_text(rows))
    write_parquet(tmp_path / RUNS, tmp_path / PARQUET)
    assert READERS[package](tmp_path / PARQUET) == rows


def test_without_either_there_is_no_parquet(tmp_path, monkeypatch):
    monkeypatch.setattr(tables, "is_installed", lambda name: False)
    write_parquet(tmp_path / RUNS, tmp_path / PARQUET)
    assert not (tmp_path / PARQUET).exists()
