"""A bar on stderr that says how far something has come: on terminals only, and gone at the end."""

import os
import shutil
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from typing import Final, Self, TypeVar

from mjcartpole.output import ERASE

T = TypeVar("T")

_HIDE, _SHOW = "\x1b[?25l", "\x1b[?25h"  # a terminal's cursor

WIDTH: Final = 40
EVERY: Final = 0.1
"""Seconds between two looks at what has been done."""


class Bar:
    """Draws itself from a thread of its own, since the work may be in compiled code for a while.

    Attributes:
        shown: Whether there is a terminal to draw it on.
        done: How much has been done.
        said: What else there is to say.
    """

    def __init__(self, doing: Callable[[], str], total: int = 0, unit: str = "") -> None:
        """Say what is done at the moment, and how many of what are to be done; 0: nobody knows."""
        self.shown = sys.stderr.isatty() and os.environ.get("TERM") != "dumb"
        self.done, self.said = 0, ""
        self._doing, self._total, self._unit = doing, total, unit
        self._over = threading.Event()
        self._drawer = threading.Thread(target=self._draw, daemon=True)

    def __enter__(self) -> Self:
        self._first, self._began = self.done, time.monotonic()
        if self.shown:
            self._drawer.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._over.set()
        if self.shown:
            self._drawer.join()

    def track(self, things: Iterable[T]) -> Iterator[T]:
        """Yield things; each is done when the next one is asked for."""
        for thing in things:
            yield thing
            self.done += 1

    def line(self) -> str:
        """Return what is shown at the moment."""
        doing, done, total = self._doing(), self.done, self._total
        if not total:
            return doing
        full = WIDTH * min(done, total) // total
        bar = "━" * full + "─" * (WIDTH - full)
        return f"{doing} {bar} {done:,}/{total:,} {self._unit}{self.said}{self._left()}"

    def _left(self) -> str:
        """Return how long it will take at the pace so far; nothing before there is one."""
        if self.done <= self._first:
            return ""
        pace = (time.monotonic() - self._began) / (self.done - self._first)
        minutes, seconds = divmod(round(pace * max(0, self._total - self.done)), 60)
        return f" {minutes // 60}:{minutes % 60:02d}:{seconds:02d}"

    def _draw(self) -> None:
        print(_HIDE, end="", file=sys.stderr)
        while not self._over.wait(EVERY):
            columns = shutil.get_terminal_size().columns - 1
            print(f"{ERASE}{self.line()[:columns]}", end="", file=sys.stderr, flush=True)
        print(ERASE + _SHOW, end="", file=sys.stderr, flush=True)
