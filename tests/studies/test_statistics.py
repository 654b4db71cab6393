"""Averages and intervals over few runs: by hand, against scipy, by simulation."""

import functools
import itertools
import json
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from mjcartpole.studies import statistics
from mjcartpole.studies.statistics import (
    Interval,
    aggregate,
    bootstrap_band,
    bootstrap_interval,
    improvement_interval,
    iqm,
    probability_of_improvement,
)
from nightly import examples

number = st.floats(-1000, 1000).map(lambda value: round(value, 3))
runs = st.lists(number, min_size=1, max_size=25)
few_values = st.lists(st.integers(0, 4), min_size=1, max_size=12)
"""Scores with many ties."""


def spread(n=20, m=None, seed=0):
    """Normal scores of n runs, on m tasks where m is given."""
    return np.random.default_rng(seed).normal(size=n if m is None else (n, m))


def near(interval, tolerance=1e-9):
    return pytest.approx(tuple(interval), abs=tolerance)


@pytest.mark.parametrize(
    ("scores", "expected"),
    [
        ([7], 7),
        ([0, 10], 5),
        ([0, 0, 9], 3),
        ([-100, 1, 3, 100], 2),
        ([0, 1, 2, 3, 100], 2),
        ([-100, 1, 2, 3, 4, 5, 100], 3),
        ([1, 2, 3, 4, 5, 6, 7, 8], 4.5),
        ([8, 1, 7, 2, 6, 3, 5, 4], 4.5),
        ([[1, 5], [2, 6], [3, 7], [4, 8]], 4.5),
        ([[0, 100], [1, 101]], 50.5),
        ([500.0] * 15 + [9.0] * 5, 500.0),
        ([500.0] * 14 + [9.0] * 6, 500 - 491 / 10),
    ],
)
def test_interquartile_means_by_hand(scores, expected):
    assert iqm(scores) == pytest.approx(expected, rel=1e-14)


@given(st.integers(1, 30), st.integers(1, 5), st.integers(0, 2**32))
def test_the_interquartile_mean_is_rliables(n, m, seed):
    """Its definition is this call of scipy."""
    scores = spread(n, m, seed)
    assert iqm(scores) == pytest.approx(stats.trim_mean(scores, 0.25, axis=None), abs=1e-12)


@given(runs, st.integers(0, 2**32))
def test_the_order_of_runs_changes_no_bit(scores, seed):
    shuffled = np.random.default_rng(seed).permutation(scores)
    assert iqm(shuffled) == iqm(scores)


@given(runs, number, number)
def test_shift_and_scale_go_through_the_interquartile_mean(scores, shift, scale):
    moved = scale * np.array(scores) + shift
    assert iqm(moved) == pytest.approx(scale * iqm(scores) + shift, rel=1e-9, abs=1e-6)


@given(runs, st.data())
def test_a_better_score_never_lowers_the_interquartile_mean(scores, data):
    run = data.draw(st.integers(0, len(scores) - 1))
    better = list(scores)
    better[run] += data.draw(st.floats(0, 1000))
    assert iqm(better) >= iqm(scores) - 1e-9


def test_the_scores_stay_as_they_were():
    scores = spread(20, 3)
    before = scores.copy()
    aggregate(scores, solved_at=0)
    probability_of_improvement(scores, scores)
    assert np.array_equal(scores, before)


@pytest.mark.parametrize(
    ("confidence", "expected"), [(0.95, (0, 1)), (0.55, (0, 1)), (0.45, (0.5, 0.5))]
)
def test_an_interval_by_hand(confidence, expected):
    """Two runs, 0 and 1, have resampled means 0, 1/2, 1 with probabilities 1/4, 1/2, 1/4."""
    assert bootstrap_interval([0, 1], np.mean, confidence=confidence) == expected


@pytest.mark.parametrize("statistic", [iqm, np.mean, np.min])
def test_the_interval_is_that_of_all_resamples(statistic):
    scores = np.array([1.0, 4.0, 6.0, 7.0, 12.0])
    every = [statistic(np.array(sample)) for sample in itertools.product(scores, repeat=5)]
    low, high = np.quantile(every, (0.1, 0.9))
    drawn = bootstrap_interval(scores, statistic, confidence=0.8)
    assert drawn == near((low, high), 0.201)


@pytest.mark.parametrize("n", [5, 20])
@pytest.mark.parametrize(
    ("ours", "scipys"),
    [
        (np.mean, np.mean),
        (iqm, lambda sample, axis: stats.trim_mean(sample, 0.25, axis=axis)),
        (np.std, np.std),
    ],
)
def test_the_plain_interval_is_scipys(n, ours, scipys):
    scores = spread(n)
    theirs = stats.bootstrap(
        (scores,), scipys, n_resamples=10_000, method="percentile", rng=np.random.default_rng(1)
    ).confidence_interval
    width = theirs.high - theirs.low
    assert bootstrap_interval(scores, ours) == near(theirs, 0.06 * width)


