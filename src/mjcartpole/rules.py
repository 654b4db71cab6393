"""Rules of a task, one by one: what can be changed of them, and what values make sense."""

import math
from typing import Any, Final, SupportsFloat, TypedDict, cast

from mjcartpole.errors import ConfigError, check_known
from mjcartpole.rewards import REWARDS, Reward

MOST_STEPS: Final = 10_000_000
"""Of one episode: two days and a half."""

FARTHEST: Final = 1e10
"""Of any position, velocity and limit, in m, m/s, rad or rad/s: what MuJoCo still calls sane."""


class Changes(TypedDict, total=False):
    """Rules that are to be others than the task's; None leaves one as it is. See `Task`."""

    x_limit: float | None
    theta_limit: float | None
    start_low: float | None
    start_high: float | None
    start_angle: float | None
    reward: Reward | str | None


RULES: Final = {name: name for name in Changes.__annotations__} | {
    "max_episode_steps": "time_limit"
}
"""What can be changed of a task, and which of its attributes that is."""


def number_of(name: str, value: SupportsFloat | str, unit: str, *, is_limit: bool = False) -> float:
    """Return a number that was given for a rule, by its name and unit.

    A limit is more than 0, and may be infinite.

    Raises:
        ConfigError: It is none.
    """
    number = as_float(value)
    if (is_limit and number == math.inf) or (
        -FARTHEST <= number <= FARTHEST and (number > 0 or not is_limit)
    ):
        return number
    bounds = (
        f"more than 0 and at most {FARTHEST:g}, or infinite"
        if is_limit
        else f"from {-FARTHEST:g} to {FARTHEST:g}"
    )
    raise ConfigError(f"{name} must be a number ({unit}) {bounds}, not {value!r}")


def as_float(value: Any) -> float:  # noqa: ANN401 - to be checked
    """Return a number, NaN where it is none."""
    try:
        # Without the sum, numpy calls 0.0 to -0.0 a range that runs backwards.
        return math.nan if isinstance(value, bool | str) else float(value) + 0.0
    except (TypeError, ValueError, OverflowError):
        return math.nan


def whole_number(name: str, value: object, least: int, most: int) -> int:
    """Return a whole number that lies between two, both included; refuse others (ConfigError)."""
    if type(value) is not int or not least <= value <= most:
        raise ConfigError(f"{name} must be a whole number from {least} to {most:,}, not {value!r}")
    return value


_STATE: Final = "m, m/s, rad, rad/s"
_UNITS: Final = {
    "x_limit": "m",
    "theta_limit": "rad",
    "start_low": _STATE,
    "start_high": _STATE,
    "start_angle": "rad",
}


def checked(name: str, value: Any) -> float | Reward:  # noqa: ANN401 - whatever was given
    """Return a rule, called by its attribute's name, as a task has it; a reward may have its name.

    Raises:
        ConfigError: It is none.
    """
    if name == "time_limit":
        return whole_number("max_episode_steps", value, 1, MOST_STEPS)
    if name == "reward":
        return _reward(value)
    return number_of(name, value, _UNITS[name], is_limit=name.endswith("limit"))


def _reward(value: Any) -> Reward:  # noqa: ANN401 - whatever was given
    if callable(value):
        return cast(Reward, value)
    if not isinstance(value, str):
        known = ", ".join(REWARDS)
        raise ConfigError(f"reward must be one of {known} or a function, not {value!r}")
    check_known("reward", value, REWARDS)
    return REWARDS[value]
