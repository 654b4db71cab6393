"""From the words of a command line to a command, or to one line about why there is none."""

import contextlib
import io
from collections.abc import Sequence

import tyro

from mjcartpole.commands.options import Command, UsageError
from mjcartpole.commands.registry import COMMANDS, grammar, name_of
from mjcartpole.commands.words import LISTS, rewritten


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
