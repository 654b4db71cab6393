"""The file of a study, read as if somebody else had written it: every mistake in a line of its own.

[study]
seeds = 6
measure = ["greedy_mean", "episodes_to_solve"]

[base]
preset = "tuned"

[factors]
alpha = [0.05, 0.1]
"pole.length" = [0.5, 1.0]
"""

import math
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Final, get_args

from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.errors import ConfigError, FileError, check_known
from mjcartpole.files import brief, read_bytes
from mjcartpole.rules import whole_number
from mjcartpole.studies.seeds import MAX_SEEDS
from mjcartpole.studies.study.design import MOST_POINTS, Design, Factor, Range
from mjcartpole.studies.study.measures import MEASURES, is_disturbed
from mjcartpole.studies.study.settings import (
    as_text,
    check_setting,
    is_number,
    is_whole,
    read_value,
)

MOST_BYTES: Final = 2**20
MOST_MISTAKES: Final = 20
"""That are told at once."""
_RANGE: Final = ("low", "high", "log", "levels")


@dataclass(frozen=True)
class Study:
    """What is asked.

    Attributes:
        seeds: Of each point.
        measure: What is measured, see `MEASURES`.
        design: See `points_of`.
        samples: See `points_of`.
        design_seed: See `points_of`.
        baseline: Levels of factors that others are held against; the first of each if left out.
        robustness: Disturbances under which policies are tested; None if they are not.
        base: Settings of all points.
        factors: What differs.
        text: The file.
    """

    seeds: tuple[int, ...] = tuple(range(5))
    measure: tuple[str, ...] = ("greedy_mean",)
    design: Design = "grid"
    samples: int = 0
    design_seed: int = 0
    baseline: Mapping[str, Any] = field(default_factory=dict)
    robustness: Disturbances | None = None
    base: Mapping[str, Any] = field(default_factory=dict)
    factors: tuple[Factor, ...] = ()
    text: str = field(default="", repr=False)


def read_study(path: Path) -> Study:
    """Read a study's file.

    Raises:
        FileError: It cannot be read.
        ConfigError: It is no study; the message has a line for each mistake.
    """
    content = read_bytes(path, MOST_BYTES, follow=True)
    try:
        text = content.decode("utf-8-sig")  # Windows may begin it with a byte order mark.
        values = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise FileError(f"'{path}' is no TOML: {brief(error)}") from error
    try:
        return study_of(values, text)
    except RecursionError as error:
        raise FileError(f"'{path}' is no study: tables or lists in it are too deep") from error


def study_of(values: Mapping[str, Any], text: str = "") -> Study:
    """Return the study that the values of a file mean.

    Raises:
        ConfigError: They mean none; the message has a line for each mistake.
    """
    mistakes = list[str]()
    tables = _tables(values, mistakes)
    about = _about(tables["study"], mistakes)
    base = dict(_each(tables["base"], "base", _setting, mistakes))
    factors = tuple(each for _, each in _each(tables["factors"], "factors", _factor, mistakes))
    if values.get("factors", {}) == {}:
        mistakes.append(
            "[factors] is empty, so there is nothing to compare; give one at least, such as "
            "alpha = [0.05, 0.1] (one config with many seeds is `mjcartpole train --seeds`)"
        )
    robustness = _robustness(tables["robustness"], mistakes)
    study = Study(**about, robustness=robustness, base=base, factors=factors, text=text)
    # Where a part is wrong, what it has to do with others is not known.
    raise_all(mistakes or list(_together(study)))
    return study


def raise_all(mistakes: list[str]) -> None:
    """Raise all mistakes as one error, a line for each that is another.

    Raises:
        ConfigError: There are some.
    """
    lines = list(dict.fromkeys(mistakes))
    if len(lines) > MOST_MISTAKES:
        lines[MOST_MISTAKES:] = [f"and {len(lines) - MOST_MISTAKES} mistakes more"]
    if lines:
        raise ConfigError("\n".join(lines))


def _tables(values: Mapping[str, Any], mistakes: list[str]) -> dict[str, dict[str, Any]]:
    names = ("study", "base", "factors", "robustness")
    for name, value in values.items():
        if name not in names:
            parts = ", ".join(f"[{each}]" for each in names)
            mistakes.append(f"[{name}] is no part of a study; its parts are {parts}")
        elif not isinstance(value, dict):
            mistakes.append(f"{name} must be a table, as in [{name}], not {value!r}")
    found = {name: values.get(name) for name in names}
    tables = {name: value if isinstance(value, dict) else {} for name, value in found.items()}
    return tables | {name: dict(_flat(tables[name])) for name in ("base", "factors")}


