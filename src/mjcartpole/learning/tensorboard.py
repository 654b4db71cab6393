"""A run's learning curve as TensorBoard events, by tensorboardX: it needs no framework."""

import contextlib
import importlib.util
from pathlib import Path
from typing import Final

import numpy as np

from mjcartpole.errors import ConfigError
from mjcartpole.files import atomic_write
from mjcartpole.learning.learner import Learner
from mjcartpole.learning.training import TrainResult

NAME: Final = "events.out.tfevents.0.mjcartpole"
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
    """Write the return and the method's rates per episode, in place of events that are there.

    Raises:
        ConfigError: tensorboardX is not installed.
    """
    check_installed()
    # Not its SummaryWriter: that one writes in a thread of its own, and hangs on a full disk.
    from tensorboardX.proto.event_pb2 import Event  # noqa: PLC0415 - an optional package
    from tensorboardX.record_writer import RecordWriter  # noqa: PLC0415
    from tensorboardX.summary import scalar  # noqa: PLC0415

    learner, returns = Learner(result.config, 1), result.returns
    begin_episode = learner.method.begin_episode
    with (
        atomic_write(folder / NAME) as temporary,
        contextlib.closing(RecordWriter(str(temporary))) as writer,
    ):
        writer.write(Event(wall_time=0, file_version="brain.Event:2").SerializeToString())
        for block in np.array_split(np.arange(len(returns)), min(POINTS, max(len(returns), 1))):
            if not block.size:
                continue
            number = int(block[-1])
            rates = begin_episode(learner.p, learner.memory, number, learner.episodes)
            values = {"return": float(returns[block].mean())} | rates._asdict()
            for name, value in values.items():
                summary = scalar(f"train/{name}", value)
                event = Event(wall_time=0, step=number + 1, summary=summary)
                writer.write(event.SerializeToString())
