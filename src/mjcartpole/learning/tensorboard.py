"""A run's learning curve as TensorBoard events, by tensorboardX: it needs no framework."""

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import numpy as np

from mjcartpole.files import atomic_write
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.learner import Learner
from mjcartpole.learning.training import TrainResult
from mjcartpole.packages import check_installed

NAME: Final = "events.out.tfevents.0.mjcartpole"
POINTS: Final = 10_000
"""The most points of a curve; longer trainings are drawn as means of blocks."""

_ONE_STATE: Final = Discretizer((1,), (-1.0,), (1.0,))
"""No rates depend on what is learned, so there need be no table."""


def write_events(folder: Path, result: TrainResult) -> None:
    """Write returns, the method's rates and greedy means in place of events that are there.

    Raises:
        ConfigError: tensorboardX is not installed.
    """
    check_installed("--tensorboard", "tensorboardX")
    # Not its SummaryWriter: that one writes in a thread of its own, and hangs on a full disk.
    from tensorboardX.proto.event_pb2 import Event  # noqa: PLC0415 - an optional package
    from tensorboardX.record_writer import RecordWriter  # noqa: PLC0415
    from tensorboardX.summary import scalar  # noqa: PLC0415

    with (
        atomic_write(folder / NAME) as temporary,
        contextlib.closing(RecordWriter(str(temporary))) as writer,
    ):
        writer.write(Event(wall_time=0, file_version="brain.Event:2").SerializeToString())
        for step, values in _points(result):
            for name, value in values.items():
                summary = scalar(f"train/{name}", value)
                writer.write(Event(wall_time=0, step=step, summary=summary).SerializeToString())


def _points(result: TrainResult) -> Iterator[tuple[int, dict[str, float]]]:
    """Yield numbers of episodes, with values by the names of their curves."""
    learner, returns = Learner(result.config, _ONE_STATE), result.returns
    begin_episode = learner.method.begin_episode
    for block in np.array_split(np.arange(len(returns)), min(POINTS, max(len(returns), 1))):
        if block.size:
            number = int(block[-1])
            rates = begin_episode(learner.p, learner.memory, number, learner.episodes)
            yield number + 1, {"return": float(returns[block].mean())} | rates._asdict()
    for point in result.evaluations:
        yield point.episodes, {"greedy_mean": point.mean, "greedy_minimum": point.minimum}
