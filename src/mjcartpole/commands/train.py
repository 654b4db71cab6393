"""`mjcartpole train`."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Self

from mjcartpole.commands.method_flags import lacking
from mjcartpole.commands.options import Command, Included
from mjcartpole.commands.train_options import RunLocation, TrainOptions
from mjcartpole.commands.words import value_of
from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.errors import ConfigError
from mjcartpole.learning.config import TrainConfig


@dataclass(frozen=True)
class Train(Command):
    """Train a Q-table, evaluate it, and film it."""

    where: Included[RunLocation] = field(default_factory=RunLocation)
    resume: Path | None = None
    """Continue the training of this run folder, or from a checkpoint in it, as it began."""
    seeds: int = 1
    """Train this many seeds from --seed on, side by side, for statistics; nothing is filmed."""
    how: Included[TrainOptions] = field(default_factory=TrainOptions)
    config: Included[TrainConfig] = field(default_factory=TrainConfig)

    @classmethod
    def default(cls, words: Sequence[str]) -> Self:
        """Return the defaults of the preset and the method that the words name."""
        preset = value_of("--preset", words, RunLocation.preset)
        method = value_of("--method", words, TrainConfig.preset(preset).method)
        return cls(RunLocation(preset), config=TrainConfig.preset(preset, method=method))

    @classmethod
    def explain(cls, words: Sequence[str]) -> str | None:
        """Return which option the method lacks, and what it has."""
        groups = (cls, RunLocation, TrainOptions, TrainConfig, Disturbances)
        others = [each.name for group in groups for each in dataclasses.fields(group)]
        said = lacking(words, cls.default(words).config.method, others)
        if said and value_of("--resume", words, ""):
            return f"--resume continues a run as it began: leave out what only trains; {said}"
        return said

    def run(self) -> int:
        """Train one seed, many of them, or go on with either."""
        from mjcartpole.commands import train_one, train_seeds
        from mjcartpole.learning.folders import SEEDS
        from mjcartpole.learning.runs import content_of

        if self.how.allow_assets and self.resume is None:
            raise ConfigError("--allow-assets is for --resume; a new run's model may name any file")
        if self.resume is not None:
            self._check_only_resumed()
        if self.resume is not None and SEEDS in content_of(self.resume):
            return train_seeds.resume(self.resume, self.how)
        if self.seeds != 1:
            return train_seeds.train(self.config, self.how, self.where, self.seeds)
        if self.how.workers is not None:
            raise ConfigError("--workers is for several --seeds")
        if self.resume is not None:
            return train_one.resume(self.resume, self.how)
        return train_one.train(self.config, self.how, self.where)

    def _check_only_resumed(self) -> None:
        """Refuse flags that would be ignored: a training that is resumed keeps its config."""
        usual = TrainConfig.preset(self.where.preset, method=self.config.method).values()
        usual["method"] = TrainConfig.preset(self.where.preset).method
        given = [name for name, value in self.config.values().items() if value != usual[name]]
        given += [
            each.name
            for each in dataclasses.fields(RunLocation)
            if getattr(self.where, each.name) != each.default
        ]
        given += ["seeds"] if self.seeds != 1 else []
        if given:
            flags = ", ".join(f"--{name.replace('_', '-')}" for name in given)
            raise ConfigError(f"--resume continues a run as it began: leave out {flags}")