def test_the_improvement_interval_is_scipys():
    x, y = spread(12), spread(17, seed=1) - 0.5

    def improvement(x, y, axis):
        greater = x[..., :, None] > y[..., None, :]
        equal = x[..., :, None] == y[..., None, :]
        return (greater + equal / 2).mean(axis=(-2, -1))

    theirs = stats.bootstrap(
        (x, y), improvement, n_resamples=5_000, method="percentile", rng=np.random.default_rng(1)
    ).confidence_interval
    assert improvement_interval(x, y) == near(theirs, 0.03)


def test_tasks_are_not_mixed():
    """From one pot, sometimes more of the easy task would be drawn; task by task the mean stays."""
    scores = np.column_stack([np.zeros(10), np.full(10, 100.0)])
    assert bootstrap_interval(scores, np.mean) == (50, 50)


def test_tasks_are_drawn_independently():
    """Were whole rows drawn, two opposite tasks would cancel; independent ones vary by 1/√(2 n)."""
    column = spread(200)
    scores = np.column_stack([column, -column])
    low, high = bootstrap_interval(scores, np.mean)
    assert (high - low) / (2 * 1.96) == pytest.approx(column.std() / np.sqrt(400), rel=0.05)


def test_every_resample_has_the_shape_and_the_tasks_of_the_scores():
    scores = np.arange(12.0).reshape(4, 3)
    seen = []

    def statistic(sample):
        seen.append(sample)
        return 0.0

    bootstrap_interval(scores, statistic, resamples=300)
    samples = np.array(seen)
    assert samples.shape == (300, 4, 3)
    assert (samples % 3 == [0, 1, 2]).all()
    for task in range(3):
        assert set(samples[:, :, task].flat) == set(scores[:, task])
    bootstrap_interval(scores[:, 0], statistic, resamples=1)
    assert seen[-1].shape == (4,)


def test_the_interval_covers_as_often_as_it_says():
    """300 trials leave a standard error of 1.4 %; few resamples narrow the interval a little."""
    rng = np.random.default_rng(0)
    intervals = [
        bootstrap_interval(rng.normal(size=20), resamples=100, seed=trial) for trial in range(300)
    ]
    covered = np.mean([low <= 0 <= high for low, high in intervals])
    assert 0.90 <= covered <= 0.98


def test_the_seed_decides():
    scores, rivals = spread(10, 2), spread(8, 2, seed=1)
    for make in (
        lambda seed: bootstrap_interval(scores, resamples=200, seed=seed),
        lambda seed: improvement_interval(scores, rivals, resamples=200, seed=seed),
        lambda seed: aggregate(scores, solved_at=0, seed=seed).interval,
    ):
        assert make(3) == make(3) != make(4)


@pytest.mark.parametrize("block", [1, 100, 10_000])
@pytest.mark.parametrize("m", [None, 3])
def test_all_at_once_is_one_after_the_other(block, m, monkeypatch):
    """However many are drawn at once: the draws are the same, and so is each mean, bit for bit."""
    scores, rivals = spread(9, m), spread(7, m, seed=1)
    expected = bootstrap_interval(scores, functools.partial(iqm), resamples=60)
    better = improvement_interval(scores, rivals, resamples=60)
    monkeypatch.setattr(statistics, "BLOCK", block)
    assert bootstrap_interval(scores, resamples=60) == expected
    assert improvement_interval(scores, rivals, resamples=60) == better


def test_no_global_generator_is_touched():
    np.random.seed(5)
    before = np.random.get_state()[1].copy()
    first = bootstrap_interval(spread(), resamples=50)
    assert np.array_equal(np.random.get_state()[1], before)
    np.random.seed(6)
    assert bootstrap_interval(spread(), resamples=50) == first


@examples(30)
@given(runs, number, number.filter(bool))
def test_shift_and_scale_go_through_the_interval(scores, shift, scale):
    moved = scale * np.array(scores) + shift
    low, high = sorted(scale * np.array(bootstrap_interval(scores, resamples=50)) + shift)
    assert bootstrap_interval(moved, resamples=50) == near((low, high), 1e-6)


@examples(30)
@given(st.lists(st.floats(0, 100), min_size=1, max_size=12), number)
def test_symmetric_scores_have_their_centre_inside(halves, centre):
    scores = np.concatenate([np.array(halves), -np.array(halves)]) + centre
    low, high = bootstrap_interval(scores, resamples=200)
    assert low <= iqm(scores) + 1e-9
    assert high >= iqm(scores) - 1e-9


@given(number, st.integers(1, 30))
def test_equal_scores_have_an_interval_of_no_width(value, n):
    low, high = bootstrap_interval([value] * n, resamples=10)
    assert low == high == pytest.approx(value, rel=1e-12)


def test_one_score():
    assert bootstrap_interval([7.5]) == Interval(7.5, 7.5)
    assert bootstrap_interval([[7.5, 8.5]]) == Interval(8, 8)
    assert probability_of_improvement([1], [0]) == 1
    assert improvement_interval([1], [0]) == Interval(1, 1)
    assert aggregate([7.5], solved_at=8).summary() == {
        "count": 1,
        "mean": 7.5,
        "iqm": 7.5,
        "iqm_low": 7.5,
        "iqm_high": 7.5,
        "minimum": 7.5,
        "solved_at": 8.0,
        "solved": 0.0,
    }


