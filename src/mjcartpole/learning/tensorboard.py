"""A run's learning curve as TensorBoard events, by tensorboardX: it needs no framework."""

import importlib.util
from pathlib import Path
from typing import Final

import numpy as np

from mjcartpole.errors import ConfigError
from mjcartpole.learning.schedules import LinearSchedule
from mjcartpole.learning.training import TrainResult

PATTERN: Final = "events.out.tfevents.*"
POINTS: Final = 10_000
"""The most points of a curve; longer trainings are drawn as means of blocks."""


def check_installed() -> None:
    """Refuse where the writer is missing.

    Raises:
        ConfigError: See above.
    """
    if importlib.util.find_spec("tensorboardX") is None:
        raise ConfigError(
            "--tensorboard needs the package tensorboardX: pip install 'mjcartpole[tensorboard]'"
        )


def write_events(folder: Path, result: TrainResult) -> None:
    """Write return, step size and exploration per episode, in place of events that are there.

    Raises:
        ConfigError: tensorboardX is not installed.
    """
    check_installed()
    from tensorboardX import SummaryWriter  # noqa: PLC0415 - an optional package

    config, returns = result.config, result.returns
    slope = config.decay * config.episodes
    alpha = LinearSchedule(config.alpha, config.alpha_final, slope)
    epsilon = LinearSchedule(config.epsilon, config.epsilon_final, slope)
    for old in folder.glob(PATTERN):
        old.unlink()
    with SummaryWriter(str(folder)) as writer:
        for block in np.array_split(np.arange(len(returns)), min(POINTS, max(len(returns), 1))):
            if not block.size:
                continue
            number = int(block[-1])
            writer.add_scalar("train/return", float(returns[block].mean()), number + 1)
            writer.add_scalar("train/alpha", alpha(number), number + 1)
            writer.add_scalar("train/epsilon", epsilon(number), number + 1)
