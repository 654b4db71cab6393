"""How far may a parameter move before a policy fails?"""

import functools
import itertools
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal, InvalidOperation
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from mjcartpole.disturbances.disturbances import NONE, Disturbances
from mjcartpole.errors import ConfigError, nearest
from mjcartpole.integrator import Integrator
from mjcartpole.learning.evaluation import EPISODES, SEED, Player, check_count
from mjcartpole.physics.edit.edits import EDIT_NAMES, edits_of
from mjcartpole.physics.load import Edits, ModelLike, load_model
from mjcartpole.studies.transfer import GYM, Cell, TransferResult, find_place, transfer
from mjcartpole.task import CARTPOLE_V1, Task

MOST_VALUES: Final = 1_000

COUNTS: Final = ("delay", "sensor_delay")
DISTURBANCES: Final = (
    *COUNTS,
    *("hold", "drop", "lag", "force_noise", "push", "noise", "bias", "quantize"),
)
"""What can be swept beside edits."""


@dataclass(frozen=True)
class Stretch:
    """Neighbouring values at which a policy does not fail.

    Attributes:
        low: The first.
        high: The last.
        open_low: Whether the sweep begins here, so that it may reach further down.
        open_high: Whether the sweep ends here.
    """

    low: float
    high: float
    open_low: bool
    open_high: bool

    def __str__(self) -> str:
        low = f"{self.low:g} (where the sweep begins)" if self.open_low else f"{self.low:g}"
        high = f"{self.high:g} (where it ends)" if self.open_high else f"{self.high:g}"
        return f"{low} to {high}"


@dataclass(frozen=True, eq=False, repr=False)
class SweepResult:
    """Every policy at every value of one parameter.

    Attributes:
        key: What was changed: an edit, as `edit_document` knows it, or a disturbance.
        values: Rising.
        model: Name of the model that was edited.
        played: Every policy (row) at every value (column).
    """

    key: str
    values: tuple[float, ...]
    model: str
    played: TransferResult

    def __repr__(self) -> str:
        span = f"{self.key} from {self.values[0]:g} to {self.values[-1]:g} on {self.model}"
        return f"SweepResult({span}, values: {len(self.values)}, {self.played!r})"

    @property
    def threshold(self) -> float | None:
        """A mean return from here up is no failure; None where the task has none."""
        return self.played.task.reward_threshold

    @property
    def means(self) -> npt.NDArray[np.float64]:
        """Mean returns, shape (policies, values); NaN where the simulation diverged."""
        return self.played.means

    def stretches(self, policy: str) -> list[Stretch]:
        """Where a policy does not fail, from low to high; nowhere if nothing is agreed."""
        least = np.inf if self.threshold is None else self.threshold
        good = self.means[self.played.policies.index(policy)] >= least
        edges = np.flatnonzero(np.diff(np.concatenate([[False], good, [False]])))
        last = len(self.values) - 1
        return [
            Stretch(self.values[first], self.values[end - 1], first == 0, end - 1 == last)
            for first, end in edges.reshape(-1, 2).tolist()
        ]

    def longest(self, policy: str) -> Stretch | None:
        """The widest stretch without a failure; None if every value fails."""
        found = self.stretches(policy)
        return max(found, key=lambda stretch: stretch.high - stretch.low) if found else None

    def points(self) -> list[tuple[float, Cell]]:
        """Each cell with its value, policy by policy."""
        rows = self.played.rows
        return [pair for row in rows for pair in zip(self.values, row, strict=True)]

    def summary(self) -> dict[str, Any]:
        """Everything as plain values, for JSON."""
        points = [
            {"value": value, **cell.summary(), "model": self.model} for value, cell in self.points()
        ]
        return {
            "parameter": self.key,
            "values": list(self.values),
            "model": self.model,
            **self.played.common,
            "threshold": self.threshold,
            "holds": {name: self._spans(name) for name in self.played.policies},
            "points": points,
        }

    def _spans(self, policy: str) -> list[list[float]]:
        return [[stretch.low, stretch.high] for stretch in self.stretches(policy)]


