"""Disturbances: what reality adds to a task, as numbers and pure functions.

In a control step they act in this order. The chosen push, -1 to 1, is delayed; the motor may hold
the one before, or drop it; it follows with a lag; noise and shoves add a force on the cart. Then
the physics move. What is seen of the state is delayed, biased, noisy, and in steps. Rules and
rewards look at the state itself.
"""

import dataclasses
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Self

import numpy as np

from mjcartpole.disturbances.effects import QUEUE, Effects
from mjcartpole.disturbances.ranges import NOTHING, Range, parse_ranges
from mjcartpole.disturbances.shoves import LARGEST, Shove, parse_shove
from mjcartpole.errors import ConfigError, check_known, nearest
from mjcartpole.rules import MOST_STEPS, RULES, as_float, whole_number
from mjcartpole.task import Task, for_each_pole, state_names

SMALLEST_STEP: Final = 1e-6
"""Of a converter: a state is then a whole number of steps that both engines know."""

MOST_SHARE: Final = 1.0
"""Chances are shares of all control steps."""

MOST_ACTIONS: Final = 8
"""That can be seen: a table has two bins for each."""


@dataclass(frozen=True, kw_only=True)
class WorldDisturbances:
    """What is added to a task, whoever plays it; the defaults add nothing."""

    vary: tuple[str, ...] = ()
    """Numbers of the model that each episode draws anew, by the names that --set knows:
    pole.length=0.5:1.5 uniformly, cart.mass=0.1:10:log by its logarithm, force=8,10,12 one of."""
    delay: int = 0
    """Control steps from an action to its push; none pushes before."""
    hold: float = 0.0
    """Chance of a step in which the motor repeats the push before."""
    drop: float = 0.0
    """Chance of a step without a push."""
    lag: float = 0.0
    """Seconds in which the motor's push gets within 1/e of what is asked for."""
    force_noise: float = 0.0
    """Standard deviation of a force on the cart, N, drawn for each control step."""
    push: tuple[str, ...] = ()
    """Shoves of the cart, N s towards +x: 5@2s after two seconds, 0.5@~4s to either side at random,
    once in four seconds on average."""
    sensor_delay: int = 0
    """Control steps by which what is seen is old."""
    noise: tuple[float, ...] = ()
    """Standard deviations of what is seen: one for all, or for x, x_dot, theta, theta_dot."""
    bias: tuple[float, ...] = ()
    """What is added to all that is seen; one number, or four."""
    quantize: tuple[float, ...] = ()
    """What is seen is a multiple of this; one number, or four, 0 for none."""


