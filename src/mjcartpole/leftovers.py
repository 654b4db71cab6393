"""Temporary files and folders, and what writers that were killed have left of them.

A writer holds a lock on what it is writing, which the system lets go when the writer dies: so
another one in the same folder can tell what is left from what is still being written.
"""

import contextlib
import os
import re
import secrets
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

if sys.platform != "win32":
    import fcntl

_NAME: Final = re.compile(r"\.mjcartpole-[0-9a-f]{8}(\.(old-(?P<target>.+)|.*))?", re.DOTALL)


@contextlib.contextmanager
def temporary_beside(target: Path, make: Callable[[Path], None]) -> Iterator[Path]:
    """Yield a temporary file or folder that is nobody else's; the caller removes it in the end.

    Its name keeps the target's suffix, since encoders choose the format by it. What killed writers
    have left in that folder goes. `make` makes it, and raises FileExistsError if it is there.

    Raises:
        OSError: It cannot be made.
    """
    _clear(target.parent)
    with contextlib.ExitStack() as held:
        is_held = False
        while not is_held:
            path = target.with_name(f".mjcartpole-{secrets.token_hex(4)}{target.suffix}")
            make(path)
            # One that clears may have come in between; then it is gone.
            is_held = held.enter_context(_lock(path)) is not False and path.exists()
        yield path


def name_aside(temporary: Path, target: Path) -> Path:
    """Return where a folder is put for the moment in which a temporary one takes its place."""
    return temporary.with_name(f"{temporary.stem}.old-{target.name}")


def _clear(folder: Path) -> None:
    """Remove what writers have left that live no more; a folder put aside comes back."""
    with contextlib.suppress(OSError):
        for path in list(folder.iterdir()):
            name = _NAME.fullmatch(path.name)
            if name is not None and not path.is_symlink():
                with contextlib.suppress(OSError), _lock(path) as is_left:
                    if is_left:
                        _remove(path, folder / (name["target"] or path.name))


def _remove(path: Path, target: Path) -> None:
    if path.is_dir() and not target.exists():
        path.rename(target)
    elif path.is_dir():
        # By no means more than what is written here: files in one folder.
        for file in path.iterdir():
            file.unlink()
        path.rmdir()
    elif path.is_file():
        path.unlink()


@contextlib.contextmanager
def _lock(path: Path) -> Iterator[bool | None]:
    """Yield whether it is locked now, and by this; None where that cannot be known."""
    if sys.platform == "win32":
        yield None  # A file that is open could not take another one's place there.
        return
    try:
        handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_NOFOLLOW)
    except OSError:
        yield False
        return
    try:
        yield _try_lock(handle)
    finally:
        os.close(handle)


def _try_lock(handle: int) -> bool | None:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return None  # Some network file systems have no locks.
    return True
