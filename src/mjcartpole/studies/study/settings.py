"""What a study may set or vary: fields of `TrainConfig`, a preset, and edits of the model."""

import functools
import types
from collections.abc import Mapping
from typing import Any, Final, Literal, Union, get_args, get_origin

from mjcartpole.errors import ConfigError, nearest
from mjcartpole.learning.config import TrainConfig, config_class
from mjcartpole.learning.methods import METHODS
from mjcartpole.learning.presets import PRESETS
from mjcartpole.learning.stored import fits
from mjcartpole.physics.edit.edits import EDIT_NAMES, check_key, edits_of, parse_edit

PRESET: Final = "preset"
USUAL_PRESET: Final = "tuned"
NONE: Final = "none"
"""How a file says that a field has no value: TOML has no word for it."""

_WORDS: Final = {bool: "true or false", int: "a whole number", float: "a number", str: "a text"}


@functools.cache
def kinds() -> Mapping[str, tuple[Any, ...]]:
    """Return what each setting but edits may be: the types that methods give a field of its name.

    The seed is none of them: a study has many.
    """
    found: dict[str, tuple[Any, ...]] = {PRESET: (Literal[tuple(PRESETS)],)}
    for method in METHODS:
        for name, kind in config_class(method).fields().items():
            known = found.get(name, ())
            found[name] = known if kind in known else (*known, kind)
    del found["seed"]
    return found


def is_edit(name: str) -> bool:
    """Return whether a setting is an edit of the model, such as pole.length."""
    return name not in kinds()


def check_setting(name: str) -> None:
    """Refuse what is neither a field of a training nor an edit (ConfigError)."""
    if not is_edit(name):
        return
    if name == "seed":
        raise ConfigError("seed is not set here: [study] has seeds = 6, or seeds = [0, 1, 2]")
    if "." in name or ":" in name or name in EDIT_NAMES:
        check_key(name)
        return
    known = [*kinds(), *EDIT_NAMES]
    near = nearest(name, known)[:3]
    hint = f"did you mean {' or '.join(near)}?" if near else f"known are {', '.join(known)}"
    raise ConfigError(f"nothing is called {name!r}; {hint}")


def read_value(name: str, value: Any) -> Any:  # noqa: ANN401 - whatever a field holds
    """Return the value of a setting as a config has it, from what TOML has.

    >>> read_value("bins", [1, 3, 6, 8]), read_value("alpha", 1), read_value("mirror", "none")
    ((1, 3, 6, 8), 1.0, None)
    >>> read_value("set", "gravity=5")
    ('gravity=5',)

    Raises:
        ConfigError: It is of another kind.
    """
    if is_edit(name):
        if type(value) not in (int, float, str):
            raise ConfigError(f"{name} must be a number or a text, not {value!r}")
        parse_edit(f"{name}={value}")
        return value
    for kind in kinds()[name]:
        if value == NONE and (fits(None, kind) or fits([], kind)):
            return None if fits(None, kind) else ()
        for given in (value, [value]):
            if fits(given, kind):
                return _as_kind(given, kind)
    raise ConfigError(f"{name} must be {_in_words(kinds()[name])}, not {value!r}")


def is_number(name: str) -> bool:
    """Return whether a setting can be any number of a range."""
    return is_edit(name) or any(fits(1, kind) for kind in kinds()[name])


def is_whole(name: str) -> bool:
    """Return whether a setting that is a number has to be a whole one."""
    return not is_edit(name) and not any(fits(0.5, kind) for kind in kinds()[name])


def config_of(settings: Mapping[str, Any], given: Mapping[str, Any], seed: int) -> TrainConfig:
    """Return the config of a training with a seed.

    It has what was given for it alone, and of the settings for all the fields that its method has.

    Raises:
        ConfigError: They make no sense together.
    """
    merged = {**settings, **given}
    preset = merged.pop(PRESET, USUAL_PRESET)
    edits = {name: merged.pop(name) for name in list(merged) if is_edit(name)}
    method = merged.get("method", PRESETS[preset].get("method", TrainConfig.method))
    has = config_class(method).fields()
    if edits:
        before = edits_of(merged.get("set", PRESETS[preset].get("set", ())))
        if both := sorted(before.keys() & edits) if "set" in merged else []:
            raise ConfigError(f"{both[0]} stands in set and by itself; give it once")
        merged["set"] = tuple(f"{name}={value}" for name, value in {**before, **edits}.items())
    fields = {name: value for name, value in merged.items() if name in has or name in given}
    return TrainConfig.preset(preset, **fields, seed=seed)


def as_text(value: Any) -> str:  # noqa: ANN401 - whatever a field holds
    """Return a value as a table has it, and a file may.

    >>> as_text((1, 3, 6, 8)), as_text(None), as_text(0.5), as_text(True)
    ('1,3,6,8', 'none', '0.5', 'true')
    """
    match value:
        case None | ():
            return NONE
        case bool():
            return str(value).lower()
        case tuple():
            return ",".join(map(as_text, value))
        case _:
            return str(value)


def _as_kind(value: Any, kind: Any) -> Any:  # noqa: ANN401
    if type(value) is list:
        inner = next(get_args(each)[0] for each in _alternatives(kind) if get_origin(each) is tuple)
        return tuple(_as_kind(each, inner) for each in value)
    whole = int in _alternatives(kind)
    return float(value) if type(value) is int and not whole else value


def _alternatives(kind: Any) -> tuple[Any, ...]:  # noqa: ANN401
    union = get_origin(kind) in {Union, types.UnionType}
    return get_args(kind) if union else (kind,)


def _in_words(kinds: tuple[Any, ...]) -> str:
    alternatives = [each for kind in kinds for each in _alternatives(kind)]
    return " or ".join(dict.fromkeys(map(_one_in_words, alternatives)))


def _one_in_words(kind: Any) -> str:  # noqa: ANN401
    if kind is type(None):
        return repr(NONE)
    if get_origin(kind) is Literal:
        return f"one of {', '.join(get_args(kind))}"
    if get_origin(kind) is tuple:
        return f"a list, each {_in_words(get_args(kind)[:1])}"
    return _WORDS.get(kind, str(kind))
