"""Designs: every combination, by chance, or evenly spread."""

import doctest

import numpy as np
import pytest
from scipy.stats import qmc

from mjcartpole.errors import ConfigError
from mjcartpole.studies.study import design
from mjcartpole.studies.study.design import Factor, Range, _shares, points_of

ALPHA = Factor("alpha", Range(0.01, 1.0, log=True))
TIES = Factor("ties", ("first", "random"))


def test_the_examples():
    assert doctest.testmod(design).attempted == 1


def test_a_grid_has_every_combination_the_last_factor_first():
    found = points_of([TIES, Factor("alpha", (0.1, 0.2))], "grid", 0, 0)
    assert [tuple(point.values()) for point in found] == [
        ("first", 0.1),
        ("first", 0.2),
        ("random", 0.1),
        ("random", 0.2),
    ]


@pytest.mark.parametrize(
    ("levels", "expected"),
    [
        (Range(0.01, 1.0, log=True, levels=3), (0.01, 0.1, 1.0)),
        (Range(0.0, 1.0, levels=5), (0.0, 0.25, 0.5, 0.75, 1.0)),
        (Range(1, 10, whole=True, levels=4), (1, 4, 7, 10)),
        (Range(0.1, 0.4, levels=4), (0.1, 0.2, 0.3, 0.4)),
    ],
)
def test_a_range_on_a_grid_has_both_ends(levels, expected):
    assert levels.evenly() == expected


def test_a_latin_hypercube_has_one_point_in_each_slice_of_each_factor():
    n = 40
    found = points_of([ALPHA, Factor("gamma", Range(0.5, 1.0))], "latin", n, 3)
    slices = np.floor(n * (np.log10([point["alpha"] for point in found]) + 2) / 2)
    assert sorted(slices) == list(range(n))
    assert sorted(np.floor(2 * n * np.array([p["gamma"] for p in found]) - n)) == list(range(n))


def test_levels_and_whole_numbers_come_equally_often():
    factors = [TIES, Factor("n_steps", Range(1, 4, whole=True)), Factor("gamma", Range(0.0, 1.0))]
    found = points_of(factors, "latin", 80, 0)
    assert [sum(p["ties"] == each for p in found) for each in TIES.levels] == [40, 40]
    assert [sum(p["n_steps"] == n for p in found) for n in range(1, 5)] == [20] * 4
    assert type(found[0]["n_steps"]) is int


def test_more_random_samples_keep_those_before():
    few, many = (points_of([ALPHA, TIES], "random", n, 7) for n in (5, 9))
    assert many[:5] == few
    assert all(0.01 <= point["alpha"] <= 1 for point in many)
    assert points_of([ALPHA, TIES], "random", 5, 8) != few


def test_the_same_point_comes_once():
    assert len(points_of([TIES], "random", 50, 0)) == 2


def test_too_many_points_are_refused_before_they_are_made():
    levels = tuple(range(1000))
    with pytest.raises(ConfigError, match="make 1,000,000,000 points, and at most 100,000"):
        points_of([Factor(name, levels) for name in "abc"], "grid", 0, 0)


@pytest.mark.parametrize(("n", "samples"), [(1, 1), (3, 17)])
def test_a_latin_hypercube_is_scipys(n, samples):
    expected = qmc.LatinHypercube(n, seed=np.random.default_rng(7)).random(samples)
    assert _shares(n, "latin", samples, 7).tobytes() == expected.tobytes()
