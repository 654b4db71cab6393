"""The film that a training leaves of its run: which one it is, and its removal."""

import contextlib
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from mjcartpole.commands.options import VIDEOS
from mjcartpole.errors import RunError
from mjcartpole.learning.documents import read_summary
from mjcartpole.learning.naming import shortened

MOST_NAME: Final = 216
"""Bytes of a video's name; that of a file may have 255."""


def remove_film(folder: Path) -> None:
    """Remove the film of a run that is about to be replaced, if it is where training puts it."""
    with contextlib.suppress(RunError):
        path = own_film(folder, read_summary(folder))
        if path is not None:
            path.unlink(missing_ok=True)


def own_film(folder: Path, summary: Mapping[str, Any]) -> Path | None:
    """Return the film that a run's summary names, if a training of it may have written it."""
    shown, name = Path(str(summary.get("video", ""))), shortened(folder.resolve().name, MOST_NAME)
    own = re.fullmatch(re.escape(name) + r"(-\d+)?\.(mp4|gif)", shown.name)
    return shown if own and shown.parent == VIDEOS else None
