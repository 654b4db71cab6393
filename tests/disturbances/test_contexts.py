"""What episodes draw of the numbers that vary."""

import numpy as np
import pytest

from mjcartpole.disturbances.contexts import Chance, Contexts
from mjcartpole.disturbances.ranges import parse_ranges
from mjcartpole.errors import ConfigError

RANGES = parse_ranges({"pole.length": (0.5, 1.5), "force": (8.0, 12.0), "cart.mass": (1, 2, 3)})


def chance(seed: int = 0, index: int = 0) -> Chance:
    return Chance.of(np.random.default_rng(seed), index)


def lengths(contexts: Contexts, episodes: range, seed: int = 0) -> np.ndarray:
    drawn = [chance(seed).context(contexts, number) for number in episodes]
    return np.array([each["pole.length"] for each in drawn])


def test_contexts_are_uniform_and_reproducible() -> None:
    contexts = Contexts(RANGES, 0, 0)
    drawn = lengths(contexts, range(2_000))
    assert (drawn == lengths(contexts, range(2_000))).all()
    assert len(set(drawn.tolist())) == 2_000
    share = np.sort(drawn - 0.5)
    assert np.abs(share - np.arange(2_000) / 2_000).max() < 0.04, "Kolmogorov and Smirnov"
    assert (lengths(contexts, range(9), seed=1) != drawn[:9]).all()


def test_an_episode_draws_the_same_whatever_came_before() -> None:
    contexts, one = Contexts(RANGES, 0, 0), chance()
    alone = one.context(contexts, 7)
    one.rng.random(100)
    assert one.context(contexts, 7) == alone


def test_a_pool_is_the_same_for_every_seed() -> None:
    contexts = Contexts(RANGES, 10, 0)
    drawn = {tuple(chance(seed).context(contexts, 0).values()) for seed in range(200)}
    assert drawn == {tuple(each.values()) for each in contexts.models()}
    assert len(drawn) == 10


@pytest.mark.parametrize("pool", [0, 50])
def test_ranges_widen_from_their_middle(pool: int) -> None:
    contexts = Contexts(RANGES[:1], pool, 100)
    off = np.array(
        [
            np.abs(lengths(contexts, range(number, number + 1), seed) - 1.0).max()
            for number in (0, 24, 99, 5_000)
            for seed in range(40)
        ]
    ).reshape(4, 40)
    first, quarter, last, after = off.max(axis=1)
    assert first < 0.02
    assert first < quarter < 0.2
    assert min(last, after) > 0.4


def test_several_environments_draw_apart_and_leave_their_generator_alone() -> None:
    rng = np.random.default_rng(3)
    before = rng.bit_generator.state
    chances = [Chance.of(rng, index) for index in range(3)]
    assert rng.bit_generator.state == before
    assert len({each.key for each in chances}) == 3
    assert len({float(each.rng.random()) for each in chances}) == 3


def test_a_generator_that_cannot_jump_is_refused() -> None:
    with pytest.raises(ConfigError, match="SFC64 cannot; take numpy's PCG64"):
        Chance.of(np.random.Generator(np.random.SFC64(0)))