@dataclass(frozen=True, kw_only=True)
class Disturbances(WorldDisturbances):
    """What is added to a task; the defaults add nothing.

    >>> Disturbances(vary={"pole.length": (0.5, 1.5)}, delay=2, noise=0.01)
    Disturbances(vary=('pole.length=0.5:1.5',), delay=2, noise=(0.01,))

    Each field takes the same everywhere: here, in `gymnasium.make`, in a `TrainConfig`, and as a
    flag of the command line.
    """

    pool: int | None = None
    """Draw so many models once, the same for every seed, and give each episode one of them; 0 draws
    anew for each, which takes some milliseconds. Left out: 100 in a training, 0 elsewhere."""
    widen: int = 0
    """Over so many episodes, let the ranges widen from their middle to their whole."""
    observe_actions: int = 0
    """How many of the last actions are seen besides, as -1 and 1, the latest first."""
    observe_context: bool = False
    """Whether what was drawn of --vary is seen besides; for learners other than tables."""

    if TYPE_CHECKING:
        # Each field takes more than it holds: one number for all, a mapping, a text.
        def __init__(self, **values: Any) -> None: ...  # noqa: ANN401

    def __post_init__(self) -> None:
        """Refuse what makes no sense, and put values in their usual form (ConfigError)."""
        self._put("vary", tuple(each.text for each in parse_ranges(self.vary)))
        self._put("push", tuple(each.text for each in _parse_shoves(self.push)))
        for name in ("noise", "bias", "quantize"):
            self._put(name, _values(name, getattr(self, name)))
        for name, most in _COUNTS.items():
            if getattr(self, name) is not None:
                whole_number(name, getattr(self, name), 0, most)
        for name, (unit, limit) in _SIZES.items():
            self._put(name, _size(name, getattr(self, name), unit, limit))
        self._put("observe_context", _truth("observe_context", self.observe_context))
        for name in ("pool", "widen", "observe_context"):
            if getattr(self, name) not in (None, 0, False) and not self.vary:
                raise ConfigError(f"{name} is of what vary draws, and nothing varies; give vary")

    def _put(self, name: str, value: object) -> None:
        object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        """What differs from the defaults; it evaluates to an equal value."""
        return f"Disturbances({', '.join(f'{name}={v!r}' for name, v in self.given.items())})"

    @property
    def given(self) -> dict[str, Any]:
        """The fields that are not as by default, by name."""
        values = {f.name: (getattr(self, f.name), f.default) for f in dataclasses.fields(self)}
        return {name: value for name, (value, usual) in values.items() if value != usual}

    @classmethod
    def of(cls, other: Any) -> Self:  # noqa: ANN401 - whatever has these fields
        """Return the disturbances among the fields of something larger."""
        return cls(**{field.name: getattr(other, field.name) for field in dataclasses.fields(cls)})

    @property
    def ranges(self) -> tuple[Range, ...]:
        """What varies, read."""
        return parse_ranges(self.vary)

    @property
    def are_some(self) -> bool:
        """Whether anything is added at all."""
        return self != NONE

    @classmethod
    def taken_from(
        cls, settings: dict[str, Any], given: "Disturbances | Mapping[str, Any] | None" = None
    ) -> "Disturbances":
        """Return disturbances among keyword arguments, which are taken out of there.

        They may also be given all in one, a mapping or the value; other arguments stay.

        Raises:
            ConfigError: They make no sense, or one is given twice.
        """
        names = [field.name for field in dataclasses.fields(Disturbances)]
        own = {name: settings.pop(name) for name in names if name in settings}
        own = {name: value for name, value in own.items() if value is not None}
        for name in settings:
            if name not in RULES and (near := nearest(name, [*names, *RULES])):
                raise TypeError(
                    f"got an unexpected keyword argument {name!r}; did you mean {near[0]!r}?"
                )
        if not isinstance(given, Disturbances | Mapping | None):
            raise ConfigError(f"disturbances are a mapping or Disturbances(…), not {given!r}")
        known = dict(given.given if isinstance(given, Disturbances) else given or {})
        if both := [name for name in own if name in known]:
            raise ConfigError(f"{both[0]} is given by itself and in disturbances; give one")
        for name in known:
            check_known("disturbance", name, names)
        return Disturbances(**known, **own)

    def check_apart(self, edits: Iterable[str]) -> None:
        """Refuse numbers that are edited and vary: the edit would have no effect (ConfigError)."""
        varied = {each.name for each in self.ranges}
        for name in edits:
            if name in varied:
                raise ConfigError(f"{name!r} is set, and varies; give it once")

    def seen_by(self, actions: int) -> Self:
        """Return the same where so many actions before are seen."""
        return dataclasses.replace(self, observe_actions=actions)

    @property
    def fixed(self) -> Self:
        """The same where nothing varies."""
        return dataclasses.replace(self, vary=(), pool=None, widen=0, observe_context=False)

    @property
    def blur_sensors(self) -> bool:
        """Whether what is seen may lie outside the task's own bounds."""
        return any(map(any, (self.noise, self.bias, self.quantize)))

    @property
    def one_sided(self) -> str:
        """What of it tells left from right; nothing where left and right stay alike."""
        if any(self.bias):
            return "bias"
        return "push" if any(each.at is not None for each in _parse_shoves(self.push)) else ""

    def check_fits(self, task: Task) -> None:
        """Refuse what no episode of a task is long enough for (ConfigError)."""
        for name in ("delay", "sensor_delay"):
            if getattr(self, name) >= task.time_limit:
                raise ConfigError(
                    f"{name} of {getattr(self, name)} control steps is no shorter than an episode "
                    f"of {task.name}, which has {task.time_limit}; take a shorter one, or more "
                    "max_episode_steps"
                )

    def effects(self, poles: int, control_step: float, task: Task) -> tuple["Effects", list[float]]:
        """Return the same as `actuate` and `sense` take it, and the memory of an episode.

        The model has so many poles, and its control step so many seconds.

        Raises:
            ConfigError: An episode is too short for a delay or a shove.
        """
        self.check_fits(task)
        size, pushes = len(state_names(poles)), _parse_shoves(self.push)
        table = [value for each in pushes for value in each.row(control_step, task)]
        memory = [*[0.0] * QUEUE, *[0.0] * self.delay, *[0.0] * self.observe_actions]
        memory += [0.0] * (self.sensor_delay * size)
        constants = len(memory)
        for values in (self.noise, self.bias, self.quantize):
            memory += _for_each(values, poles)
        return Effects(
            size=size,
            delay=self.delay,
            hold=self.hold,
            drop=self.drop,
            follow=1.0 - math.exp(-control_step / self.lag) if self.lag else 1.0,
            force_noise=self.force_noise,
            pushes=len(pushes),
            sensor_delay=self.sensor_delay,
            actions=self.observe_actions,
            turns=task.turns,
            constants=constants,
        ), memory + table


