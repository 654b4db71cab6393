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


def test_what_a_generator_has_drawn_makes_no_difference() -> None:
    rng = np.random.default_rng(3)
    first = Chance.of(rng).key
    rng.random(5)
    assert Chance.of(rng).key == first


def test_a_generator_without_a_seed_is_refused() -> None:
    class Entropy(np.random.bit_generator.ISeedSequence):
        def generate_state(self, n_words: int, dtype: type = np.uint32) -> np.ndarray:
            return np.ones(n_words, dtype)

    with pytest.raises(ConfigError, match=r"shows none; take numpy.random.default_rng\(seed\)"):
        Chance.of(np.random.Generator(np.random.PCG64(Entropy())))
