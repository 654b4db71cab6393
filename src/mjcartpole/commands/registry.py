"""Every command of the command line: a file each, and its entry here."""

import functools
import operator
from collections.abc import Sequence
from typing import Annotated, Any, Final

import tyro

from mjcartpole.commands.doctor import Doctor
from mjcartpole.commands.evaluate import Evaluate
from mjcartpole.commands.model import Model
from mjcartpole.commands.options import Command
from mjcartpole.commands.page import Page
from mjcartpole.commands.parity import Parity
from mjcartpole.commands.plot import Plot
from mjcartpole.commands.render import Render
from mjcartpole.commands.study import Study
from mjcartpole.commands.train import Train
from mjcartpole.commands.transfer import Transfer
from mjcartpole.commands.watch import Watch

COMMANDS: Final[list[type[Command]]] = [
    Train,
    Evaluate,
    Render,
    Page,
    Parity,
    Doctor,
    Model,
    Transfer,
    Plot,
    Study,
    Watch,
]


def name_of(command: type[Command]) -> str:
    """Return the word that a command is called by."""
    return command.__name__.lower()


def grammar(words: Sequence[str]) -> Any:  # noqa: ANN401 - a union that is made here
    """Return the type that tyro reads a command line as; its words may decide some defaults.

    Raises:
        ConfigError: A word that does makes no sense.
    """
    subcommands = []
    for command in COMMANDS:
        default = command.default(words) if words[:1] == [name_of(command)] else None
        given: dict[str, Any] = {} if default is None else {"default": default}
        subcommands.append(Annotated[command, tyro.conf.subcommand(name_of(command), **given)])
    return functools.reduce(operator.or_, subcommands)