_COUNTS: Final = {
    "pool": 100_000,
    "widen": MOST_STEPS,
    "delay": MOST_STEPS,
    "sensor_delay": MOST_STEPS,
    "observe_actions": MOST_ACTIONS,
}
_SIZES: Final = {
    "hold": ("of all control steps", MOST_SHARE),
    "drop": ("of all control steps", MOST_SHARE),
    "lag": ("s", LARGEST),
    "force_noise": ("N", LARGEST),
}


def _parse_shoves(pushes: object) -> tuple[Shove, ...]:
    texts = _several(pushes)
    return () if texts == (NOTHING,) else tuple(parse_shove(each) for each in texts)


def _several(values: object) -> tuple[Any, ...]:
    """Return values of which a single one may stand for itself."""
    if isinstance(values, str | int | float) or not isinstance(values, Iterable):
        return (values,)
    return tuple(values)


def _size(name: str, value: Any, unit: str, most: float) -> float:  # noqa: ANN401 - to be checked
    number = as_float(value)
    if not 0 <= number <= most:
        raise ConfigError(f"{name} must be from 0 to {most:,g} ({unit}), not {value!r}")
    return number


def _number(name: str, value: Any) -> float:  # noqa: ANN401 - to be checked
    number = as_float(value)
    if not abs(number) <= LARGEST:
        raise ConfigError(f"{name} must be a number up to {LARGEST:,g}, not {value!r}")
    return number


def _truth(name: str, value: object) -> bool:
    if not isinstance(value, bool | np.bool_):
        raise ConfigError(f"{name} is True or False, not {value!r}")
    return bool(value)


def _values(name: str, values: object) -> tuple[float, ...]:
    """Return no number, one, or one for each value of a state."""
    if isinstance(values, Mapping | str):
        raise ConfigError(f"{name} is one number, or four, not {values!r}")
    numbers = tuple(_number(name, value) for value in _several(values))
    if len(numbers) not in (0, 1) and (len(numbers) < 4 or len(numbers) % 2):
        raise ConfigError(
            f"{name} is one number, or one each for {', '.join(state_names())}, not {values!r}"
        )
    if name != "bias" and min(numbers, default=0.0) < 0:
        raise ConfigError(f"{name} must be 0 or more, not {values!r}")
    if name == "quantize" and any(0 < number < SMALLEST_STEP for number in numbers):
        raise ConfigError(f"quantize must be 0, or {SMALLEST_STEP:g} or more, not {values!r}")
    return numbers if any(numbers) else ()


def _for_each(values: tuple[float, ...], poles: int) -> list[float]:
    """Return one number for each value of a state."""
    wanted = len(state_names(poles))
    if len(values) in (0, 1):
        return list(values or (0.0,)) * wanted
    each = list(for_each_pole(values, poles))
    if len(each) != wanted:
        raise ConfigError(
            f"{len(values)} numbers for what is seen, and a model whose states have {wanted}; "
            f"give one, or one each for {', '.join(state_names(poles))}"
        )
    return each


NONE: Final = Disturbances()
