"""The grid of a training: for its number of poles, and mirrored where all is alike."""

import dataclasses
from typing import Any

import gymnasium

from mjcartpole.errors import ConfigError, SimulationError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.edit.semantic_edits import meaning_of
from mjcartpole.physics.symmetry import check_symmetric
from mjcartpole.physics.variants import variant


def training_grid(
    config: TrainConfig, cartpole: CartPole | None, env: gymnasium.Env[Any, Any] | None = None
) -> Discretizer:
    """Return the grid of a training, mirrored if that is asked for, or open and all is symmetric.

    Backend gym has a model of its own, and of an environment of one's own nothing is known.

    Raises:
        ConfigError: It is for another number of poles, or what is to be mirrored is not symmetric.
    """
    cartpole = None if config.backend == "gym" else cartpole
    poles = _count_poles(cartpole, env)
    config.check_world(poles, config.rules)
    grid = config.discretizer(poles)
    if config.mirror is False or (config.mirror is None and env is not None):
        return grid
    try:
        _check_alike(config, cartpole)
        return dataclasses.replace(grid, mirror=True)
    except (ConfigError, SimulationError):
        if config.mirror:
            raise
        return grid


def _check_alike(config: TrainConfig, cartpole: CartPole | None) -> None:
    """Refuse to mirror where left and right differ, of a model or of one of its variants."""
    if config.disturbances.one_sided:
        raise ConfigError(
            f"mirror needs left and right to be alike; {config.disturbances.one_sided} tells them "
            "apart"
        )
    check_symmetric(cartpole, config.integrator, task=config.rules)
    if cartpole is None:
        return
    # What is edited by meaning leaves left and right as they are.
    for each in config.disturbances.ranges:
        for end in each.bounds if meaning_of(each.name) is None else ():
            changed = variant(cartpole, {each.name: end})
            check_symmetric(changed, config.integrator, task=config.rules)


def _count_poles(cartpole: CartPole | None, env: gymnasium.Env[Any, Any] | None) -> int:
    if env is not None:
        assert env.observation_space.shape is not None
        return env.observation_space.shape[0] // 2 - 1
    return 1 if cartpole is None else cartpole.poles