def parse_sweep(text: str) -> tuple[str, tuple[float, ...]]:
    """A sweep from the command line.

    >>> parse_sweep("pole.length=0.1:0.4:0.1")
    ('pole.length', (0.1, 0.2, 0.3, 0.4))

    Returns:
        What is changed, and its values; the last is the end, if the steps meet it.

    Raises:
        ConfigError: It is not KEY=FROM:TO:STEP, or its numbers make no sense.
    """
    key, _, span = text.rpartition("=")
    try:
        # Decimal: a tenth is to stay a tenth, however often it is added.
        start, stop, step = (Decimal(word.strip()) for word in span.split(":"))
        if not (start.is_finite() and stop.is_finite() and step.is_finite()):
            raise ValueError
    except (ValueError, InvalidOperation):
        raise ConfigError(
            f"'{text}' is no sweep; give NAME=FROM:TO:STEP, such as pole.length=0.5:3:0.25"
        ) from None
    if not key.strip() or step <= 0 or stop < start:
        raise ConfigError(
            f"'{text}' is no sweep: it needs a name, a step above 0, and FROM below TO, "
            "such as pole.length=0.5:3:0.25"
        )
    count = (stop - start) // step + 1
    if count > MOST_VALUES:
        raise ConfigError(f"'{text}' has {count:.3g} values; at most {MOST_VALUES:,} make sense")
    return key.strip(), tuple(float(start + index * step) for index in range(int(count)))


def sweep(
    policies: Mapping[str, Player | Sequence[Player]],
    model: ModelLike,
    key: str,
    values: Sequence[float],
    *,
    edits: Edits = None,
    integrator: Integrator = "gym",
    own_timestep: bool = False,
    task: Task | str = CARTPOLE_V1,
    disturbances: Disturbances = NONE,
    episodes: int = EPISODES,
    seed: int = SEED,
    workers: int | None = None,
) -> SweepResult:
    """Play every policy on a model at each value of one of its parameters, or of a disturbance.

    The key is an edit (see `edit_document`), one of `DISTURBANCES`, or shoves at a time, such as
    push@2s; its values rise. `edits` and disturbances are what else is changed, at all values; the
    latter may also be swept on "gym". All else is as in `transfer` and `load_model`.

    Raises:
        ConfigError: The key names nothing that is there, a value is outside physics, or a number
            makes no sense; nothing has been played then.
        ModelError: The model cannot be used, or a value makes it one that cannot.
    """
    check_count(episodes, seed)
    others, disturbance = edits_of(edits or ()), _disturbance_named(key)
    if model == GYM and (others or own_timestep or not disturbance):
        raise ConfigError(
            "gymnasium's CartPole-v1 cannot be swept or edited, but for disturbances; give a "
            "model, as 'cartpole'"
        )
    varying = [each.name for each in disturbances.ranges]
    key = disturbance or key
    _check(key, values, {*others, *disturbances.given, *varying})
    find = functools.partial(
        find_place, integrator=integrator, own_timestep=own_timestep, disturbances=disturbances
    )
    if disturbance:
        place = find(model, others)
        swept = [_disturbed(place.disturbances, key, value) for value in values]
        name, places = place.name, [replace(place, disturbances=each) for each in swept]
    else:
        base = load_model(model, own_timestep=True)
        name, places = base.name, [find(base, {**others, key: value}) for value in values]
    played = transfer(
        policies,
        places,
        task=task,
        disturbances=disturbances,
        episodes=episodes,
        seed=seed,
        workers=workers,
    )
    return SweepResult(key, tuple(map(float, values)), name, played)


def _disturbance_named(key: str) -> str:
    """Return a disturbance as it is called here; nothing where a key is of an edit.

    Raises:
        ConfigError: It is neither, and nearest of all that can be swept is a disturbance.
    """
    word = key.replace("-", "_")
    name = word.partition("@")[0]
    if name in DISTURBANCES:
        return word
    near = nearest(name, [*DISTURBANCES, *EDIT_NAMES])
    if near and near[0] in DISTURBANCES:
        raise ConfigError(f"nothing to sweep is called {key!r}: did you mean {near[0]!r}?")
    return ""


def _disturbed(others: Disturbances, key: str, value: float) -> Disturbances:
    """Return disturbances with one more, of a size."""
    name, _, when = key.partition("@")
    if name == "push":
        if not when:
            raise ConfigError("a sweep of shoves says when, such as push@2s=0:5:0.5 or push@~4s=…")
        return replace(others, push=(*others.push, f"{value}@{when}") if value else others.push)
    changes: dict[str, Any] = {name: value}
    if name in COUNTS and float(value).is_integer():
        changes[name] = int(value)
    return replace(others, **changes)


def _check(key: str, values: Sequence[float], given: Container[str]) -> None:
    if key in given:
        raise ConfigError(f"'{key}' is given and swept; give it once")
    if not values or any(a >= b for a, b in itertools.pairwise(values)):
        raise ConfigError(f"a sweep needs rising values, not {list(values)}")
