"""Frames into a folder of numbered pictures, written whole or not at all."""

import contextlib
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from mjcartpole.errors import FileError, RenderError
from mjcartpole.files import make_folder
from mjcartpole.leftovers import name_aside, temporary_beside
from mjcartpole.media.frames import Frame
from mjcartpole.packages import check_installed

_NUMBERED: Final = re.compile(r"\d{6,}\.png")


def write_pictures(folder: Path, frames: Iterator[Frame], fps: float) -> int:
    """Write frames as 000000.png, 000001.png, … into a folder; returns their number.

    How many there are per second pictures do not tell.

    Raises:
        RenderError: imageio is not installed.
    """
    check_installed("a folder of pictures", "imageio", RenderError)
    # Imported late: most videos need no single pictures.
    from imageio import v3 as imageio  # noqa: PLC0415

    count = 0
    for frame in frames:
        # Little compression: each further level costs more time than it saves bytes.
        picture = imageio.imwrite("<bytes>", frame, extension=".png", compress_level=1)
        (folder / f"{count:06d}.png").write_bytes(picture)
        count += 1
    return count


def check_folder(folder: Path) -> None:
    """Refuse a folder that holds anything but numbered pictures: it would be replaced.

    Raises:
        FileError: It holds something else, cannot be read, or is no folder.
    """
    try:
        if not folder.exists():
            return
        others = [entry.name for entry in folder.iterdir() if not _NUMBERED.fullmatch(entry.name)]
    except OSError as error:
        raise FileError(f"cannot write '{folder}': {error.strerror}") from error
    if others:
        raise FileError(
            f"'{folder}' holds '{min(others)}', which is no numbered picture; "
            "choose a new folder, or one that was written like this before"
        )


@contextlib.contextmanager
def replacing_folder(path: Path) -> Iterator[Path]:
    """Yield a temporary folder beside `path`; on success it takes the place of `path`.

    If the body raises, the old folder (if any) stays as it was.

    Raises:
        FileError: `check_folder` refuses it, its parent cannot be written, or the disk is full.
    """
    check_folder(path)
    make_folder(path.parent)
    try:
        with temporary_beside(path, Path.mkdir) as temporary:
            try:
                yield temporary
                _replace(path, temporary)
            finally:
                shutil.rmtree(temporary, ignore_errors=True)
    except OSError as error:
        raise FileError(f"cannot write '{path}': {error.strerror or error}") from error


def _replace(path: Path, new: Path) -> None:
    """Put a folder in the place of another, which comes back if that fails."""
    if not path.exists():
        new.rename(path)
        return
    old = name_aside(new, path)
    path.rename(old)
    try:
        new.rename(path)
    except BaseException:
        old.rename(path)
        raise
    shutil.rmtree(old, ignore_errors=True)
