"""Seeds: which of a config are meant, and what they have come to."""

import dataclasses
import reprlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from mjcartpole.errors import ConfigError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.evaluation import Evaluation
from mjcartpole.learning.training import TrainResult
from mjcartpole.studies.statistics import Aggregate, aggregate

MAX_SEEDS: Final = 100_000


@dataclass(frozen=True, eq=False, repr=False)
class SeedResult:
    """What one seed has come to.

    Attributes:
        seed: The seed.
        evaluation: The greedy evaluation; None if the seed failed or was stopped.
        result: What was learned; None if the seed failed, or was complete on disk before.
        error: Why it failed; empty if it did not.
    """

    seed: int
    evaluation: Evaluation | None = None
    result: TrainResult | None = None
    error: str = ""

    @property
    def score(self) -> float | None:
        """Mean greedy return."""
        return None if self.evaluation is None else self.evaluation.mean

    def __repr__(self) -> str:
        outcome = self.error or self.evaluation or "not finished"
        return f"SeedResult({self.seed}: {outcome})"


@dataclass(frozen=True, eq=False, repr=False)
class ManyResult:
    """What many seeds have come to.

    Attributes:
        config: What was trained; its seed is the first.
        seeds: One result for each, in order.
    """

    config: TrainConfig
    seeds: tuple[SeedResult, ...]

    @property
    def scores(self) -> list[float]:
        """Mean greedy return of each seed that was evaluated."""
        return [found.score for found in self.seeds if found.score is not None]

    @property
    def failed(self) -> list[SeedResult]:
        """The seeds that ended in an error."""
        return [found for found in self.seeds if found.error]

    def aggregate(self) -> Aggregate | None:
        """Return statistics over the scores; None where there are none."""
        if not self.scores:
            return None
        return aggregate(self.scores, solved_at=self.config.rules.reward_threshold)

    def __repr__(self) -> str:
        count, scores = len(self.seeds), self.scores
        reached = (
            f", mean {sum(scores) / len(scores):.2f}, least {min(scores):.2f}" if scores else ""
        )
        return f"ManyResult({len(scores)} of {count} seeds evaluated{reached})"


def check_seeds(config: TrainConfig, seeds: int | Sequence[int]) -> tuple[int, ...]:
    """Return the seeds that are meant; a number stands for that many from the config's own on.

    Raises:
        ConfigError: They are too many, none, the same twice, or no seeds.
    """
    if isinstance(seeds, int):
        if not 1 <= seeds <= MAX_SEEDS:
            raise ConfigError(f"seeds must be a number from 1 to {MAX_SEEDS:,}, not {seeds}")
        seeds = range(config.seed, config.seed + seeds)
    if not 1 <= len(seeds) <= MAX_SEEDS or len(set(seeds)) != len(seeds):
        raise ConfigError(
            f"seeds must be different numbers, at least one and at most {MAX_SEEDS:,}, "
            f"not {reprlib.repr(list(seeds))}"
        )
    for seed in (min(seeds), max(seeds)):
        _ = dataclasses.replace(config, seed=seed)
    return tuple(seeds)


def seed_folder(folder: Path, seed: int) -> Path:
    """Return where one seed's run lies in the folder of many."""
    return folder / f"seed-{seed}"
