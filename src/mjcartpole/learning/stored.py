"""JSON that somebody else may have written: in bounded memory, checked field by field."""

import json
import math
import reprlib
from collections.abc import Callable, Mapping
from pathlib import Path
from types import UnionType
from typing import Any, Final, Literal, TypeVar, Union, get_args, get_origin

from mjcartpole.errors import RunError
from mjcartpole.files import brief, read_bytes

MOST_BYTES: Final = 2**23
"""Of a document other than a policy: a hundred thousand seeds are a few megabytes."""

MOST_VALUES: Final = 2**22
"""The largest policy has three quarters of them."""

MOST_CHARACTERS: Final = 4096
"""Of a text: as many as a path may have."""

MOST_DIGITS: Final = 39
"""Of a whole number: the state of a random generator has 128 bits."""

Made = TypeVar("Made")

Kind = Any
"""What a value must be: a type, a Literal, a union of kinds, a tuple of one kind, or `Fields`."""

Fields = Mapping[str, Kind]
"""What a document must hold, no more and no less; a name that ends in "?" may be missing."""


def read_document(
    path: Path, fields: Fields | None, make: Callable[[dict[str, Any]], Made], otherwise: str
) -> Made:
    """Return what a file of a run folder stands for.

    Its fields are checked; None leaves that to `make`, which makes of the values what they stand
    for, or raises ValueError. `otherwise` is said of a file that does not stand for it.

    Raises:
        RunError: It cannot be read, or holds something else.
    """
    content = read_bytes(path, MOST_BYTES, refusal=RunError)
    try:
        values = parse(content)
        return make(values if fields is None else checked(values, fields))
    except ValueError as error:
        raise RunError(f"'{path}' {otherwise}: {brief(error)}") from error


def parse(content: bytes) -> Any:
    """The value that JSON stands for.

    Raises:
        ValueError: It is no JSON, or holds more, deeper or larger values than a run has.
    """
    if sum(content.count(mark) for mark in (b",", b"[", b"{")) > MOST_VALUES:
        raise ValueError(f"it holds more than {MOST_VALUES:,} values")
    try:
        return json.loads(
            content.decode("utf-8"),
            parse_int=_whole,
            parse_float=_finite,
            parse_constant=_finite,
            object_pairs_hook=_distinct,
        )
    except RecursionError:
        raise ValueError("its values are nested too deep") from None


def checked(values: Any, fields: Fields) -> dict[str, Any]:
    """The values, if they are what the fields ask for.

    Raises:
        ValueError: One is missing, of another kind, or unknown.
    """
    if type(values) is not dict:
        raise ValueError(f"{reprlib.repr(values)} has no named values")
    kinds = {name.rstrip("?"): kind for name, kind in fields.items()}
    for name, value in values.items():
        if name not in kinds:
            raise ValueError(f"{reprlib.repr(name)} is unknown; known are {', '.join(kinds)}")
        if isinstance(kinds[name], Mapping):
            checked(value, kinds[name])
        elif not fits(value, kinds[name]):
            raise ValueError(f"{name} cannot be {reprlib.repr(value)}")
    if missing := [name for name in fields if name[-1] != "?" and name not in values]:
        raise ValueError(f"{', '.join(missing)} is missing")
    return values


def fits(value: object, kind: Kind) -> bool:
    """Return whether a value is of a kind; a list stands for a tuple."""
    origin: Any = get_origin(kind)
    inner = get_args(kind)
    if origin is Literal:
        return type(value) is str and value in inner
    if origin is tuple:
        return type(value) is list and all(fits(each, inner[0]) for each in value)
    if origin in {Union, UnionType}:
        return any(fits(value, each) for each in inner)
    if kind is str and type(value) is str and len(value) <= MOST_CHARACTERS:
        # Names of files may hold bytes that are no text; a line break is another matter.
        return value.encode("utf-8", "ignore").decode("utf-8").isprintable()
    return kind is not str and type(value) in ((float, int) if kind is float else (kind,))


def _whole(digits: str) -> int:
    if len(digits.lstrip("-")) > MOST_DIGITS:
        raise ValueError(f"a number in it has more than {MOST_DIGITS} digits")
    return int(digits)


def _finite(digits: str) -> float:
    value = float(digits)
    if not math.isfinite(value):
        raise ValueError("a number in it is not finite")
    return value


def _distinct(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    values = dict(pairs)
    if len(values) < len(pairs):
        raise ValueError("it gives a name two values")
    return values
