"""The words of a command line as people write them: edits in several places, commas in lists."""

import os
import re
from collections.abc import Sequence
from typing import Any, Final, get_args

from tyro.constructors import ConstructorRegistry, PrimitiveConstructorSpec, PrimitiveTypeInfo

from mjcartpole.commands.options import UsageError

LISTS = ConstructorRegistry()
"""How tyro reads a flag that takes several numbers or names: with commas between them too. And one
that is yes, no, or left to what is found: as a flag alone, with --no- before it, or with a word."""

_YES_OR_NO: Final = {"yes": True, "no": False}
_SAID: Final = {None: "where all is alike", True: "yes", False: "no"}

_SHORT: Final = {"--no-mirror": ("--mirror", "no")}

_DASHED_FILE = re.compile(r"-(?!-|o=).+\.(mp4|gif|webp|png|svg|pdf|csv|xml|json)")
"""A file whose name begins with a dash: no flag with a single one looks like this."""


_GATHERED: Final = {"--set": "=", "--vary": "=", "--push": "@"}
"""Flags whose values may stand in several places, and what each value has in it."""


def rewritten(words: Sequence[str]) -> list[str]:
    """Return the words with all edits after one `--set`, wherever and however often they stood.

    The same goes for what varies, and for shoves.
    """
    words = [part for word in words for part in _SHORT.get(word, (word,))]
    words = [f"./{word}" if _DASHED_FILE.fullmatch(word) else word for word in words]
    for flag, sign in _GATHERED.items():
        words = _gathered(words, flag, sign)
    return words


def _gathered(words: Sequence[str], flag: str, sign: str) -> list[str]:
    others, values, follows, first = list[str](), list[str](), False, False
    for word in words:
        if word == flag or word.startswith(f"{flag}="):
            values += [word.removeprefix(f"{flag}=")] if "=" in word else []
            follows, first = True, "=" not in word
        elif follows and (first or sign in word) and (sign == "@" or not word.startswith("-")):
            # The first one is meant as a value, even where it is none.
            values.append(word)
            first = False
        else:
            follows = False
            others.append(word)
    return others if len(others) == len(words) else [*others, flag, *values]


def value_of(flag: str, words: Sequence[str], otherwise: str) -> str:
    """Return the value that the words give to a flag; of one without a value tyro complains."""
    for word, following in zip(words, [*words[1:], "--"], strict=True):
        if word == flag and not following.startswith("--"):
            return following
        if word.startswith(f"{flag}="):
            return word.removeprefix(f"{flag}=")
    return otherwise


_KINDS: Final = {int: "whole number", float: "number", str: "name"}


@LISTS.primitive_rule
def _list_rule(info: PrimitiveTypeInfo) -> PrimitiveConstructorSpec[Any] | None:
    kind, *more = get_args(info.type) or (None,)
    if info.type_origin is not tuple or kind not in _KINDS or more != [...]:
        return None  # A path may have commas.
    return PrimitiveConstructorSpec(
        nargs="*",
        metavar="[{0} [{0} ...]]".format(kind.__name__.upper()),
        instance_from_str=lambda words: _read_all(kind, words),
        is_instance=lambda value: isinstance(value, tuple),
        str_from_instance=lambda values: list(map(str, values)),
    )


@LISTS.primitive_rule
def _yes_or_no_rule(info: PrimitiveTypeInfo) -> PrimitiveConstructorSpec[Any] | None:
    if info.type != (bool | None):
        return None
    return PrimitiveConstructorSpec(
        nargs=(0, 1),
        metavar="[{yes,no}]",
        instance_from_str=lambda words: _read_yes_or_no(*words),
        is_instance=lambda value: value is None or isinstance(value, bool),
        str_from_instance=lambda value: [_SAID[value]],
    )


def _read_yes_or_no(word: str = "yes") -> bool:
    if word not in _YES_OR_NO:
        raise ValueError(f"'{word}' is neither yes nor no")
    return _YES_OR_NO[word]


def _read_all(kind: Any, words: Sequence[str]) -> tuple[Any, ...]:  # noqa: ANN401 - one of three
    found = tuple(_read(kind, value) for word in words for value in _values(word))
    if not found:
        raise ValueError("a value is missing")
    return found


def _read(kind: Any, text: str) -> Any:  # noqa: ANN401 - one of three
    try:
        return kind(text)
    except ValueError:
        raise ValueError(f"'{text}' is no {_KINDS[kind]}") from None


def _values(word: str) -> list[str]:
    """Return the values in a word: 1,3 has two, a.b=1,c.d=2 too, and a.b=1,2 is one."""
    if "=" in word:
        return re.split(r",(?=[\w.:]+=)", word)
    if os.path.exists(word):  # noqa: PTH110 - a Path raises where a name is too long
        return [word]
    if word.startswith("[") and word.endswith("]"):
        word = word[1:-1]
    if re.search(r",\s*,", word):
        raise UsageError(f"'{word}' has nothing between two commas; give values as 1,3,6,8")
    return [value for value in re.split(r"[,\s]+", word) if value]
