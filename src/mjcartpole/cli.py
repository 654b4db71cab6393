"""The command line: parse, run the command, word what went wrong.

Results go to stdout, progress and errors to stderr. Exit codes: 0, 2 for a user's mistake or for
results that could not be printed, 130 after Ctrl-C.
"""

import contextlib
import gc
import logging
import os
import shutil
import sys
from collections.abc import Iterator, Sequence
from typing import NoReturn

from mjcartpole import __version__
from mjcartpole.errors import MjCartPoleError
from mjcartpole.garbage import collect_rarely
from mjcartpole.output import ERASE, FAILED, has_left, patient_output, stdout_problem
from mjcartpole.packages import check_installed
from mjcartpole.signals import StopSignals

INTERRUPTED = 130
_FEWEST_COLUMNS = 40
"""In which help is laid out; tyro would never end in a few."""


def main(argv: Sequence[str] | None = None) -> NoReturn:
    """Run a command and exit with its code."""
    is_own = argv is None  # The process is this command's own.
    if is_own:
        collect_rarely()
    with patient_output():
        code = _exit_code(list(sys.argv[1:] if argv is None else argv), is_own)
        problem = stdout_problem()
        if problem is not None and not has_left(problem):
            reason = problem.strerror or problem
            _complain(f"error: stdout could not be written ({reason}); all else went on without it")
            code = code or FAILED
    sys.exit(code)


def _exit_code(argv: list[str], is_own: bool) -> int:
    try:
        return _run(argv, is_own)
    except SystemExit as stop:  # After --help.
        return int(stop.code or 0)
    except MjCartPoleError as error:
        for line in str(error).split("\n"):
            _complain(f"error: {line}")
        return FAILED
    except KeyboardInterrupt as interrupt:
        _complain(str(interrupt) or "interrupted")
        return int(getattr(interrupt, "exit_code", INTERRUPTED))


def _complain(message: str) -> None:
    print(f"{ERASE if sys.stderr.isatty() else ''}mjcartpole: {message}", file=sys.stderr)


def _run(argv: list[str], is_own: bool) -> int:
    if argv in (["--version"], ["-V"]):
        print(f"mjcartpole {__version__}")
        return 0
    check_installed("the command line", "tyro")
    from mjcartpole.commands.parsing import parse  # noqa: PLC0415 - after the check

    columns = max(_FEWEST_COLUMNS, shutil.get_terminal_size().columns)
    with _environment("COLUMNS", str(columns)):
        command = parse(argv or ["--help"])
    _report_to_stderr()
    _import_mujoco(is_own)
    return command.run()


def _import_mujoco(is_own: bool) -> None:
    """Import MuJoCo for the command; its modules lose an interrupt that comes meanwhile.

    In a process of the command's own MuJoCo has nobody to measure its steps for.

    Raises:
        Interrupted: One came.
    """
    signals = StopSignals()
    # For no window system: to look for one takes a while, and no command uses MuJoCo's renderer.
    with signals.caught(), signals.deferred(), _environment("MUJOCO_GL", "disable"):
        from mjcartpole.physics.library import stop_timers  # noqa: PLC0415 - not for --help

        if is_own:
            stop_timers()
            gc.freeze()  # What was imported is there to stay.
    signals.raise_noted()


@contextlib.contextmanager
def _environment(name: str, value: str) -> Iterator[None]:
    """Have a variable of the environment be another one meanwhile."""
    wanted = os.environ.get(name)
    os.environ[name] = value
    try:
        yield
    finally:
        del os.environ[name]
        if wanted is not None:
            os.environ[name] = wanted


class _ToStderr(logging.Handler):
    """One line per record on what is stderr at that time: a progress bar may have taken it over."""

    def emit(self, record: logging.LogRecord) -> None:
        _complain(record.getMessage())


def _report_to_stderr() -> None:
    log = logging.getLogger("mjcartpole")
    if not any(isinstance(handler, _ToStderr) for handler in log.handlers):
        log.addHandler(_ToStderr())
        log.setLevel(logging.INFO)
        log.propagate = False
