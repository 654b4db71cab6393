"""The results of a study, read back from its folder as if somebody else had written them."""

import contextlib
import csv
import io
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt

from mjcartpole.errors import ConfigError, RunError, check_known
from mjcartpole.files import brief, is_file, read_bytes
from mjcartpole.studies.study.design import Factor, Range, points_of
from mjcartpole.studies.study.folder import STUDY
from mjcartpole.studies.study.measures import MEASURES
from mjcartpole.studies.study.settings import as_text
from mjcartpole.studies.study.study_file import Study, read_study
from mjcartpole.studies.study.tables import RUNS

MOST_BYTES: Final = 2**30
_AGAIN: Final = "mjcartpole study FILE.toml --resume"
PARTS: Final = 4
"""Of a factor that is a range, and has no levels of its own."""


@dataclass(frozen=True, eq=False)
class Levels:
    """What a factor was in each run.

    Attributes:
        name: The factor's.
        names: Its levels, as a table has them.
        labels: Which of these it was, shape (runs,).
        numbers: What it was, shape (runs,), of a range in parts, or that levels were drawn from.
    """

    name: str
    names: tuple[str, ...]
    labels: npt.NDArray[np.int64]
    numbers: npt.NDArray[np.float64] | None = None


@dataclass(frozen=True, eq=False)
class Results:
    """Runs that did not fail.

    Attributes:
        study: What was asked.
        levels: A factor each.
        points: Number of the point of each run, shape (runs,).
        words: That point, as a person reads it.
        seeds: Its seed.
        scores: By measure, each run's figure; of one that never came to it what it spent in vain.
        solved: By measure, whether it came to it.
        failed: How many runs failed, and are left out.
    """

    study: Study
    levels: tuple[Levels, ...]
    points: npt.NDArray[np.int64]
    words: tuple[str, ...]
    seeds: tuple[int, ...]
    scores: Mapping[str, npt.NDArray[np.float64]]
    solved: Mapping[str, npt.NDArray[np.bool_]]
    failed: int

    @property
    def left(self) -> int:
        """How many runs of the study have come to nothing yet."""
        asked = self.study
        points = points_of(asked.factors, asked.design, asked.samples, asked.design_seed)
        return len(points) * len(asked.seeds) - len(self.seeds) - self.failed

    def baseline(self, given: Sequence[str]) -> dict[str, str]:
        """Return the level of each factor that others are held against, some given as alpha=0.1.

        Of the others it is the study's own, or the first one.

        Raises:
            ConfigError: One is no level.
        """
        found = {each.name: each.names[0] for each in self.levels}
        found |= {name: as_text(level) for name, level in self.study.baseline.items()}
        asked = dict[str, str]()
        for text in given:
            name, _, level = text.partition("=")
            check_known("factor", name, found)
            if name in asked:
                raise ConfigError(f"--baseline has two levels of {name}; give one")
            asked[name] = level
        found |= asked
        for factor, each in zip(self.study.factors, self.levels, strict=True):
            level = found[each.name] = _with_nearest(factor, each, found[each.name])
            if level not in each.names and level in map(as_text, factor.on_grid()):
                raise ConfigError(
                    f"no run with {each.name}={level}, the base line, is done yet, or all failed; "
                    f"go on with the study: {_AGAIN}, or give --baseline "
                    f"{each.name}={each.names[0]}"
                )
            check_known(f"{each.name}: level", level, each.names)
        return found


def read_results(folder: Path) -> Results:
    """Read what a study has come to.

    Raises:
        RunError: The folder is no study, has no table yet, or is damaged.
    """
    for name in (STUDY, RUNS):
        if not is_file(folder / name):
            raise RunError(
                f"'{folder}' has no {name}; give the folder of a study that is done, or go on with "
                f"it: {_AGAIN}"
            )
    study = read_study(folder / STUDY)
    try:
        text = read_bytes(folder / RUNS, MOST_BYTES, refusal=RunError).decode()
        rows = list(csv.DictReader(io.StringIO(text), strict=True))
        if good := [row for row in rows if not row["error"]]:
            return _results(study, good, len(rows) - len(good))
    except (ValueError, KeyError, TypeError, csv.Error) as error:
        raise RunError(
            f"'{folder / RUNS}' is no table of this study ({brief(error)}); write it anew: {_AGAIN}"
        ) from error
    first = f"; the first failed: {rows[0]['error']}" if rows else f"; go on with it: {_AGAIN}"
    raise RunError(f"no run in '{folder / RUNS}' was done without an error{first}")


def _results(study: Study, good: list[dict[str, str]], failed: int) -> Results:
    needed = ("point", "seed", *study.measure, *(each.name for each in study.factors))
    if missing := [name for name in needed if name not in good[0]]:
        raise ValueError(f"it has no column {missing[0]}")
    figures = {name: [_number(row[name]) for row in good] for name in study.measure}
    return Results(
        study,
        tuple(_levels(each, [row[each.name] for row in good]) for each in study.factors),
        np.array([int(row["point"]) for row in good]),
        tuple(" ".join(f"{each.name}={row[each.name]}" for each in study.factors) for row in good),
        tuple(int(row["seed"]) for row in good),
        {name: _scores(name, found, good) for name, found in figures.items()},
        {name: ~np.isnan(found) for name, found in figures.items()},
        failed,
    )


def _scores(name: str, found: list[float], rows: list[dict[str, str]]) -> npt.NDArray[np.float64]:
    budget = MEASURES[name].budget
    spent = [_number(row[budget]) if budget else math.nan for row in rows]
    scores = np.where(np.isnan(found), spent, found)
    if not np.isfinite(scores).all():
        raise ValueError(f"{name} is missing in a run that did not fail")
    return scores


def _number(text: str) -> float:
    return float(text) if text else math.nan


def _with_nearest(factor: Factor, levels: Levels, text: str) -> str:
    """Return a level as it is; of a number of a range, the level of the nearest run."""
    if levels.numbers is None or text in levels.names:
        return text
    with contextlib.suppress(ValueError):
        if (number := float(text)) in factor.levels:
            return levels.names[int(levels.labels[np.abs(levels.numbers - number).argmin()])]
    return text


def _levels(factor: Factor, texts: list[str]) -> Levels:
    there, numbers = set(texts), None
    if isinstance(factor.levels, Range):
        given = np.array([float(text) for text in texts])
        if len(there) > 2 * PARTS:
            return _parts(factor.name, given)
        numbers = given if factor.levels.levels is None else None
        names = sorted(there, key=float)
    else:
        names = [name for name in map(as_text, factor.levels) if name in there]
    if others := there.difference(names):
        raise ValueError(f"{factor.name} has no level {min(others)!r}")
    places = {name: place for place, name in enumerate(names)}
    return Levels(factor.name, tuple(names), np.array([places[text] for text in texts]), numbers)


def _parts(name: str, values: npt.NDArray[np.float64]) -> Levels:
    """Return a range as so many parts with as many runs each."""
    # Where a number is that of a quarter of the runs, two ends are one.
    ends = np.unique(np.quantile(values, np.linspace(0, 1, PARTS + 1)))
    labels = np.clip(np.searchsorted(ends, values, "right") - 1, 0, len(ends) - 2)
    names = [f"{low:.3g} to {high:.3g}" for low, high in itertools.pairwise(ends)]
    return Levels(name, tuple(names), labels, values)
