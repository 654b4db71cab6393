"""Which seeds, and what they have come to."""

import dataclasses

import pytest

from mjcartpole.errors import ConfigError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.episodes import Episode
from mjcartpole.learning.evaluation import Evaluation
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


def evaluated(*solved_after, **changes):
    evaluation = Evaluation("gym", 0, (Episode(0, 9.0, 9, "pole fell"),))
    config = dataclasses.replace(CONFIG, **{"evaluate_every": 1, **changes})
    found = [SeedResult(n, evaluation, solved_after=after) for n, after in enumerate(solved_after)]
    return ManyResult(config, (*found, SeedResult(90, error="it fell"), SeedResult(91)))


@pytest.mark.parametrize(
    ("solved_after", "solved", "median", "p95"),
    [
        ((30, 10, 20), 3, 20, 30),
        ((4, 1, 3, 2), 4, 2, 4),
        ((None, 10, 20), 2, 20, None),
        ((None, 10), 1, 10, None),
        ((None, None, 20), 1, None, None),
        ((*range(1, 20), None), 19, 10, 19),
    ],
)
def test_within_how_many_episodes_seeds_are_solved(solved_after, solved, median, p95):
    found = evaluated(*solved_after, until=300).solving()
    assert found == (300, len(solved_after), solved, median, p95)


def test_seeds_that_were_not_evaluated_say_nothing_of_when_they_were_solved():
    assert evaluated(3, evaluate_every=None).solving() is None
    assert evaluated().solving() is None


def test_what_a_notebook_shows_is_short():
    many = train_many(TrainConfig(backend="gym", episodes=5), seeds=3)
    scores = many.scores
    figures = f"mean {sum(scores) / 3:.2f}, least {min(scores):.2f}"
    assert repr(many) == f"ManyResult(3 of 3 seeds evaluated, {figures})"
    assert repr(many.seeds[1]) == f"SeedResult(1: {many.seeds[1].evaluation!r})"
    assert repr(SeedResult(7, error="it fell")) == "SeedResult(7: it fell)"
    nothing = ManyResult(many.config, (SeedResult(7),))
    assert repr(nothing) == "ManyResult(0 of 1 seeds evaluated)"
