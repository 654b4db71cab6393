"""Tests in closed form, against SciPy's."""

import doctest

import numpy as np
import pytest
from scipy import stats

from mjcartpole.studies.parity import significance
from mjcartpole.studies.parity.learning import CONFIDENCE, SEEDS
from mjcartpole.studies.parity.significance import STUDENT, same_distribution, same_frequencies


@pytest.mark.parametrize(("n", "shift"), [(1, 0), (4, 1), (40, 0.2), (300, 0), (300, 1)])
def test_two_samples(n, shift):
    rng = np.random.default_rng(n)
    a, b = rng.permutation(2 * n)[:n].tolist(), (rng.permutation(2 * n)[:n] + shift * n).tolist()
    exact = stats.ks_2samp(a, b, method="exact").pvalue
    assert same_distribution(a, b) == pytest.approx(exact, rel=1e-9)


@pytest.mark.parametrize(
    "counts",
    [((10, 20, 30), (12, 19, 29)), ((30, 5, 0), (20, 15, 0)), ((9, 1, 0), (10, 1, 0))],
)
def test_two_rows(counts):
    rows = np.array(counts)
    expected = stats.chi2_contingency(rows[:, rows.sum(axis=0) > 0]).pvalue
    assert same_frequencies(rows) == pytest.approx(expected, rel=1e-12)


def test_one_ending_is_the_same_for_both():
    assert same_frequencies(np.array([[9, 0, 0], [7, 0, 0]])) == 1.0


def test_students_quantile():
    assert pytest.approx(stats.t.ppf(0.5 + CONFIDENCE / 2, SEEDS - 1), rel=1e-14) == STUDENT


def test_doctests():
    assert doctest.testmod(significance).failed == 0
