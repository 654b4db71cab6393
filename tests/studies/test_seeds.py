"""Which seeds, and what they have come to."""

import pytest

from mjcartpole.errors import ConfigError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.studies.multi_seed import train_many
from mjcartpole.studies.seeds import ManyResult, SeedResult, check_seeds

CONFIG = TrainConfig(episodes=5, backend="gym", seed=4)


@pytest.mark.parametrize(
    ("seeds", "meant"), [(3, (4, 5, 6)), ([9, 0, 3], (9, 0, 3)), (range(2), (0, 1)), ([7], (7,))]
)
def test_a_number_stands_for_that_many_from_the_configs_own_on(seeds, meant):
    assert check_seeds(CONFIG, seeds) == meant


@pytest.mark.parametrize(
    ("seeds", "message"),
    [
        (0, "from 1 to 100,000, not 0"),
        (-1, "not -1"),
        (100_001, "not 100001"),
        ([], "at least one"),
        ([1, 2, 1], "different"),
        ([-1], "seed must be"),
        ([0.5], "seed must be"),
    ],
)
def test_seeds_that_make_no_sense(seeds, message):
    with pytest.raises(ConfigError, match=message):
        check_seeds(CONFIG, seeds)


def test_what_a_notebook_shows_is_short():
    many = train_many(TrainConfig(backend="gym", episodes=5), seeds=3)
    scores = many.scores
    figures = f"mean {sum(scores) / 3:.2f}, least {min(scores):.2f}"
    assert repr(many) == f"ManyResult(3 of 3 seeds evaluated, {figures})"
    assert repr(many.seeds[1]) == f"SeedResult(1: {many.seeds[1].evaluation!r})"
    assert repr(SeedResult(7, error="it fell")) == "SeedResult(7: it fell)"
    nothing = ManyResult(many.config, (SeedResult(7),))
    assert repr(nothing) == "ManyResult(0 of 1 seeds evaluated)"
