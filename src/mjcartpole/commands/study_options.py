"""Flags of `mjcartpole study` that decide nothing of what is found."""

from dataclasses import dataclass
from pathlib import Path

from mjcartpole.learning.engine import Engine


@dataclass(frozen=True)
class StudyOptions:
    """Where a study goes, and who does it."""

    run_dir: Path | None = None
    """Folder for the study; studies/<the file's name> if left out."""
    resume: bool = False
    """Go on with the study in that folder: only what the file asks and is not there is done."""
    overwrite: bool = False
    """Replace the study in that folder."""
    dry_run: bool = False
    """Say how many points, runs and steps it is, and how long it may take; nothing is kept."""
    workers: int | None = None
    """How many runs at once; as many as there are cores if left out."""
    scheduler: str | None = None
    """Address of a Dask scheduler, such as tcp://127.0.0.1:8786: the runs are done by its workers,
    which need nothing but mjcartpole."""
    engine: Engine = "compiled"
    """Who runs the loop; both give the same bits."""
