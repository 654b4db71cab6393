"""Folders that one training holds at a time."""

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import filelock

from mjcartpole.errors import FileError, RunError
from mjcartpole.files import check_writable, make_folder, remove_leftovers

LOCK: Final = ".lock"


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
    make_folder(folder)
    check_writable(folder)
    try:
        with locked_folder(folder):
            remove_leftovers(folder)
            yield
    finally:
        with contextlib.suppress(OSError):
            folder.rmdir()  # Only an empty one goes.


@contextlib.contextmanager
def locked_folder(folder: Path) -> Iterator[None]:
    """Keep other trainings out of a folder, for as long as this process lives.

    Raises:
        RunError: Another training is at work in it.
        FileError: The folder cannot be written.
    """
    lock = filelock.FileLock(folder / LOCK)
    try:
        lock.acquire(timeout=0)
    except filelock.Timeout:
        raise RunError(
            f"run folder '{folder}' is in use by another training; wait for its end, or choose "
            "another --run-dir"
        ) from None
    except OSError as error:
        raise FileError(f"cannot lock '{folder}': {error.strerror or error}") from error
    try:
        yield
    finally:
        with contextlib.suppress(OSError):
            (folder / LOCK).unlink()
        lock.release()