def _flat(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield settings by name; TOML reads pole.length = 1 as a table pole, unless it is quoted."""
    for name, value in table.items():
        if isinstance(value, dict) and not set(value) & set(_RANGE):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            yield prefix + name, value


def _each(
    table: Mapping[str, Any], where: str, read: Callable[[str, Any], Any], mistakes: list[str]
) -> Iterator[tuple[str, Any]]:
    for name, value in table.items():
        try:
            yield name, read(name, value)
        except ConfigError as error:
            mistakes.append(f"[{where}] {error}")


def _setting(name: str, value: Any) -> Any:  # noqa: ANN401
    check_setting(name)
    return read_value(name, value)


def _factor(name: str, value: Any) -> Factor:  # noqa: ANN401
    check_setting(name)
    if isinstance(value, dict):
        return Factor(name, _range(name, value))
    if not isinstance(value, list):
        raise ConfigError(
            f"{name} must be a list of levels or a range such as {{low = 0.01, high = 1}}, not "
            f"{value!r}; what is the same for all belongs to [base]"
        )
    levels = tuple(read_value(name, each) for each in value)
    if not levels:
        raise ConfigError(f"{name} has no levels, so there is no point; give one at least")
    # Equal values, or others that a table would show alike, such as 0.5 and "0.5".
    for alike in levels, tuple(map(as_text, levels)):
        if twice := [each for each in dict.fromkeys(alike) if alike.count(each) > 1]:
            raise ConfigError(
                f"{name} has the level {as_text(twice[0])} more than once; give it once"
            )
    return Factor(name, levels)


def _range(name: str, value: dict[str, Any]) -> Range:
    for key in value:
        check_known(f"{name}: of a range", key, _RANGE)
    low, high, levels = value.get("low"), value.get("high"), value.get("levels")
    if not is_number(name):
        raise ConfigError(f"{name} is no number, and has no range; give a list of levels")
    numbers = (read_value(name, low), read_value(name, high))
    real = all(type(each) in (int, float) and math.isfinite(each) for each in numbers)
    if not (real and numbers[0] < numbers[1]):
        raise ConfigError(
            f"{name}: a range needs two numbers, low below high, not {low!r}, {high!r}"
        )
    log = value.get("log", False)
    if type(log) is not bool or (log and numbers[0] <= 0):
        raise ConfigError(f"{name}: log is true or false, and needs a range above 0")
    if levels is not None and not (type(levels) is int and 2 <= levels <= MOST_POINTS):
        raise ConfigError(
            f"{name}: levels must be a whole number from 2 to {MOST_POINTS:,}, not {levels!r}"
        )
    found = Range(*numbers, log=log, whole=is_whole(name), levels=levels)
    if levels is not None and len(different := set(found.evenly())) < levels:
        raise ConfigError(
            f"{name}: there are not so many different levels, only {len(different)} of {levels}"
        )
    return found


def _about(table: Mapping[str, Any], mistakes: list[str]) -> dict[str, Any]:
    def read(name: str, value: Any) -> Any:  # noqa: ANN401
        check_known("setting", name, _READ)
        return _READ[name](name, value)

    return dict(_each(table, "study", read, mistakes))


def _robustness(table: Mapping[str, Any], mistakes: list[str]) -> Disturbances | None:
    if not table:
        return None

    def read(name: str, value: Any) -> Any:  # noqa: ANN401
        check_known("disturbance", name, [each.name for each in fields(Disturbances)])
        return read_value(name, value)

    try:
        return Disturbances(**dict(_each(table, "robustness", read, mistakes)))
    except ConfigError as error:
        mistakes.append(f"[robustness] {error}")
        return Disturbances()


def _seeds(name: str, value: Any) -> tuple[int, ...]:  # noqa: ANN401
    few = type(value) is int and value <= MAX_SEEDS
    many = value if isinstance(value, list) else range(value) if few else []
    whole = all(type(each) is int and each >= 0 for each in many)
    if not (whole and 1 <= len(many) <= MAX_SEEDS and len(set(many)) == len(many)):
        raise ConfigError(
            f"{name} must be how many, from 1 to {MAX_SEEDS:,}, or a list of different whole "
            f"numbers from 0 up, not {value!r}"
        )
    return tuple(many)


def _measures(name: str, value: Any) -> tuple[str, ...]:  # noqa: ANN401
    names = value if isinstance(value, list) else [value]
    for each in names:
        check_known("measure", each, MEASURES)
    if not names:
        raise ConfigError(f"{name} is empty; available: {', '.join(MEASURES)}")
    return tuple(dict.fromkeys(names))


def _design(name: str, value: Any) -> Any:  # noqa: ANN401
    check_known(name, value, get_args(Design))
    return value


def _count(name: str, value: Any) -> int:  # noqa: ANN401
    most = MOST_POINTS if name == "samples" else 2**63
    return whole_number(name, value, 0, most)


def _baseline(name: str, value: Any) -> dict[str, Any]:  # noqa: ANN401
    if not isinstance(value, dict):
        raise ConfigError(f"{name} must be levels such as {{alpha = 0.1}}, not {value!r}")
    return {key: _setting(key, each) for key, each in _flat(value)}


_READ: Final[dict[str, Callable[[str, Any], Any]]] = {
    "seeds": _seeds,
    "measure": _measures,
    "design": _design,
    "samples": _count,
    "design_seed": _count,
    "baseline": _baseline,
}


def _together(study: Study) -> Iterator[str]:
    """Yield mistakes that no part has alone."""
    if study.design != "grid" and study.samples < 1:
        yield f'[study] design = "{study.design}" needs samples = N, the number of points'
    if study.design == "grid" and study.samples:
        yield '[study] samples is for design = "random" or "latin"; a grid has all combinations'
    if is_disturbed(study.measure) != (study.robustness is not None):
        yield (
            "[robustness] and the measures robust_mean and robust_minimum belong together: it says "
            "under which disturbances, such as noise = 0.01"
        )
    for factor in study.factors:
        ranged = isinstance(factor.levels, Range) and factor.levels.levels is None
        if ranged and study.design == "grid":
            yield (
                f"[factors] {factor.name}: a grid needs levels = N in a range; or give "
                'design = "latin" and samples in [study]'
            )
        if isinstance(factor.levels, Range) and not ranged and study.design != "grid":
            yield (
                f"[factors] {factor.name}: levels = N is for a grid; "
                f'design = "{study.design}" draws from all of a range'
            )
        if factor.name in study.base:
            yield f"{factor.name} stands in [base] and in [factors]; give it once"
    for name, level in study.baseline.items():
        levels = next((each.levels for each in study.factors if each.name == name), None)
        if levels is None:
            yield f"[study] baseline: {name} is none of the factors"
        elif level not in levels:
            yield f"[study] baseline: {level!r} is none of the levels of {name}"
