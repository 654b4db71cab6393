"""The words of a command line, as people write them, made into those that tyro takes."""

import dataclasses
import os
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, get_args, get_origin, get_type_hints

from mjcartpole.commands.options import UsageError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

_DASHED_FILE = re.compile(r"-(?!-|o=).+\.(mp4|gif|webp|png|xml|json)")
"""A file whose name begins with a dash: no flag with a single one looks like this."""


def rewritten(words: Sequence[str], lists: set[str]) -> list[str]:
    """Return the words with all edits after one `--set`, and without commas in lists.

    Args:
        words: What was typed.
        lists: The flags whose values may have commas between them.

    Raises:
        UsageError: A list has a gap.
    """
    words = [f"./{word}" if _DASHED_FILE.fullmatch(word) else word for word in words]
    return _split_lists(_gather_edits(words), lists)


def value_of(flag: str, words: Sequence[str], otherwise: str) -> str:
    """Return the value that the words give to a flag."""
    for word, following in zip(words, [*words[1:], ""], strict=True):
        if word == flag:
            return following
        if word.startswith(f"{flag}="):
            return word.removeprefix(f"{flag}=")
    return otherwise


def list_flags(grammar: "DataclassInstance | type[DataclassInstance]") -> Iterator[str]:
    """Yield the flags of a command that take several numbers or names; a path may have commas.

    Args:
        grammar: A dataclass of flags, or one's instance.
    """
    hints = get_type_hints(grammar if isinstance(grammar, type) else type(grammar))
    for field in dataclasses.fields(grammar):
        hint = hints[field.name]
        part = getattr(grammar, field.name, hint)
        if dataclasses.is_dataclass(part):
            yield from list_flags(part)
        elif get_origin(hint) is tuple and get_args(hint)[0] is not Path and field.name != "set":
            yield f"--{field.name.replace('_', '-')}"


def _gather_edits(words: Sequence[str]) -> list[str]:
    """Return one --set with all edits, wherever and however often they were given."""
    others, edits, follows, first = [], list[str](), False, False
    for word in words:
        if word == "--set" or word.startswith("--set="):
            edits += _split_edits(word.removeprefix("--set=")) if "=" in word else []
            follows, first = True, "=" not in word
        elif follows and (first or "=" in word) and not word.startswith("-"):
            # The first one is meant as an edit, even where it is none.
            edits += _split_edits(word)
            first = False
        else:
            follows = False
            others.append(word)
    return [*others, "--set", *edits] if edits else others


def _split_edits(word: str) -> list[str]:
    """Return the edits of a word, which may have commas between them: a.b=1,c.d=2."""
    return re.split(r",(?=[\w.:]+=)", word)


def _split_lists(words: Sequence[str], lists: set[str]) -> list[str]:
    """Return the values of a flag that has several without commas: 1,3,6,8 as 1 3 6 8."""
    found, follows = list[str](), False
    for word in words:
        flag, _, value = word.partition("=")
        if flag in lists:
            follows = True
            found += [flag, *_split_values(value)]
        else:
            follows = follows and not re.match(r"--|-[A-Za-z]$", word)
            found += _split_values(word) if follows else [word]
    return found


def _split_values(word: str) -> list[str]:
    if os.path.exists(word):  # noqa: PTH110 - a Path raises where a name is too long
        return [word]
    if word.startswith("[") and word.endswith("]"):
        word = word[1:-1]
    if re.search(r",\s*,", word):
        raise UsageError(f"'{word}' has nothing between two commas; give values as 1,3,6,8")
    return [value for value in re.split(r"[,\s]+", word) if value]