@pytest.mark.parametrize(
    ("x", "y", "expected"),
    [
        ([1], [0], 1),
        ([0], [1], 0),
        ([1], [1], 1 / 2),
        ([1, 2, 3], [2, 2, 4], 3 / 9),
        ([0, 10], [5], 1 / 2),
        ([[1, 0], [1, 0]], [[0, 0], [0, 1]], (1 + 1 / 4) / 2),
        ([[9, 1]], [[0, 100]], 1 / 2),
    ],
)
def test_probabilities_of_improvement_by_hand(x, y, expected):
    assert probability_of_improvement(x, y) == pytest.approx(expected, rel=1e-15)


@examples(50)
@given(few_values, few_values)
def test_the_probability_of_improvement_is_mann_whitneys_u(x, y):
    wins = probability_of_improvement(x, y) * len(x) * len(y)
    # Of U alone: without a p-value, which has no meaning where all scores are equal.
    with np.errstate(all="ignore"):
        u = stats.mannwhitneyu(x, y, method="asymptotic").statistic
    assert wins == pytest.approx(u, abs=1e-9)


@given(st.integers(1, 12), st.integers(1, 12), st.integers(1, 4), st.integers(0, 2**32))
def test_the_probability_of_improvement_is_a_mean_over_tasks(n_x, n_y, m, seed):
    rng = np.random.default_rng(seed)
    x, y = rng.integers(0, 5, size=(n_x, m)), rng.integers(0, 5, size=(n_y, m))
    tasks = [probability_of_improvement(x[:, task], y[:, task]) for task in range(m)]
    assert probability_of_improvement(x, y) == pytest.approx(np.mean(tasks), abs=1e-12)


@examples(50)
@given(few_values, few_values)
def test_both_sides_of_a_comparison_add_up_to_one(x, y):
    one, other = probability_of_improvement(x, y), probability_of_improvement(y, x)
    assert one + other == pytest.approx(1, abs=1e-15)
    assert probability_of_improvement(x, x) == 0.5


def test_the_improvement_interval_keeps_tasks_apart():
    """Each task is decided, one way and the other; mixed, they would not be."""
    x = np.column_stack([np.full(6, 1.0), np.full(6, 10.0)])
    y = np.column_stack([np.full(5, 0.0), np.full(5, 20.0)])
    assert improvement_interval(x, y, resamples=200) == (0.5, 0.5)


def test_the_improvement_interval_draws_both_sides():
    fixed, varied = [0.5] * 8, [0.0, 1.0] * 4
    for sides in ((fixed, varied), (varied, fixed)):
        low, high = improvement_interval(*sides, resamples=1_000)
        assert low <= 0.25
        assert high >= 0.75


@pytest.mark.slow
@pytest.mark.parametrize("shape", [(100,), (20, 3)])
def test_intervals_are_quick(shape):
    scores = np.random.default_rng(0).normal(size=shape)
    for make in (
        lambda: bootstrap_interval(scores),
        lambda: bootstrap_interval(scores, np.median),
        lambda: improvement_interval(scores, scores),
    ):
        start = time.process_time()
        make()
        assert time.process_time() - start < 1


def test_the_aggregate_of_twenty_seeds():
    scores = [500.0] * 17 + [480.0, 475.0, 120.0]
    result = aggregate(scores, solved_at=475)
    assert result.count == 20
    assert result.mean == (17 * 500 + 480 + 475 + 120) / 20
    assert result.iqm == 500
    assert result.minimum == 120
    assert result.solved == 19 / 20
    assert result.interval == bootstrap_interval(scores)
    assert result.interval.low < result.interval.high == 500


def test_the_summary_is_plain():
    summary = aggregate(np.float32([[1, 2], [3, 4], [5, 6]]), solved_at=np.float64(4)).summary()
    assert json.loads(json.dumps(summary)) == summary
    assert {type(value) for value in summary.values()} == {int, float}
    assert (summary["count"], summary["iqm"], summary["solved"]) == (6, 3.5, 0.5)


@pytest.mark.parametrize(("average", "statistic"), [("mean", np.mean), ("iqm", iqm)])
def test_a_band_is_the_interval_at_each_point(average, statistic):
    curves = np.random.default_rng(3).normal(size=(9, 4))
    middle, low, high = bootstrap_band(curves, average, resamples=4_000)
    for point in range(4):
        expected = bootstrap_interval(curves[:, point], statistic)
        assert middle[point] == pytest.approx(statistic(curves[:, point]))
        assert (low[point], high[point]) == pytest.approx(tuple(expected), abs=0.1)


def test_runs_that_are_alike_leave_a_band_no_width():
    for average in ("mean", "iqm"):
        assert [each.tolist() for each in bootstrap_band([[1.0, 2.0]] * 5, average)] == [[1, 2]] * 3
