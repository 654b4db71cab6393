"""Files that are written whole or not at all."""

import contextlib
import functools
import os
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from mjcartpole.errors import FileError
from mjcartpole.leftovers import temporary_beside

_TEMPORARY = re.compile(r"\.[\w.-]+-[0-9a-f]{8}(\.\w+)?")
"""What `temporary_beside` calls them."""


@contextlib.contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary path beside `path`; on success it takes the place of `path` at once.

    If the body raises, or the process is killed, the old file (if any) stays as it was.
    The temporary name keeps the suffix, since encoders choose the format by it. What writers that
    were killed have left in that folder goes.

    Raises:
        FileError: The folder cannot be written, or the disk is full.
    """
    target = Path(path)
    with _temporary(target) as temporary:
        yield temporary
        sync(temporary)
        temporary.replace(target)
        sync(target.parent)


def write_whole(path: str | os.PathLike[str], text: str) -> None:
    """Write a text file (UTF-8) whole or not at all.

    Raises:
        FileError: The folder cannot be written, or the disk is full.
    """
    with replacing(path) as temporary:
        # A file name in it that is no text is escaped, as JSON does it.
        temporary.write_bytes(text.encode("utf-8", "backslashreplace"))


def make_folder(path: str | os.PathLike[str]) -> Path:
    """Make a folder and its parents, if they are not there, and return it.

    Raises:
        FileError: It cannot be made, or a file is in the way.
    """
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"cannot make the folder '{folder}': {_reason(error)}") from error
    return folder


def check_writable(folder: Path) -> None:
    """Refuse a folder in which no file can be made, before any work is put into one.

    Raises:
        FileError: See above.
    """
    with _temporary(folder / "probe"):
        pass


def check_free(paths: Sequence[Path]) -> None:
    """Refuse to replace what is there already; an empty folder is nothing.

    Raises:
        FileError: One of them is there.
    """
    for path in paths:
        if os.path.lexists(path) and not (path.is_dir() and not any(path.iterdir())):
            raise FileError(f"'{path}' exists; choose another -o, or replace it with --overwrite")


def free_path(path: Path, suffixes: Sequence[str] = ()) -> Path:
    """The first of `a.mp4`, `a-2.mp4`, `a-3.mp4` … that is not there.

    Args:
        path: The first.
        suffixes: What belongs to it: none of these is there beside it either.
    """
    stem, free, number = path.with_suffix(""), path, 1
    while any(os.path.lexists(free.with_suffix(suffix)) for suffix in (path.suffix, *suffixes)):
        number += 1
        free = stem.with_name(f"{stem.name}-{number}{path.suffix}")
    return free


def remove_leftovers(folder: Path) -> None:
    """Remove temporary files of writers that were killed; nobody may be writing there now."""
    for path in folder.iterdir():
        if is_temporary(path.name) and path.is_file():
            path.unlink()


def is_temporary(name: str) -> bool:
    """Whether a file's name is one that only a writer here gives, until its file is whole."""
    return _TEMPORARY.fullmatch(name) is not None


@contextlib.contextmanager
def _temporary(target: Path) -> Iterator[Path]:
    make_folder(target.parent)
    if target.is_dir():
        raise FileError(f"cannot write '{target}': it is a folder; give the path of a file")
    try:
        with temporary_beside(target, functools.partial(Path.touch, exist_ok=False)) as temporary:
            try:
                yield temporary
            finally:
                temporary.unlink(missing_ok=True)
    except OSError as error:
        raise FileError(f"cannot write '{target}': {_reason(error)}") from error


def sync(path: Path) -> None:
    """Bring a file's content, or a folder's entries, to the disk."""
    if path.is_dir() and os.name == "nt":
        return  # Windows has no way to open a folder for this.
    handle = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _reason(error: OSError) -> str:
    return error.strerror or str(error)
