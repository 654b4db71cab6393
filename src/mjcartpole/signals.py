"""Ctrl-C, SIGTERM and a terminal that is closed, so that what was learned is kept."""

import contextlib
import signal
import threading
from collections.abc import Iterator
from types import FrameType

EXIT_CODES = {
    getattr(signal, name): 128 + getattr(signal, name)
    for name in ("SIGINT", "SIGTERM", "SIGHUP")
    if hasattr(signal, name)  # Windows knows no SIGHUP.
}


class Interrupted(KeyboardInterrupt):
    """Somebody asked the program to end.

    Attributes:
        exit_code: What a shell expects after the signal.
    """

    def __init__(self, message: str = "interrupted", number: int = signal.SIGINT) -> None:
        """Say what is to be printed, and which signal it was."""
        super().__init__(message)
        self.exit_code = EXIT_CODES[signal.Signals(number)]


class StopSignals:
    """Notes a signal while there is something to be finished, and raises it otherwise."""

    def __init__(self) -> None:
        """Nothing is caught yet."""
        self.number = 0
        self._deferred = False

    def stop(self) -> bool:
        """Return whether a signal has come."""
        return self.number != 0

    def raise_noted(self) -> None:
        """Raise `Interrupted` if a signal has come."""
        if self.stop():
            raise Interrupted(number=self.number)

    @contextlib.contextmanager
    def caught(self) -> Iterator[None]:
        """Catch these signals inside; they raise `Interrupted`.

        One that is ignored stays so, as `nohup` wants it. Only Ctrl-C's is caught all the same:
        shells have their background jobs ignore it, and `kill -INT` shall reach those.
        """
        if threading.current_thread() is not threading.main_thread():
            yield  # Only the main thread may; it decides for the others.
            return
        before = {
            number: signal.signal(number, self._handle)
            for number in EXIT_CODES
            if number == signal.SIGINT or signal.getsignal(number) is not signal.SIG_IGN
        }
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    @contextlib.contextmanager
    def deferred(self) -> Iterator[None]:
        """Inside, the first signal only makes `stop` true; a second one raises."""
        self._deferred = True
        try:
            yield
        finally:
            self._deferred = False

    def _handle(self, number: int, frame: FrameType | None) -> None:
        again, self.number = self.stop(), number
        if again or not self._deferred:
            raise Interrupted(number=number)
