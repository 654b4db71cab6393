"""A training that is kept on disk as it goes."""

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

from mjcartpole.errors import ConfigError
from mjcartpole.files import write_whole
from mjcartpole.learning.checkpoints import Checkpoint, checksum, save_checkpoint
from mjcartpole.learning.greedy_curve import as_csv
from mjcartpole.learning.runs import EVALUATIONS
from mjcartpole.learning.training import Training
from mjcartpole.physics.cartpole import CartPole

CHECKPOINT_EVERY: Final = 30.0
"""Seconds between two checkpoints."""


def check_interval(seconds: float) -> None:
    """Refuse an interval between checkpoints that makes no sense.

    Raises:
        ConfigError: It is negative or no number.
    """
    if not seconds >= 0:
        raise ConfigError(f"checkpoint-every must be a number of seconds from 0 up, not {seconds}")


class Session:
    """Runs a training and saves its state: at intervals, when it is asked to stop, at the end.

    Attributes:
        training: What is run.
    """

    def __init__(
        self, folder: Path, training: Training, cartpole: CartPole, *, every: float
    ) -> None:
        """Take a folder that is claimed or locked (see runs.py), and the model that it stores.

        A checkpoint is saved after `every` so many seconds; 0: after each chunk of episodes.

        Raises:
            ConfigError: The interval makes no sense.
        """
        check_interval(every)
        self.training = training
        self._folder = folder
        self._every = every
        self._model = checksum(cartpole.stored[0])

    def run(self, stop: Callable[[], bool]) -> Iterator[int]:
        """Train until the end, or until `stop()` is true; yield the episodes done at each chunk.

        Raises:
            FileError: A checkpoint cannot be written; the last good one is still there.
            SimulationError: The physics diverged.
        """
        saved = time.monotonic()
        for finished in self.training.run():
            yield finished
            if stop():
                break
            if time.monotonic() - saved >= self._every:
                self.save()
                saved = time.monotonic()
        self.save()

    def resume(self, checkpoint: Checkpoint | None) -> None:
        """Go on from a checkpoint of this very training; from the beginning if there is none."""
        if checkpoint is not None:
            self._model = checkpoint.model
            self.training.restore(checkpoint.snapshot)

    def save(self) -> None:
        """Write a checkpoint now, and the greedy evaluations so far (FileError: see `run`)."""
        snapshot = self.training.snapshot()
        config = self.training.config
        save_checkpoint(self._folder, Checkpoint(config, self._model, snapshot))
        if config.evaluation_period is not None:
            write_whole(self._folder / EVALUATIONS, as_csv(snapshot.evaluations))

    @property
    def is_over(self) -> bool:
        """Whether nothing is left to train."""
        return self.training.is_over
