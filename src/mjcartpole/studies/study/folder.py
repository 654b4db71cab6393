"""The folder of a study.

studies/<name>/
study.toml      what was asked, as its file was when the study last went on
results.jsonl   what runs have come to, as they came
runs.csv        a row for each run, in the plan's order; runs.parquet too, where that can be written
curves.csv      their learning curves
report.md       what they say together, see report.py; report.html, report.tex and report.png too
"""

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from mjcartpole.errors import RunError
from mjcartpole.files import names_in, remove, write_whole
from mjcartpole.learning.folders import LOCK, held_folder
from mjcartpole.studies.study.records import LOG
from mjcartpole.studies.study.tables import CURVES, PARQUET, RUNS

STUDY: Final = "study.toml"
REPORTS: Final = ("report.md", "report.tex", "report.html", "report.png")
FILES: Final = (LOG, RUNS, CURVES, PARQUET, *REPORTS, STUDY)
"""In the order of removal."""


@contextlib.contextmanager
def claimed_study(folder: Path, text: str, resume: bool, overwrite: bool) -> Iterator[None]:
    """Hold a study's folder, and write what is asked into it.

    Raises:
        RunError: Another study is there or at work, or files that are none.
        FileError: The folder cannot be written.
    """
    _check(folder, resume, overwrite)
    with held_folder(folder):
        _check(folder, resume, overwrite)
        for name in FILES if overwrite else ():
            remove(folder / name)
        write_whole(folder / STUDY, text)
        yield


def _check(folder: Path, resume: bool, overwrite: bool) -> None:
    found = names_in(folder) - {LOCK}
    if STUDY not in found and found:
        raise RunError(f"'{folder}' holds other files and is no study; choose another --run-dir")
    if STUDY in found and not (resume or overwrite):
        raise RunError(
            f"the study '{folder}' exists; go on with it with --resume, which only does what is "
            "new, choose another --run-dir, or replace it with --overwrite"
        )
