"""A model's file that somebody edits: what counts as a save."""

import hashlib
import time
from pathlib import Path
from typing import Final

from mjcartpole.errors import MjCartPoleError
from mjcartpole.physics.includes import read_whole

POLL: Final = 0.2
"""Seconds between two looks at the file."""
SETTLE: Final = 0.05
"""Seconds that a file must stay as it is: some editors empty it before they write it."""
PIECES: Final = 0.4
"""Seconds after which a broken file is taken for whole: some programs write in pieces."""


class SavedAgainError(Exception):
    """The file is not what it was when the work began."""


class Watched:
    """A model's file, together with what it includes.

    Attributes:
        path: Where it is.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._seen = ""
        self._looked = 0.0

    def is_there(self) -> bool:
        """Return whether there is a file at this moment; editors replace it by renaming another."""
        return self.path.is_file()

    def take(self) -> None:
        """Take what is there now as known."""
        self._seen = self._mark()

    def has_changed(self) -> bool:
        """Return whether something else than what was taken is there, and written to its end."""
        if self._mark() == self._seen or not self.is_there():
            return False
        before = None
        while (mark := self._mark()) != before:
            before = mark
            time.sleep(SETTLE)
        return mark != self._seen and self.is_there()

    def goes_on(self) -> bool:
        """Return whether more of the file is written in a moment."""
        until = time.monotonic() + PIECES
        while self._mark() == self._seen:
            if time.monotonic() > until:
                return False
            time.sleep(SETTLE)
        return True

    def check(self) -> None:
        """Raise `SavedAgainError` if it has changed; it looks only now and then."""
        now = time.monotonic()
        if now - self._looked >= POLL:
            self._looked = now
            if self.has_changed():
                raise SavedAgainError

    def _mark(self) -> str:
        """Return what the file and its includes say, in short: a touched file is no change."""
        try:
            text = self.path.read_bytes()
        except OSError:
            return "nothing"
        mark = hashlib.sha256(text)
        if b"<include" in text:
            try:
                whole = read_whole(text.decode("utf-8"), str(self.path), self.path.parent).text
            except (UnicodeDecodeError, MjCartPoleError) as error:
                whole = str(error)
            mark.update(whole.encode())
        return mark.hexdigest()
