"""The command line: parse, run the command, word what went wrong.

Results go to stdout, progress and errors to stderr. Exit codes: 0, 2 for a user's mistake or for
results that could not be printed, 130 after Ctrl-C.
"""

import contextlib
import io
import logging
import sys
from collections.abc import Sequence
from typing import NoReturn

import tyro

from mjcartpole import __version__
from mjcartpole.commands.options import FAILED, Command, UsageError
from mjcartpole.commands.registry import COMMANDS, grammar, name_of
from mjcartpole.commands.words import LISTS, rewritten
from mjcartpole.errors import MjCartPoleError
from mjcartpole.output import has_left, patient_output, stdout_problem
from mjcartpole.signals import Interrupted, StopSignals

INTERRUPTED = 130


def main(argv: Sequence[str] | None = None) -> NoReturn:
    """Run a command and exit with its code."""
    with patient_output():
        code = _exit_code(list(sys.argv[1:] if argv is None else argv))
        problem = stdout_problem()
        if problem is not None and not has_left(problem):
            reason = problem.strerror or problem
            _complain(f"error: stdout could not be written ({reason}); all else went on without it")
            code = code or FAILED
    sys.exit(code)


def _exit_code(argv: list[str]) -> int:
    try:
        return _run(argv)
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
    print(f"mjcartpole: {message}", file=sys.stderr)


def _run(argv: list[str]) -> int:
    if argv in (["--version"], ["-V"]):
        print(f"mjcartpole {__version__}")
        return 0
    command = parse(argv or ["--help"])
    _report_to_stderr()
    _import_mujoco()
    return command.run()


def _import_mujoco() -> None:
    """Import what each command needs; MuJoCo's modules lose an interrupt that comes meanwhile.

    Raises:
        Interrupted: One came.
    """
    signals = StopSignals()
    with signals.caught(), signals.deferred():
        from mjcartpole.commands import policies  # noqa: F401, PLC0415 - not for --help
    if signals.stop():
        raise Interrupted(number=signals.number)


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


def parse(argv: Sequence[str]) -> Command:
    """Return the command that a command line means.

    Raises:
        ConfigError: A value makes no sense.
        UsageError: A word of it is not understood.
        SystemExit: With code 0, after `--help`.
    """
    words = rewritten(argv)
    complaint = io.StringIO()
    try:
        with contextlib.redirect_stderr(complaint), LISTS:
            command: Command = tyro.cli(
                grammar(words),
                args=words,
                prog="mjcartpole",
                description="CartPole-v1 as real physics: train a Q-table, evaluate it, film it. "
                "mjcartpole --version prints the version.",
            )
    except SystemExit as stop:
        if not stop.code:
            raise
        raise UsageError(_explained(words, complaint.getvalue())) from None
    return command


def _explained(words: list[str], complaint: str) -> str:
    """Return in one line why a command line was not understood, and where help is."""
    named = [command for command in COMMANDS if name_of(command) == words[0]]
    for command in named:
        if said := command.explain(words):
            return said
    return f"{_one_line(complaint)}; see mjcartpole {f'{words[0]} ' if named else ''}--help"


def _one_line(complaint: str) -> str:
    """Return a tyro error box as one line: its message, and what it thinks was meant.

    The first line is a title; rules of dashes separate the message from what follows.
    """
    lines = [line.strip("│╭╮╰╯ ") for line in complaint.splitlines()[1:]]
    text = "\n".join("" if set(line) <= {"─", "-"} else line for line in lines)
    message, *others = [block.splitlines() for block in text.strip().split("\n\n")]
    for block in others:
        if block[0].startswith("Perhaps you meant") and len(block) > 1:
            return f"{' '.join(message)}; perhaps you meant {block[1]}"
    return " ".join(message).rstrip(".")
