"""What environments take: rules where they are made, `reset(options=…)` later."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple, SupportsFloat

from gymnasium.envs.classic_control.utils import maybe_parse_reset_bounds

from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.errors import ConfigError
from mjcartpole.physics.edit.edits import edits_of
from mjcartpole.physics.load import Edits
from mjcartpole.rewards import minus_one_at_the_end
from mjcartpole.rules import Changes
from mjcartpole.task import CARTPOLE_V1, Task, resolve


class ResetOptions(NamedTuple):
    """How an episode starts; all of it holds until the next reset.

    Attributes:
        low: Lower bound of each of the starting state's values.
        high: Upper bound.
        edits: Changes of the model (see `load_model`); empty for none.
    """

    low: float = CARTPOLE_V1.start_low
    high: float = CARTPOLE_V1.start_high
    edits: Any = ()


def rules_of(task: Task | str, changes: Changes, *, sutton_barto_reward: bool) -> Task:
    """Return an environment's rules.

    Args:
        task: What they are, but for the changes.
        changes: Those that are other ones.
        sutton_barto_reward: Whether the reward is -1 at the end, whatever else it was.

    Raises:
        ConfigError: They make no sense, or name two rewards.
        TypeError: A change is none of a rule.
    """
    if "max_episode_steps" in changes:
        raise TypeError(
            "got an unexpected keyword argument 'max_episode_steps'; gymnasium.make takes it, and "
            "adds the time limit"
        )
    rules = resolve(task).with_changes(**changes)
    if not sutton_barto_reward:
        return rules
    if changes.get("reward") is not None:
        raise ConfigError(
            "sutton_barto_reward=True is reward='minus-one-at-the-end'; leave out one of the two"
        )
    return rules.with_changes(reward=minus_one_at_the_end)


def added_of(
    more: dict[str, Any],
    disturbances: Disturbances | Mapping[str, Any] | None,
    edits: Edits,
) -> Disturbances:
    """Return an environment's disturbances; those among keyword arguments are taken out of there.

    Args:
        more: Rules and disturbances, by name.
        disturbances: All of them in one.
        edits: Of the model, which does not vary by the same numbers.

    Raises:
        ConfigError: They make no sense, one is given twice, or an edit would have no effect.
        TypeError: A keyword argument is none.
    """
    added = Disturbances.taken_from(more, disturbances)
    added.check_apart(edits_of(edits or ()))
    return added


def usual(task: Task) -> ResetOptions:
    """Return how an episode of a task starts without options."""
    return ResetOptions(task.start_low, task.start_high)


def reset_options(options: Mapping[str, Any], otherwise: ResetOptions) -> ResetOptions:
    """Return the options of a reset, checked.

    Args:
        options: As they were given.
        otherwise: What holds where they say nothing.

    Raises:
        ConfigError: There is no such option, a bound is no finite number, or low is above high.
    """
    given = otherwise._replace(**_known(options))
    try:
        # In gymnasium's own words, which CartPole-v1's users know.
        low, high = maybe_parse_reset_bounds({"low": given.low, "high": given.high}, *otherwise[:2])
    except (ValueError, OverflowError) as error:
        raise ConfigError(str(error)) from error
    if not math.isfinite(high - low):
        raise ConfigError(f"reset starts between two finite bounds, not low={low}, high={high}")
    return ResetOptions(low, high + 0.0, given.edits or ())


def _known(options: Mapping[str, Any]) -> Mapping[str, Any]:
    names = ResetOptions._fields
    is_mapping = isinstance(options, Mapping)
    others = [each for each in options if each not in names] if is_mapping else [options]
    if others:
        raise ConfigError(
            f"reset takes a dict of the options {', '.join(names)}, not "
            f"{', '.join(map(repr, others))}; a state is set after the reset, by "
            "env.unwrapped.state = (…)"
        )
    return options


def start_bounds(
    task: Task, options: Mapping[str, Any] | None, *others: str
) -> tuple[float, float]:
    """Return bounds of the starting states' values, as the vector's `reset(options=…)` gives them.

    >>> start_bounds(CARTPOLE_V1, {"low": -0.01})
    (-0.01, 0.05)

    Args:
        task: Says where episodes start otherwise.
        options: What `reset` was given.
        others: Options beside "low" and "high" that are read elsewhere.

    Raises:
        ConfigError: An option is unknown, a bound is no finite number, or low is above high.
    """
    known = ("low", "high", *others)
    if not isinstance(options, Mapping | None):
        raise ConfigError(f"options of reset are a dict, not {options!r}")
    for name in options or {}:
        if name not in known:
            raise ConfigError(
                f"reset has no option {name!r}; available: {', '.join(known)}. What belongs to the "
                "model or the rules is given where the environment is made"
            )
    given = {"low": task.start_low, "high": task.start_high, **(options or {})}
    low, high = (_finite(name, given[name]) for name in ("low", "high"))
    if low > high:
        raise ConfigError(f"low ({low}) is above high ({high}); the starting state lies between")
    _finite("the distance from low to high", high - low)
    return low, high + 0.0


def _finite(name: str, value: SupportsFloat | str) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise ConfigError(f"{name} is a finite number, not {value!r}")
    return number
