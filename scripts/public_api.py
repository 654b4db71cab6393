"""The public names, as text: signatures, environments, commands and their flags.

`python scripts/public_api.py` writes docs/api.txt; a test says when it is out of date, so that a
change of what others build on is seen, and meant. Types are left out: how they are written changes
from one Python to the next.
"""

import contextlib
import inspect
import io
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import gymnasium

import mjcartpole
from mjcartpole import errors
from mjcartpole.commands.options import Command
from mjcartpole.commands.parsing import parse
from mjcartpole.commands.registry import COMMANDS, name_of

FILE: Final = Path(__file__).resolve().parents[1] / "docs" / "api.txt"
HEAD: Final = "# What others build on; see versions.md. Made by: python scripts/public_api.py"


def written() -> str:
    """Return the whole of it."""
    parts = [HEAD, *names(), *exceptions(), *environments(), *commands()]
    return "\n".join(parts) + "\n"


def names() -> Iterator[str]:
    """Yield a line for each public name, and one for each member of a class."""
    for name in sorted(mjcartpole.__all__):
        value = getattr(mjcartpole, name)
        if inspect.isclass(value):
            yield f"\nmjcartpole.{name}{signature(value)}"
            yield from (f"    .{line}" for line in members(value))
        else:
            yield f"\nmjcartpole.{name}{signature(value) if callable(value) else f' = {value!r}'}"


def members(kind: type) -> Iterator[str]:
    """Yield public fields, properties and methods of a class that are ours, by name."""
    fields = set(getattr(kind, "__dataclass_fields__", ()))
    found = {}
    for one in reversed([one for one in kind.__mro__ if one.__module__.startswith("mjcartpole")]):
        found.update({name: value for name, value in vars(one).items() if name[0] != "_"})
    for name in sorted(found.keys() | fields):
        value: Any = getattr(found.get(name), "__func__", found.get(name))
        is_method = inspect.isfunction(value) and name not in fields
        yield name + (signature(value) if is_method else "")


def signature(value: Any) -> str:  # noqa: ANN401
    """Return names and defaults of parameters."""
    bare = []
    for parameter in inspect.signature(value).parameters.values():
        default = plain(parameter.default)
        bare.append(parameter.replace(annotation=inspect.Parameter.empty, default=default))
    return str(inspect.Signature(bare))


def plain(default: Any) -> Any:  # noqa: ANN401
    """Return a default whose text is the same in each process: a function's has its address."""
    if isinstance(default, mjcartpole.Task):
        return Named(f"Task({default.name!r})")
    return Named(default.__name__) if inspect.isfunction(default) else default


class Named(str):
    """Text that shows without quotes."""

    __slots__ = ()
    __repr__ = str.__str__


def exceptions() -> Iterator[str]:
    """Yield each exception, and what it is one of."""
    yield ""
    for name, value in sorted(vars(errors).items()):
        if inspect.isclass(value) and issubclass(value, Exception):
            bases = ", ".join(base.__name__ for base in value.__bases__)
            yield f"mjcartpole.errors.{name}({bases})"


def environments() -> Iterator[str]:
    """Yield a line for each environment that importing registers."""
    yield ""
    for name in sorted(name for name in gymnasium.registry if name.startswith("mjcartpole/")):
        spec = gymnasium.spec(name)
        limits = f"{spec.max_episode_steps} steps, threshold {spec.reward_threshold}"
        yield f"gymnasium.make({name!r}): {limits}"


def commands() -> Iterator[str]:
    """Yield each command with its flags."""
    yield ""
    for command in COMMANDS:
        yield f"mjcartpole {name_of(command)}\n    {' '.join(flags(command))}"


def flags(command: type[Command]) -> list[str]:
    """Return flags by name, read from the help; those that say no are not named again."""
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.suppress(SystemExit):
        parse([name_of(command), "--help"])
    heads = re.findall(r"^[│|] (-.*?)(?:  |$)", said.getvalue(), re.MULTILINE)
    found = {word for head in heads for word in re.findall(r"(?<!\S)--?[a-z][a-z-]*", head)}
    return sorted(word for word in found if word not in {"-h", "--help"} and "--no-" not in word)


if __name__ == "__main__":
    FILE.write_text(written(), encoding="utf-8", newline="\n")
