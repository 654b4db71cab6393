"""What `reset(options=…)` takes."""

import math
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from gymnasium.envs.classic_control.utils import maybe_parse_reset_bounds

from mjcartpole import task
from mjcartpole.errors import ConfigError


class ResetOptions(NamedTuple):
    """How an episode starts; all of it holds until the next reset.

    Attributes:
        low: Lower bound of each of the starting state's values.
        high: Upper bound.
        edits: Changes of the model (see `load_model`); empty for none.
    """

    low: float = task.RESET_LOW
    high: float = task.RESET_HIGH
    edits: Any = ()


USUAL: Final = ResetOptions()
"""Without options."""


def reset_options(options: Mapping[str, Any] | None) -> ResetOptions:
    """The options of a reset, checked; what is left out is as usual.

    Raises:
        ConfigError: There is no such option, a bound is no finite number, or low is above high.
    """
    if options is None:
        return USUAL
    given = USUAL._replace(**_known(options))
    try:
        # In gymnasium's own words, which CartPole-v1's users know.
        low, high = maybe_parse_reset_bounds({"low": given.low, "high": given.high}, *USUAL[:2])
    except (ValueError, OverflowError) as error:
        raise ConfigError(str(error)) from error
    if not math.isfinite(high - low):
        raise ConfigError(f"reset starts between two finite bounds, not low={low}, high={high}")
    return ResetOptions(low, high, given.edits or ())


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
