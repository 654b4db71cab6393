"""Shoves of the cart: at a given time, or at random."""

import math
from typing import Final, NamedTuple

from mjcartpole.errors import ConfigError
from mjcartpole.task import Task

LARGEST: Final = 1e6
"""Of what is given in numbers: more is a slip of the finger."""


class Shove(NamedTuple):
    """A shove of the cart.

    Attributes:
        impulse: N s, towards +x; at random, to either side.
        at: Seconds after the start of an episode; None at random.
        every: Seconds between two on average; None at a given time.
    """

    impulse: float
    at: float | None
    every: float | None

    @property
    def text(self) -> str:
        """As a person writes it."""
        when = "~" if self.at is None else ""
        time = self.every if self.at is None else self.at
        impulse, seconds = (repr(each).removesuffix(".0") for each in (self.impulse, time))
        return f"{impulse}@{when}{seconds}s"

    def row(self, control_step: float, task: Task) -> tuple[float, float, float]:
        """Return force (N), the step that it is given in (-1 at random), and the chance of one.

        Raises:
            ConfigError: No episode is that long, or it would come more than once a step.
        """
        force = self.impulse / control_step
        if self.at is None:
            assert self.every is not None
            if self.every < control_step:
                raise ConfigError(f"push {self.text} would come more than once a control step")
            return force, -1.0, control_step / self.every
        step = round(self.at / control_step)
        if step >= task.time_limit:
            raise ConfigError(
                f"push {self.text} comes after the end of every episode of {task.name}, which has "
                f"{task.time_limit} control steps of {control_step:g} s"
            )
        return force, float(step), 0.0


def parse_shove(text: object) -> Shove:
    """Return a shove that is given as a text such as "0.5@2s".

    Raises:
        ConfigError: It is none.
    """
    impulse, at, when = text.strip().partition("@") if isinstance(text, str) else ("", "", "")
    when, is_random = when.removesuffix("s"), when.startswith("~")
    try:
        numbers = float(impulse), float(when.removeprefix("~"))
    except ValueError:
        numbers = math.nan, math.nan
    limits = 0 < abs(numbers[0]) <= LARGEST and 0 <= numbers[1] <= LARGEST
    if not at or not limits or (is_random and not numbers[1]):
        raise ConfigError(
            f"push {text!r} is none; give N s @ seconds, such as 0.5@2s at two seconds, or 0.5@~4s "
            f"at random, once in four seconds on average; up to {LARGEST:g} each"
        )
    return Shove(numbers[0], *((None, numbers[1]) if is_random else (numbers[1], None)))
