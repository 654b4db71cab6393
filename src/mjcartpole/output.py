"""Standard output and error that no terminal, pipe or disk can turn into a command's failure.

What an encoding lacks is spelled in ASCII; what nobody takes any more is dropped in silence, as a
training that writes to a log file would go on.
"""

import codecs
import contextlib
import errno
import io
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TextIO

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

ERASE: Final = "\r\x1b[K"
"""What empties the line of a terminal that a bar may be on."""

FAILED: Final = 2
"""The exit code of a command that could not do all that was asked of it."""

_DEGRADES: Final = "mjcartpole.degrades"
_PLAIN: Final = {
    **{"→": "->", "≤": "<=", "≥": ">=", "…": "...", "°": " deg", "±": "+-", "²": "^2"},
    **{"\N{MULTIPLICATION SIGN}": "x", "\N{MINUS SIGN}": "-", "·": ".", "•": "*"},
    **dict.fromkeys("\N{EN DASH}─━", "-") | dict.fromkeys("│┃", "|"),
    **dict.fromkeys("╭╮╰╯├└", "+"),
}
"""How signs that are printed here look in ASCII."""

_ESCAPED_BYTE: Final = 0xDC00
"""A byte of a file name that is no text is this much more, as a character of Python's."""

_WAIT: Final = 0.01


@contextlib.contextmanager
def patient_output() -> Iterator[None]:
    """Have everything that is printed inside degrade instead of failing; see `stdout_problem`."""
    _fill_closed()
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = map(_patient, before)
    try:
        yield
    finally:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        sys.stdout, sys.stderr = before


def stdout_problem() -> OSError | None:
    """Return what became of the first words that could not be written; None if all were taken."""
    sys.stdout.flush()
    buffer = getattr(sys.stdout, "buffer", None)
    return getattr(getattr(buffer, "raw", buffer), "problem", None)


def has_left(problem: OSError) -> bool:
    """Return whether a reader wants no more (`… | head`), which is nobody's mistake."""
    # Windows calls a pipe that nobody reads an invalid argument.
    return isinstance(problem, ConnectionError) or problem.errno == errno.EINVAL


def _fill_closed() -> None:
    """Open what was closed (`>&-`), lest the next file be taken for a standard stream."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)


def _patient(stream: TextIO | None) -> TextIO:
    if stream is None:
        return Path(os.devnull).open("w", encoding="utf-8")
    if not isinstance(stream, io.TextIOWrapper):
        return stream  # A notebook's, or a test's.
    stream.flush()
    buffer = stream.buffer
    raw: Any = getattr(buffer, "raw", buffer)  # `python -u` has no buffer.
    return io.TextIOWrapper(
        io.BufferedWriter(_Patient(raw)),
        encoding=stream.encoding,
        errors=_DEGRADES,
        line_buffering=stream.line_buffering or stream.write_through,
    )


class _Patient(io.RawIOBase):
    """Writes until it fails, and then takes everything without a word.

    Attributes:
        problem: Why it failed; None if it has not.
    """

    def __init__(self, raw: io.RawIOBase) -> None:
        self.problem: OSError | None = None
        self._raw = raw

    def writable(self) -> bool:
        return True

    def isatty(self) -> bool:
        return self._raw.isatty()

    def fileno(self) -> int:
        return self._raw.fileno()

    def write(self, data: "ReadableBuffer") -> int:
        while self.problem is None:
            try:
                written = self._raw.write(data)
            except OSError as error:
                self.problem = error
                break
            if written is not None:
                return written
            time.sleep(_WAIT)  # A pipe that does not block is full.
        return memoryview(data).nbytes


def _degrade(error: UnicodeError) -> tuple[str, int]:
    assert isinstance(error, UnicodeEncodeError)
    signs = error.object[error.start : error.end]
    return "".join(_PLAIN.get(sign) or _escaped(sign) for sign in signs), error.end


def _escaped(sign: str) -> str:
    byte = ord(sign) - _ESCAPED_BYTE
    return f"\\x{byte:02x}" if 0x80 <= byte <= 0xFF else ascii(sign)[1:-1]


codecs.register_error(_DEGRADES, _degrade)
