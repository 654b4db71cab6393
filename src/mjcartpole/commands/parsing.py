"""From the words of a command line to a command, or to one line about why there is none."""

import contextlib
import io
import re
from collections.abc import Sequence

import tyro

from mjcartpole.commands.options import Command, UsageError
from mjcartpole.commands.plain import plain
from mjcartpole.commands.words import LISTS, rewritten
from mjcartpole.errors import check_known, nearest


def parse(argv: Sequence[str]) -> Command:
    """Return the command that a command line means.

    Raises:
        ConfigError: A value makes no sense.
        UsageError: A word of it is not understood.
        SystemExit: With code 0, after `--help`.
    """
    words = rewritten(argv)
    return plain(words) or _by_tyro(words)


def _by_tyro(words: list[str]) -> Command:
    from mjcartpole.commands.registry import grammar

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
    """Return in one line why a command line was not understood, and where help is.

    Raises:
        UsageError: It names no command that there is.
    """
    from mjcartpole.commands.registry import COMMANDS, name_of

    named = {name_of(command): command for command in COMMANDS}
    if not words[0].startswith("-"):
        check_known("command", words[0], named, UsageError)
    if words[0] in named and (said := named[words[0]].explain(words)):
        return said
    name = words[0] if words[0] in named else ""
    return f"{_one_line(complaint, name)}; see mjcartpole {f'{name} ' if name else ''}--help"


def _one_line(complaint: str, command: str) -> str:
    """Return a tyro error box as one line: its message, and which flag of a command was meant.

    The first line is a title; rules of dashes separate the message from what follows: flags, each
    with its help and the commands that have it.
    """
    lines = [line.strip("│╭╮╰╯ ") for line in complaint.splitlines()[1:]]
    text = "\n".join("" if set(line) <= {"─", "-"} else line for line in lines)
    message, *_ = text.strip().split("\n\n")
    said = message.replace("\n", " ").rstrip(".")
    similar = re.findall(r"^\W{2,}(--\S+)(.*)((?:\n(?!\W{2,}--).*)*)", complaint, re.MULTILINE)
    flags = {
        flag: f"{flag}{takes.rstrip(' │')}"
        for flag, takes, told in similar
        if f"in mjcartpole {command} --help" in told
    }
    asked = re.search(r"--[\w-]+", said)
    return said + "".join(
        f"; perhaps you meant {flags[near]}" for near in nearest(asked and asked[0], flags)[:1]
    )
