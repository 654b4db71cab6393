"""Contexts: what an episode draws of the numbers that vary, and the generator that draws it."""

import functools
import itertools
import math
from typing import Final, NamedTuple

import numpy as np

from mjcartpole.disturbances.ranges import Range
from mjcartpole.errors import ConfigError

Context = dict[str, float]
"""Numbers of a model, by the names that `--set` knows."""

STREAM: Final = 2
"""Spawn key of what draws disturbances."""

_BLOCK: Final = 64
"""Episodes whose contexts are drawn at once."""

POOL_SEED: Final = 0
"""Of the models that all trainings share."""


class Contexts(NamedTuple):
    """What episodes draw.

    Attributes:
        ranges: What varies.
        pool: How many contexts there are; 0 for a new one each time.
        widen: Over how many episodes the ranges widen.
    """

    ranges: tuple[Range, ...]
    pool: int
    widen: int

    def of(self, key: tuple[int, ...], number: int) -> Context:
        """Return the context of an episode, counted from 0; the key seeds what draws it."""
        width = min(1.0, (number + 1) / self.widen) if self.widen else 1.0
        drawn = _shares(key, number // _BLOCK, len(self.ranges))[number % _BLOCK]
        if self.pool:
            return self.models()[int(drawn[0] * math.ceil(width * self.pool))]
        shares = map(Range.narrowed, self.ranges, drawn, itertools.repeat(width))
        return {each.name: each.at(share) for each, share in zip(self.ranges, shares, strict=True)}

    def models(self) -> list[Context]:
        """Return the pool, what is nearest to the middle of the ranges first."""
        return _pool(self.ranges, self.pool)


@functools.lru_cache(maxsize=64)
def _shares(key: tuple[int, ...], block: int, n: int) -> list[list[float]]:
    """Numbers from 0 to 1 for each of a block of episodes: to seed a generator for each costs."""
    drawn: list[list[float]] = np.random.default_rng([*key, block]).random((_BLOCK, n)).tolist()
    return drawn


@functools.lru_cache(maxsize=16)
def _pool(ranges: tuple[Range, ...], size: int) -> list[Context]:
    drawn = np.random.default_rng(POOL_SEED).random((size, len(ranges))).tolist()
    drawn.sort(key=lambda shares: max(map(_off_middle, ranges, shares)))
    return [
        {each.name: each.at(share) for each, share in zip(ranges, shares, strict=True)}
        for shares in drawn
    ]


def _off_middle(each: Range, share: float) -> float:
    return share if each.kind == "choice" else abs(2.0 * share - 1.0)


class Chance(NamedTuple):
    """What draws the disturbances of one environment.

    Attributes:
        rng: Draws noise, shoves and losses, step after step.
        key: Seeds what draws the context of each episode, apart from what happened before.
    """

    rng: np.random.Generator
    key: tuple[int, ...]

    @classmethod
    def of(cls, np_random: np.random.Generator, index: int = 0) -> "Chance":
        """Return that of an environment, or one of several by its index, that a generator starts.

        It has a stream of its own from the same seed: episodes start as without disturbances.

        Raises:
            ConfigError: Nobody knows its seed.
        """
        seed = getattr(np_random.bit_generator, "seed_seq", None)
        if not isinstance(seed, np.random.SeedSequence):
            raise ConfigError(
                "disturbances are drawn from the seed of the environment's generator, and "
                f"{np_random!r} shows none; take numpy.random.default_rng(seed)"
            )
        own = np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, STREAM, index))
        rng = np.random.default_rng(own)
        return cls(rng, tuple(rng.integers(2**32, size=4).tolist()))

    def context(self, contexts: Contexts, number: int) -> Context:
        """Return what an episode draws, counted from 0."""
        return contexts.of(self.key, number)
