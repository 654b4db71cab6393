"""Command lines of plain flags, read at once: for tyro to see all that there could be takes longer.

Whatever is more than that, a mistake above all, is left to tyro, which says what is wrong with it.
"""

import dataclasses
import importlib
import importlib.util
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import NoneType
from typing import Any, Final, Literal, cast, get_args, get_origin

from mjcartpole.commands.options import Command
from mjcartpole.errors import MjCartPoleError

_KINDS: Final = (int, float, str, Path)

Flags = dict[str, tuple[str, Any]]
"""By flag: the field that it is for, and the type of its value; the value itself of a yes or no."""


def plain(words: Sequence[str]) -> Command | None:
    """Return the command that words mean, where all of them are flags with at most one value."""
    command = _named(*words[:1])
    if command is None:
        return None
    try:
        default = command.default(words) or command()
        return cast(Command, _with(default, _values(words[1:], dict(_flags(default)))))
    except (LookupError, TypeError, ValueError, MjCartPoleError):
        return None


def _named(name: str = "") -> type[Command] | None:
    """Return the command of a name, whose file is called alike, without a look at all others."""
    module = f"mjcartpole.commands.{name}"
    if not (name.isidentifier() and importlib.util.find_spec(module)):
        return None
    found = getattr(importlib.import_module(module), name.capitalize(), None)
    return found if isinstance(found, type) and issubclass(found, Command) else None


def _flags(group: Any) -> Iterator[tuple[str, tuple[str, Any]]]:  # noqa: ANN401 - any dataclass
    """Yield what `Flags` are of a group, and of those that it includes."""
    for field in dataclasses.fields(group):
        value, flag = getattr(group, field.name), field.name.replace("_", "-")
        if dataclasses.is_dataclass(value):
            yield from _flags(value)
        elif field.type is bool:
            yield from ((f"--{flag}", (field.name, True)), (f"--no-{flag}", (field.name, False)))
        else:
            yield f"--{flag}", (field.name, field.type)


def _values(words: Sequence[str], flags: Flags) -> dict[str, Any]:
    """Return the fields' values; LookupError or ValueError where a word is not plain."""
    found, left = dict[str, Any](), list(reversed(words))
    while left:
        flag, sign, text = left.pop().partition("=")
        name, kind = flags[flag]
        takes_none = isinstance(kind, bool)
        if name in found or (sign and takes_none):
            raise ValueError(flag)
        found[name] = kind if takes_none else _read(kind, text if sign else left.pop())
    return found


def _read(kind: Any, text: str) -> Any:  # noqa: ANN401 - as the type says
    if NoneType in get_args(kind):
        (kind,) = {*get_args(kind)} - {NoneType}
    if get_origin(kind) is Literal and text in get_args(kind):
        return text
    if kind not in _KINDS or text in {"", "None"} or text.startswith("-"):
        raise ValueError(text)
    return kind(text)


def _with(group: Any, values: dict[str, Any]) -> Any:  # noqa: ANN401 - any dataclass
    """Return a group, and those that it includes, with other values."""
    changed = {}
    for field in dataclasses.fields(group):
        old = getattr(group, field.name)
        new = _with(old, values) if dataclasses.is_dataclass(old) else values.get(field.name, old)
        if new is not old:
            changed[field.name] = new
    return dataclasses.replace(group, **changed) if changed else group
