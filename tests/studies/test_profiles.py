"""Profiles and shares of variance, against definitions and functions with known answers."""

import itertools

import numpy as np
import pytest

from mjcartpole.errors import ConfigError
from mjcartpole.studies.profiles import performance_profile, shares_above, variance_shares


def test_a_profile_is_the_share_of_runs_above_each_threshold():
    found = performance_profile([1.0, 2.0, 3.0, 4.0], [0, 1, 2, 2.5, 4, 5])
    assert found.shares.tolist() == [1, 0.75, 0.5, 0.5, 0, 0]
    assert (found.low <= found.shares).all() and (found.shares <= found.high).all()
    # Above the least of all and the largest there is nothing to be lucky about.
    assert found.low[0] == found.high[0] == 1 and found.low[-1] == found.high[-1] == 0


def test_over_tasks_it_is_the_mean_of_their_shares():
    scores = np.random.default_rng(0).normal(size=(7, 5))
    by_task = [[(task > t).mean() for t in (-1, 0, 1)] for task in scores.T]
    assert shares_above(scores, [-1, 0, 1]) == pytest.approx(np.mean(by_task, axis=0))


def test_its_interval_is_as_wide_as_the_binomial_distribution_says():
    scores = np.arange(400.0)
    found = performance_profile(scores, [99.5], resamples=4000)
    deviation = np.sqrt(0.75 * 0.25 / 400)
    assert found.high[0] - found.low[0] == pytest.approx(2 * 1.96 * deviation, rel=0.05)


def grid(*levels, repeats=1):
    rows = [row for row in itertools.product(*map(range, levels)) for _ in range(repeats)]
    return {
        name: np.array(column) for name, column in zip("abc", zip(*rows, strict=True), strict=False)
    }


def test_shares_of_effects_that_add_up_are_their_squares():
    factors = grid(2, 2)
    found = variance_shares(2.0 * factors["a"] + factors["b"], factors)
    assert found == pytest.approx({("a",): 0.8, ("b",): 0.2, ("a", "b"): 0}, abs=1e-12)


def test_what_only_a_pair_explains_is_the_pairs():
    factors = grid(2, 2, 3, repeats=2)
    found = variance_shares((factors["a"] ^ factors["b"]).astype(float), factors)
    assert found.pop(("a", "b")) == pytest.approx(1)
    assert found == pytest.approx(dict.fromkeys(found, 0), abs=1e-12)


def test_what_seeds_explain_is_no_factors():
    factors = grid(2, repeats=2)
    # Levels are 1 apart, and so are the two seeds of each.
    found = variance_shares(factors["a"] + np.tile([0.0, 1.0], 2), factors)
    assert found == pytest.approx({("a",): 0.5})


def test_a_factor_without_effect_explains_what_chance_says():
    rng, shares = np.random.default_rng(1), []
    factors = grid(5, repeats=8)
    for _ in range(400):
        shares.append(variance_shares(rng.normal(size=40), factors)["a",])
    assert np.mean(shares) == pytest.approx(4 / 39, rel=0.1)


def test_ishigamis_function_has_its_published_indices():
    # Ishigami and Homma 1990; a = 7, b = 0.1 as in Saltelli et al. 2010: 0.3139, 0.4424, 0, and
    # 0.2437 of the first with the third.
    at = -np.pi + 2 * np.pi * (np.arange(40) + 0.5) / 40
    factors = grid(40, 40, 40)
    x, y, z = (at[factors[name]] for name in "abc")
    found = variance_shares(np.sin(x) + 7 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x), factors)
    assert found["a",] == pytest.approx(0.3139, abs=0.003)
    assert found["b",] == pytest.approx(0.4424, abs=0.003)
    assert found["c",] == pytest.approx(0, abs=1e-9)
    assert found["a", "c"] == pytest.approx(0.2437, abs=0.003)
    assert sum(found.values()) == pytest.approx(1)


@pytest.mark.parametrize(("score", "n"), [(3.0, 6), (0.1, 12), (118 / 3, 10)])
def test_scores_that_do_not_vary_are_explained_by_nothing(score, n):
    # The mean of twelve times 0.1 is not 0.1.
    found = variance_shares(np.full(n, score), {"a": np.arange(n) % 2, "b": np.arange(n) // 2 % 2})
    assert not any(found.values())


def test_levels_that_do_not_fit_are_refused():
    with pytest.raises(ConfigError, match=r"a level is needed for each score, shape \(3,\)"):
        variance_shares([1, 2, 3], grid(2))
