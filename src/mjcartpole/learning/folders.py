"""Folders that one training holds at a time."""

import contextlib
import os
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

from mjcartpole.errors import FileError, RunError
from mjcartpole.files import brief, is_folder, names_in, remove_leftovers
from mjcartpole.packages import check_installed

if TYPE_CHECKING:
    import filelock

LOCK: Final = ".lock"
SEEDS: Final = "seeds.json"
"""Lies in a folder of many runs (see studies/multi_seed_runs.py)."""


def free_folder(parent: Path, name: str) -> Path:
    """The first of `parent/name`, `parent/name-2`, `parent/name-3` … that is not there."""
    folder, number = parent / name, 1
    while folder.exists():
        number += 1
        folder = parent / f"{name}-{number}"
    return folder


@contextlib.contextmanager
def held_folder(folder: Path) -> Iterator[None]:
    """Make a folder and keep others out; it goes again if nothing is in it afterwards.

    Raises:
        RunError: Another training is at work in it.
        FileError: It cannot be made or written.
    """
    try:
        with locked_folder(folder, make=True):
            yield
    finally:
        with contextlib.suppress(OSError):
            folder.rmdir()  # Only an empty one goes.


@contextlib.contextmanager
def locked_folder(folder: Path, *, make: bool = False) -> Iterator[None]:
    """Keep other trainings out of a folder, made if need be, for as long as this process lives.

    What writers that were killed have left in it goes.

    Raises:
        RunError: Another training is at work in it, or its lock is none of ours.
        FileError: The folder cannot be written.
    """
    lock = _acquired(folder, make)
    try:
        remove_leftovers(folder)
        yield
    finally:
        with contextlib.suppress(OSError):
            (folder / LOCK).unlink()
        lock.release()


def _acquired(folder: Path, make: bool, tries: int = 100) -> "filelock.BaseFileLock":
    check_installed("a run's folder", "filelock")
    import filelock  # noqa: PLC0415 - only what is kept on disk needs it

    lock = filelock.FileLock(folder / LOCK)
    try:
        if make:
            folder.mkdir(parents=True, exist_ok=True)
        check_here(folder)
        _check_lock(folder / LOCK)
        lock.acquire(timeout=0)
    except filelock.Timeout:
        raise RunError(
            f"run folder '{folder}' is in use by another training; wait for its end, or choose "
            "another --run-dir"
        ) from None
    except OSError as error:
        # Another training may have ended right now, and its empty folder with it.
        if make and tries and isinstance(error, FileNotFoundError | FileExistsError):
            return _acquired(folder, make, tries - 1)
        task = "lock" if is_folder(folder) else "make the folder"
        raise FileError(f"cannot {task} '{folder}': {brief(error)}") from error
    return lock


def check_here(folder: Path) -> None:
    """Refuse a run inside a folder of many that in truth lies elsewhere (RunError)."""
    if folder.is_symlink() and SEEDS in names_in(folder.parent):
        raise RunError(
            f"'{folder}' is a link: what it leads to is no part of these runs; remove it, or put "
            "the run itself in its place"
        )


def _check_lock(path: Path) -> None:
    """Refuse a lock that is also something else: a link, or the second name of another file."""
    try:
        found = os.lstat(path)
    except FileNotFoundError:
        return
    if not stat.S_ISREG(found.st_mode) or found.st_nlink > 1:
        raise RunError(
            f"'{path}' is no lock of a training but a link, or another kind of file; remove it"
        )
