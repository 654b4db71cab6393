"""`mjcartpole train`."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Self

from mjcartpole.commands.method_flags import fields_of, flags_of, given, lacking
from mjcartpole.commands.options import Command, Included
from mjcartpole.commands.train_options import RunLocation, TrainOptions
from mjcartpole.commands.words import value_of
from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.errors import ConfigError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.methods import METHODS


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
        if value_of("--resume", words, "None") != "None":
            _check_only_resumed(words)
        preset = value_of("--preset", words, RunLocation.preset)
        method = value_of("--method", words, TrainConfig.preset(preset).method)
        return cls(RunLocation(preset), config=TrainConfig.preset(preset, method=method))

    @classmethod
    def explain(cls, words: Sequence[str]) -> str | None:
        """Return which option the method lacks, and what it has."""
        others = ["resume", *_DECISIVE, *fields_of(TrainOptions)]
        return lacking(words, cls.default(words).config.method, others)

    def run(self) -> int:
        """Train one seed, many of them, or go on with either."""
        from mjcartpole.commands import train_one
        from mjcartpole.learning.folders import SEEDS
        from mjcartpole.learning.runs import content_of

        if self.how.allow_assets and self.resume is None:
            raise ConfigError("--allow-assets is for --resume; a new run's model may name any file")
        are_many = self.resume is not None and SEEDS in content_of(self.resume)
        if are_many or self.seeds != 1:
            return self._train_seeds()
        if self.how.workers is not None:
            raise ConfigError("--workers is for several --seeds")
        if self.resume is not None:
            return train_one.resume(self.resume, self.how)
        return train_one.train(self.config, self.how, self.where)

    def _train_seeds(self) -> int:
        from mjcartpole.commands import train_seeds

        if self.resume is not None:
            return train_seeds.resume(self.resume, self.how)
        return train_seeds.train(self.config, self.how, self.where, self.seeds)


_DECISIVE: Final = [
    "seeds",
    *(flag for group in (RunLocation, TrainConfig, Disturbances) for flag in fields_of(group)),
]
"""Flags of a new training, besides those of its method."""


def _check_only_resumed(words: Sequence[str]) -> None:
    """Refuse flags that would be ignored: a training that is resumed keeps its config."""
    decisive = {*_DECISIVE, *(flag for method in METHODS for flag in flags_of(method))}
    if asked := [f"--{flag}" for flag in dict.fromkeys(given(words)) if flag in decisive]:
        raise ConfigError(f"--resume continues a run as it began: leave out {', '.join(asked)}")
