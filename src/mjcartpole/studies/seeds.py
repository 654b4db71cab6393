"""Seeds: which of a config are meant, and what they have come to."""

import dataclasses
import math
import reprlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple, Self

import numpy as np

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
        solved_after: Training episodes until a greedy evaluation in its midst reached what counts
            as solved; None if none did, or there were none.
    """

    seed: int
    evaluation: Evaluation | None = None
    result: TrainResult | None = None
    error: str = ""
    solved_after: int | None = None

    @classmethod
    def of(cls, result: TrainResult, evaluation: Evaluation | None) -> Self:
        """Return what a seed has come to that was trained to the end."""
        after = None if result.solved is None else result.solved.episodes
        return cls(result.config.seed, evaluation, result, solved_after=after)

    @property
    def score(self) -> float | None:
        """Mean greedy return."""
        return None if self.evaluation is None else self.evaluation.mean

    def __repr__(self) -> str:
        outcome = self.error or self.evaluation or "not finished"
        return f"SeedResult({self.seed}: {outcome})"


class Solving(NamedTuple):
    """How many episodes it took seeds until a greedy evaluation reached what counts as solved."""

    at: float
    """That mean return."""
    seeds: int
    """How many were trained to the end."""
    solved: int
    """How many of these were solved."""
    median: int | None
    """Episodes within which half of them were; None where fewer were solved at all."""
    p95: int | None
    """Episodes within which 95 % of them were; None likewise."""


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

    def solving(self) -> Solving | None:
        """Return how soon the seeds were solved; None where their trainings were not evaluated."""
        found = [each.solved_after for each in self.seeds if each.evaluation is not None]
        at = self.config.solved_at
        if self.config.evaluation_period is None or at is None or not found:
            return None
        after = np.array([math.inf if each is None else each for each in found])
        # Numbers that seeds have: between an episode and none at all there is no middle.
        within = np.quantile(after, (0.5, 0.95), method="inverted_cdf")
        median, p95 = (int(n) if math.isfinite(n) else None for n in within)
        return Solving(at, len(found), int(np.isfinite(after).sum()), median, p95)

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
