"""Files that are written whole or not at all, and read as if somebody else had put them there."""

import contextlib
import os
import re
import secrets
import stat
from collections.abc import Iterator
from io import BufferedReader
from pathlib import Path
from typing import Final

from mjcartpole.errors import FileError

_NO_WAITING: Final = getattr(os, "O_NONBLOCK", 0)
_NO_LINK: Final = getattr(os, "O_NOFOLLOW", 0)

_TEMPORARY = re.compile(r"\.[\w.-]+-[0-9a-f]{8}(\.\w+)?")
"""What `_make_temporary` calls them."""

_LONGEST: Final = 300
"""Characters of what an error says."""


@contextlib.contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary path beside `path`; on success it takes the place of `path` at once.

    If the body raises, or the process is killed, the old file (if any) stays as it was.
    The temporary name keeps the suffix, since encoders choose the format by it.

    Raises:
        FileError: The folder cannot be written, or the disk is full.
    """
    target = Path(path)
    temporary = _make_temporary(target)
    try:
        yield temporary
        sync(temporary)
        temporary.replace(target)
        sync(target.parent)
    except OSError as error:
        raise FileError(f"cannot write '{target}': {brief(error)}") from error
    finally:
        temporary.unlink(missing_ok=True)


def write_whole(path: str | os.PathLike[str], text: str) -> None:
    """Write a text file (UTF-8) whole or not at all.

    Raises:
        FileError: The folder cannot be written, or the disk is full.
    """
    with replacing(path) as temporary:
        temporary.write_bytes(text.encode("utf-8"))


@contextlib.contextmanager
def opened(
    path: str | os.PathLike[str],
    most: int,
    *,
    follow: bool = False,
    refusal: type[FileError] = FileError,
) -> Iterator[BufferedReader]:
    """Open a regular file to be read; what is none is not even opened.

    Args:
        path: Where it is.
        most: Bytes that it may have.
        follow: Take a link for what it leads to, as where a person names it.
        refusal: What is raised.

    Raises:
        FileError: It cannot be read, is no regular file, or too large.
    """
    extra = _NO_WAITING | (0 if follow else _NO_LINK)
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
    """The content of a file; see `opened`.

    Raises:
        FileError: See `opened`.
    """
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
    """What an error says, in one line of bounded length."""
    message = error.strerror if isinstance(error, OSError) else None
    words = " ".join((message or str(error)[:1_000]).split())
    return words if len(words) <= _LONGEST else f"{words[:_LONGEST]}…"


def names_in(folder: Path) -> set[str]:
    """Names of what lies in a folder; none where there is no folder.

    Raises:
        FileError: It cannot be read.
    """
    try:
        return {path.name for path in folder.iterdir()}
    except (FileNotFoundError, NotADirectoryError):
        return set()
    except OSError as error:
        raise FileError(f"cannot read the folder '{folder}': {brief(error)}") from error


def remove(path: Path) -> None:
    """Remove a file, if it is there; of a link, the link.

    Raises:
        FileError: It cannot be removed, or is a folder.
    """
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        raise FileError(f"cannot remove '{path}': {brief(error)}") from error


def is_file(path: Path) -> bool:
    """Whether a regular file, or a link to one, can be seen there."""
    return stat.S_ISREG(_mode(path, follow=True))


def is_folder(path: Path, *, follow: bool = True) -> bool:
    """Whether a folder, or a link to one, can be seen there."""
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
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"cannot make the folder '{folder}': {brief(error)}") from error
    return folder


def check_writable(folder: Path) -> None:
    """Refuse a folder in which no file can be made, before any work is put into one.

    Raises:
        FileError: See above.
    """
    _make_temporary(folder / "probe").unlink(missing_ok=True)


def remove_leftovers(folder: Path) -> None:
    """Remove temporary files of writers that were killed; nobody may be writing there now."""
    for name in names_in(folder):
        if is_temporary(name) and not is_folder(folder / name):
            remove(folder / name)


def is_temporary(name: str) -> bool:
    """Whether a file's name is one that only a writer here gives, until its file is whole."""
    return _TEMPORARY.fullmatch(name) is not None


def _make_temporary(target: Path) -> Path:
    make_folder(target.parent)
    if is_folder(target):
        raise FileError(f"cannot write '{target}': it is a folder; give the path of a file")
    temporary = target.with_name(f".{target.stem}-{secrets.token_hex(4)}{target.suffix}")
    try:
        temporary.touch(exist_ok=False)
    except OSError as error:
        raise FileError(f"cannot write '{target}': {brief(error)}") from error
    return temporary


def sync(path: Path) -> None:
    """Bring a file's content, or a folder's entries, to the disk."""
    if path.is_dir() and os.name == "nt":
        return  # Windows has no way to open a folder for this.
    handle = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
