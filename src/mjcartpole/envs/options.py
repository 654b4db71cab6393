"""What environments take: rules where they are made, `reset(options=…)` later."""

import math
from collections.abc import Mapping
from typing import Any

from gymnasium.envs.classic_control.utils import maybe_parse_reset_bounds

from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.errors import ConfigError
from mjcartpole.physics.edit.edits import edits_of
from mjcartpole.physics.load import Edits
from mjcartpole.rewards import minus_one_at_the_end
from mjcartpole.rules import Changes
from mjcartpole.task import Task, resolve


def rules_of(task: Task | str, changes: Changes, *, sutton_barto_reward: bool) -> Task:
    """Return an environment's rules: those of a task but for changes, and for the reward's.

    With `sutton_barto_reward` it is -1 at the end, whatever else it was.

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
    more: dict[str, Any], disturbances: Disturbances | Mapping[str, Any] | None, edits: Edits
) -> Disturbances:
    """Return an environment's disturbances; those among keyword arguments are taken out of there.

    They may also be given all in one. What is edited does not vary.

    Raises:
        ConfigError: They make no sense, one is given twice, or an edit would have no effect.
        TypeError: A keyword argument is none.
    """
    added = Disturbances.taken_from(more, disturbances)
    added.check_apart(edits_of(edits or ()))
    return added


def start_bounds(
    options: Mapping[str, Any], usual: tuple[float, float], *others: str
) -> tuple[float, float]:
    """Return bounds of the starting states' values, as `reset(options=…)` gives them.

    >>> start_bounds({"low": -0.01}, (-0.05, 0.05))
    (-0.01, 0.05)

    What is left out is as usual; options beside "low" and "high" are read elsewhere.

    Raises:
        ConfigError: An option is unknown, a bound is no finite number, or low is above high.
    """
    known = ("low", "high", *others)
    if not isinstance(options, Mapping):
        raise ConfigError(f"options of reset are a dict, not {options!r}")
    for name in options:
        if name not in known:
            raise ConfigError(
                f"reset has no option {name!r}; available: {', '.join(known)}. What belongs to the "
                "model or the rules is given where the environment is made; a state is set after "
                "the reset, by env.unwrapped.state = (…)"
            )
    try:
        # In gymnasium's own words, which CartPole-v1's users know.
        low, high = maybe_parse_reset_bounds(dict(options), *usual)
    except (ValueError, OverflowError) as error:
        raise ConfigError(str(error)) from error
    if not math.isfinite(high - low):
        raise ConfigError(f"reset starts between two finite bounds, not low={low}, high={high}")
    return low, high + 0.0
