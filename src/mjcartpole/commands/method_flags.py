"""Flags that only some learning methods have: which one a command line gives in vain."""

import dataclasses
import re
from collections.abc import Iterable, Sequence
from typing import Any, Final

from mjcartpole.errors import nearest
from mjcartpole.learning.methods import METHODS, method_named

_FLAG: Final = re.compile(r"--(no[-_])?([^=]+)(=.*)?", re.DOTALL)


def lacking(words: Sequence[str], method: str, others: Iterable[str]) -> str | None:
    """Return that the method lacks an option that is given, whose it is, and what the method has.

    `others` are options that do not belong to any method. None where no word looks like an option
    that some method has.
    """
    its, of_none = flags_of(method), list(others)
    of_any = [flag for each in METHODS for flag in flags_of(each)]
    for flag in given(words):
        if flag in its or not (near := nearest(flag, [*of_none, *of_any])) or near[0] in of_none:
            continue
        owners = [each for each in METHODS if near[0] in flags_of(each)]
        whose = "" if near[0] in its else f" (--{near[0]} belongs to {', '.join(owners)})"
        close = nearest(flag, its)
        have = ", ".join(f"--{each}" for each in [*close, *(e for e in its if e not in close)])
        return (
            f"method {method!r} has no option --{flag}{whose}; its options are {have}; "
            f"see mjcartpole train --method {method} --help"
        )
    return None


def flags_of(method: str) -> list[str]:
    """Return the flags that are a method's own, without their dashes."""
    return fields_of(method_named(method).Parameters)


def fields_of(group: Any) -> list[str]:  # noqa: ANN401 - any dataclass
    """Return the flags that a dataclass makes, without their dashes."""
    return [field.name.replace("_", "-") for field in dataclasses.fields(group)]


def given(words: Sequence[str]) -> list[str]:
    """Return the flags among words, without their dashes and a `no` before them."""
    found = [match for word in words if (match := _FLAG.fullmatch(word))]
    return [match[2].replace("_", "-") for match in found]
