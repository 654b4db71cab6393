"""Files that are written whole or not at all, and read as if somebody else had put them there."""

import contextlib
import csv
import functools
import io
import os
import re
import stat
from collections.abc import Iterator, Mapping, Sequence
from io import BufferedReader
from pathlib import Path
from typing import Final

from mjcartpole.errors import FileError
from mjcartpole.leftovers import temporary_beside

_TEMPORARY = re.compile(r"\.[\w.-]+-[0-9a-f]{8}(\.\w+)?")
"""What `temporary_beside` calls them."""

_LONGEST: Final = 300
"""Characters of what an error says."""


@contextlib.contextmanager
def atomic_write(path: str | os.PathLike[str]) -> Iterator[Path]:
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
    with atomic_write(path) as temporary:
        # A file name in it that is no text is escaped, as JSON does it.
        temporary.write_bytes(text.encode("utf-8", "backslashreplace"))


def csv_text(rows: Sequence[Mapping[str, object]]) -> str:
    """Return rows as CSV, under a line of all names that they have."""
    text = io.StringIO()
    columns = list(dict.fromkeys(key for row in rows for key in row))
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


@contextlib.contextmanager
def opened(
    path: str | os.PathLike[str],
    most: int,
    *,
    follow: bool = False,
    refusal: type[FileError] = FileError,
) -> Iterator[BufferedReader]:
    """Open a regular file of so many bytes at most; what is none is not even opened.

    A link is refused unless `follow` takes it for what it leads to, as where a person names it.

    Raises:
        FileError: It cannot be read, is no regular file, or too large; of the type `refusal`.
    """
    extra = getattr(os, "O_NONBLOCK", 0) | (0 if follow else getattr(os, "O_NOFOLLOW", 0))
    try:
        _check_regular(Path(path).stat(follow_symlinks=follow), most)
        with open(path, "rb", opener=lambda name, flags: os.open(name, flags | extra)) as file:
            _check_regular(os.fstat(file.fileno()), most)
            yield file
    except (OSError, ValueError) as error:
        raise refusal(f"'{path}' cannot be read: {brief(error)}") from error


def read_bytes(
    path: str | os.PathLike[str],
    most: int,
    *,
    follow: bool = False,
    refusal: type[FileError] = FileError,
) -> bytes:
    """Return the content of a file; see `opened`, also for what is raised."""
    with opened(path, most, follow=follow, refusal=refusal) as file:
        return file.read(most)


def _check_regular(found: os.stat_result, most: int) -> None:
    if not stat.S_ISREG(found.st_mode):
        kinds = {stat.S_IFLNK: "a link, which may lead anywhere,", stat.S_IFDIR: "a folder"}
        kind = kinds.get(stat.S_IFMT(found.st_mode), "a device or a pipe")
        raise ValueError(f"it is {kind} where a plain file is needed")
    if found.st_size > most:
        raise ValueError(f"it has {found.st_size:,} bytes, and no more than {most:,} are read")


def brief(error: Exception) -> str:
    """Return what an error says, in one line of bounded length."""
    message = error.strerror if isinstance(error, OSError) else None
    words = " ".join((message or str(error)[:1_000]).split())
    return words if len(words) <= _LONGEST else f"{words[:_LONGEST]}…"


def names_in(folder: Path) -> set[str]:
    """Return names of what lies in a folder; none where there is no folder.

    Raises:
        FileError: It cannot be read.
    """
    with _refused(f"cannot read the folder '{folder}'"):
        try:
            return {path.name for path in folder.iterdir()}
        except (FileNotFoundError, NotADirectoryError):
            return set()


def remove(path: Path) -> None:
    """Remove a file, if it is there; of a link, the link.

    Raises:
        FileError: It cannot be removed, or is a folder.
    """
    with _refused(f"cannot remove '{path}'"):
        path.unlink(missing_ok=True)


def is_there(path: Path) -> bool:
    """Return whether a path leads to something; one that is no path leads to nothing."""
    return _mode(path, follow=True) != 0


def is_file(path: Path) -> bool:
    """Return whether a regular file, or a link to one, can be seen there."""
    return stat.S_ISREG(_mode(path, follow=True))


def is_folder(path: Path, *, follow: bool = True) -> bool:
    """Return whether a folder, or a link to one, can be seen there."""
    return stat.S_ISDIR(_mode(path, follow=follow))


def _mode(path: Path, *, follow: bool) -> int:
    # Path.is_file and its like raise where a folder above may not be searched.
    try:
        return path.stat(follow_symlinks=follow).st_mode
    except (OSError, ValueError):
        return 0


def make_folder(path: str | os.PathLike[str]) -> Path:
    """Make a folder and its parents, if they are not there, and return it.

    Raises:
        FileError: It cannot be made, or a file is in the way.
    """
    folder = Path(path)
    with _refused(f"cannot make the folder '{folder}'"):
        folder.mkdir(parents=True, exist_ok=True)
    return folder


def check_writable(folder: Path) -> None:
    """Refuse a folder in which no file can be made, before any work is put into one (FileError)."""
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
    """Return the first of `a.mp4`, `a-2.mp4`, `a-3.mp4` … of which nothing is there.

    What belongs to it, with other suffixes, is not there beside it either.
    """
    stem, free, number = path.with_suffix(""), path, 1
    while any(os.path.lexists(free.with_suffix(suffix)) for suffix in (path.suffix, *suffixes)):
        number += 1
        free = stem.with_name(f"{stem.name}-{number}{path.suffix}")
    return free


def remove_leftovers(folder: Path) -> None:
    """Remove temporary files of writers that were killed; nobody may be writing there now."""
    for name in names_in(folder):
        if is_temporary(name) and not is_folder(folder / name):
            remove(folder / name)


def is_temporary(name: str) -> bool:
    """Return whether a name is one that only a writer here gives, until its file is whole."""
    return _TEMPORARY.fullmatch(name) is not None


@contextlib.contextmanager
def _temporary(target: Path) -> Iterator[Path]:
    make_folder(target.parent)
    if is_folder(target):
        raise FileError(f"cannot write '{target}': it is a folder; give the path of a file")
    make = functools.partial(Path.touch, exist_ok=False)
    with _refused(f"cannot write '{target}'"), temporary_beside(target, make) as temporary:
        try:
            yield temporary
        finally:
            temporary.unlink(missing_ok=True)


@contextlib.contextmanager
def _refused(what: str) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise FileError(f"{what}: {brief(error)}") from error


def sync(path: Path) -> None:
    """Bring a file's content, or a folder's entries, to the disk."""
    if path.is_dir() and os.name == "nt":
        return  # Windows has no way to open a folder for this.
    handle = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
