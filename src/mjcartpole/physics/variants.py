"""Variants of a model: what episodes of varied physics move, each from a document of its own."""

from typing import Final

import mujoco
import numpy as np

from mjcartpole.disturbances.contexts import Context, Contexts
from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.disturbances.effects import Effects
from mjcartpole.errors import ConfigError, ModelError
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.load import load_shared
from mjcartpole.task import CONTROL_STEP, Task

MOST: Final = 1_000
"""How many are kept."""

_kept: dict[tuple[str, str, bool, int, tuple[tuple[str, float], ...]], CartPole] = {}


def variant(base: CartPole, context: Context) -> CartPole:
    """Return the model that `load_model(base, edits=context)` is; shared by all.

    Raises:
        ConfigError: A number makes no sense.
        ModelError: It makes the model one that cannot be used.
    """
    key = (base.xml, base.name, base.has_own_timestep, base.substeps, tuple(context.items()))
    found = _kept.get(key)
    if found is None:
        found = load_shared(base, context, own_timestep=base.has_own_timestep)
        _kept[key] = found
        for oldest in list(_kept)[: max(0, len(_kept) - MOST)]:
            _kept.pop(oldest, None)
    return found


def contexts_of(base: CartPole, disturbances: Disturbances) -> Contexts:
    """Return what episodes draw, after a look at the ends of each range.

    Raises:
        ConfigError: An end makes no sense; names the range.
    """
    ranges = disturbances.ranges
    for each in ranges:
        # The ends and two places within: what divides a control step, say, not all between do.
        shares = () if each.kind == "choice" else (0.382, 0.5)
        for end in dict.fromkeys((*each.bounds, *map(each.at, shares))):
            try:
                variant(base, {each.name: end})
            except (ConfigError, ModelError) as error:
                raise ConfigError(f"vary {each.text!r} cannot be: {error}") from error
    return Contexts(ranges, disturbances.pool or 0, disturbances.widen)


def effects_on(
    cartpole: CartPole | None, disturbances: Disturbances, task: Task
) -> tuple[Effects, list[float]]:
    """Return what disturbances do to a model, and the memory of an episode; None is gymnasium's.

    Raises:
        ConfigError: They make no sense here.
    """
    if cartpole is None:
        return disturbances.effects(1, CONTROL_STEP, task)
    return disturbances.effects(cartpole.poles, cartpole.control_step, task)


def write_numbers(source: mujoco.MjModel, target: mujoco.MjModel) -> None:
    """Make a compiled model another one that differs by its numbers only, in place.

    Raises:
        ConfigError: They differ by more.
    """
    for part in ("", "opt", "stat", "vis"):
        here, there = (getattr(each, part) if part else each for each in (source, target))
        for name in dir(here):
            value = getattr(here, name)
            if name.startswith("_") or callable(value):
                continue
            if isinstance(value, np.ndarray):
                array = getattr(there, name)
                if array.shape != value.shape:
                    raise ConfigError(f"{name} is of another shape in a variant of this model")
                if array.flags.writeable:
                    array[...] = value
            elif part and isinstance(value, int | float):
                setattr(there, name, value)
