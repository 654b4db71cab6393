"""What a training is called: in a folder's name, and in the words of its flags."""

import hashlib
import os
import re
import shlex
from collections.abc import Iterator, Mapping
from pathlib import Path, PurePath
from typing import Any, Final

from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.presets import PRESETS

MOST_CHANGES: Final = 64
"""Bytes that say what was changed."""
MOST_SEEDS: Final = 24

_ELSEWHERE: Final = ("backend", "seed")
"""Fields that every name has."""
_MODEL: Final = re.compile(r"[a-z]+|[a-z0-9_-]+\.xml")
_EDIT: Final = re.compile(r"([a-z][a-z0-9]*[.:])*[a-z]+=-?[0-9.]+(e[+-]?[0-9]+)?")
"""What stays one of a kind in a name; of anything else, a digest is in it."""


def run_name(preset: str, config: TrainConfig, seeds: int = 1) -> str:
    """A folder's name for a training: legal everywhere, short, another for other settings.

    >>> run_name("tuned", TrainConfig())
    'tuned-mujoco-seed0'
    >>> run_name("tuned", TrainConfig(alpha=0.2, set=("pole.length=1.5",), seed=7), seeds=3)
    'tuned-mujoco-pole.length1.5-alpha0.2-seeds7-9'

    The config began from the preset; so many seeds from its own on are trained.
    """
    seed = config.seed
    which = f"seed{seed}" if seeds == 1 else f"seeds{seed}-{seed + seeds - 1}"
    parts = [preset, config.backend, _changes(preset, config), shortened(which, MOST_SEEDS)]
    return "-".join(part for part in parts if part)


def namesakes(folder: Path) -> list[Path]:
    """The folders beside one that have its name, but for the number at its end; itself included."""
    numbered = re.fullmatch(r"(.+)-\d+", folder.name)
    first = folder.with_name(numbered[1]) if numbered else folder
    first = first if first.is_dir() else folder
    alike = re.compile(re.escape(first.name) + r"(-\d+)?")
    found = [path for path in folder.parent.iterdir() if alike.fullmatch(path.name)]
    return sorted((path for path in found if path.is_dir()), key=lambda path: len(path.name))


def in_flags(preset: str, config: TrainConfig) -> str:
    """What is learned otherwise than with the preset, as flags; but for backend, seed, episodes.

    >>> in_flags("tuned", TrainConfig(bins=(1, 3, 6, 9), own_timestep=True))
    '--own-timestep --bins 1,3,6,9'
    """
    changed = _changed(preset, config)
    said = {name: changed[name] for name in changed if name not in ("episodes", "log_every")}
    return flags_of(said)


def flags_of(values: Mapping[str, Any]) -> str:
    """Return fields with their values as flags.

    >>> flags_of(Disturbances(delay=2, push="5@2s").given)
    '--delay 2 --push 5@2s'
    """
    return " ".join(_flag(name.replace("_", "-"), value) for name, value in values.items())


def added_flags(disturbances: Disturbances) -> str:
    """Return what is added to a task, as flags of a command that plays."""
    return flags_of(disturbances.seen_by(0).given)


def shortened(text: str, most: int) -> str:
    """A text of so many bytes at most; the end of a longer one is a digest of it."""
    encoded, digest = os.fsencode(text), _digest(text)
    if len(encoded) <= most:
        return text
    return f"{encoded[: most - len(digest) - 1].decode(errors='ignore')}-{digest}"


def _changed(preset: str, config: TrainConfig) -> dict[str, Any]:
    """The fields that are not as the preset has them, by name."""
    # A folder may be of a preset that somebody called otherwise.
    name = preset if preset in PRESETS else "tuned"
    base = TrainConfig.preset(name, method=config.method).values()
    base["method"] = TrainConfig.preset(name).method
    values = config.values()
    return {
        name: values[name]
        for name in values
        if name not in _ELSEWHERE and values[name] != base[name]
    }


def _changes(preset: str, config: TrainConfig) -> str:
    changed = _changed(preset, config)
    words = [re.sub(r"[^a-z0-9._+-]+", "_", word.lower()) for word in _readable(changed)]
    whole = "-".join(words)
    plain = all(_EDIT.fullmatch(edit) for edit in changed.get("set", ()))
    # Signs tell ranges and shoves apart, and no folder's name has them.
    plain &= not changed.keys() & {"vary", "push"}
    if plain and _MODEL.fullmatch(changed.get("model", "cartpole")) and len(whole) <= MOST_CHANGES:
        return whole
    fitting, digest = list[str](), _digest(repr(changed))
    for word in words:
        # Whole words: a number that is cut is another number.
        longer = "-".join([*fitting, word, digest])
        fitting += [word] if len(longer) <= MOST_CHANGES else []
    return "-".join([*fitting, digest])


def _readable(changed: dict[str, Any]) -> Iterator[str]:
    for name, value in changed.items():
        match value:
            case None | False:
                yield f"no_{name}"
            case True:
                yield name
            case str():
                yield PurePath(value).name if name == "model" else f"{name}_{value}"
            case tuple() if name == "set":
                yield from (edit.replace("=", "") for edit in value)
            case (str(), *_):
                yield "_".join((name, *value))
            case tuple():
                yield name + "_".join(map(_number, value))
            case _:
                yield name + _number(value)


def _flag(flag: str, value: Any) -> str:
    match value:
        case bool():
            return f"--{flag}" if value else f"--no-{flag}"
        case (str(), *_):
            return f"--{flag} {shlex.join(value)}"
        case tuple():
            return f"--{flag} {','.join(map(_number, value))}"
        case str():
            return f"--{flag} {shlex.quote(value)}"
        case _:
            return f"--{flag} {_number(value)}"


def _number(value: float | None) -> str:
    return repr(value).removesuffix(".0")


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode(errors="surrogateescape")).hexdigest()[:8]
