"""`mjcartpole watch`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from mjcartpole.commands.options import VIDEOS, Command
from mjcartpole.errors import ConfigError
from mjcartpole.files import check_writable, make_folder
from mjcartpole.integrator import Integrator, check_integrator
from mjcartpole.learning.config import TrainConfig
from mjcartpole.signals import Interrupted, StopSignals


@dataclass(frozen=True)
class Watch(Command):
    """On every save of a model's file: check it, prove it, train on it, film it."""

    file: Annotated[Path, tyro.conf.Positional]
    """An MJCF file."""
    preset: str = "tuned"
    """How to train."""
    episodes: int | None = None
    """Episodes to train; the preset's if left out."""
    integrator: Integrator = "gym"
    """gym: explicit Euler, as CartPole-v1; mujoco: the integrator that the file names."""
    own_timestep: bool = False
    """Let a control step be one physics step of the file, instead of 0.02 s."""
    seed: int = 0
    """Seeds the training."""
    video: bool = True
    """Film it."""
    once: int | None = None
    """End after this many saves, the first look included."""

    def run(self) -> int:
        """Show what the model comes to, now and after every save."""
        from mjcartpole.commands.watch_work import WatchWork
        from mjcartpole.commands.watched_file import Watched
        from mjcartpole.physics.load import find_model
        from mjcartpole.physics.simulation import silence_mujoco

        silence_mujoco()
        check_integrator(self.integrator)
        if self.once is not None and self.once < 1:
            raise ConfigError(f"once must be a whole number from 1 up, not {self.once}")
        file = find_model(self.file)
        signals = StopSignals()
        work = WatchWork(Watched(file), self._config(file), self.video, signals)
        check_writable(make_folder(VIDEOS))
        with signals.caught():
            try:
                work.go_on(self.once)
            except Interrupted:
                raise Interrupted(f"no longer watching {file}", signals.number) from None
        return 0

    def _config(self, file: Path) -> TrainConfig:
        changes: dict[str, Any] = {} if self.episodes is None else {"episodes": self.episodes}
        return TrainConfig.preset(
            self.preset,
            model=str(file),
            integrator=self.integrator,
            own_timestep=self.own_timestep,
            seed=self.seed,
            **changes,
        )
