"""Every observation has a row, and the right one."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjcartpole.errors import ConfigError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.discretizer import UNFOLDED, Discretizer, Grid, row_of

TUNED = TrainConfig().discretizer()
anything = st.floats(allow_nan=False)


@pytest.mark.parametrize(
    ("value", "column"),
    [
        (-1e300, 0),
        (-math.inf, 0),
        (-2.0, 0),
        (-1.0, 0),
        (math.nextafter(-0.5, -1), 0),
        (-0.5, 1),
        (-0.0, 2),
        (0.0, 2),
        (0.5, 3),
        (math.nextafter(1.0, 0), 3),
        (1.0, 3),
        (math.inf, 3),
    ],
)
def test_bins_are_half_open_and_the_edge_bins_take_the_rest(value, column):
    assert Discretizer((4,), (-1.0,), (1.0,))([value]) == column


@given(st.lists(anything, min_size=4, max_size=4))
def test_nothing_indexes_outside(values):
    assert 0 <= TUNED(values) < TUNED.n_states == 144


@given(
    st.tuples(*[st.integers(1, 7)] * 4),
    st.lists(st.floats(-3, 3), min_size=4, max_size=4),
)
def test_rows_are_counted_as_in_a_c_ordered_array(bins, values):
    discretizer = Discretizer(bins, (-1.0, -2.0, -0.3, -1.5), (1.0, 2.0, 0.2, 2.5))
    columns = [
        min(n - 1, max(0, math.floor((value - low) / ((high - low) / n))))
        for n, value, low, high in zip(bins, values, discretizer.low, discretizer.high, strict=True)
    ]
    assert discretizer(values) == np.ravel_multi_index(columns, bins)


def test_one_bin_ignores_a_dimension():
    assert TUNED([-99.0, 0.1, 0.1, 0.1]) == TUNED([99.0, 0.1, 0.1, 0.1])


def test_the_grid_holds_the_dimensions_that_are_used():
    grid = Discretizer((1, 4, 1, 3), (-9.0, -1.0, -9.0, 0.0), (9.0, 1.0, 9.0, 6.0)).grid
    assert grid == Grid((1, 3), (4, 3), (-1.0, 0.0), (1.0, 6.0), (0.5, 2.0), UNFOLDED)
    assert row_of([99.0, 0.6, 99.0, 2.0], grid) == 3 * 3 + 1


def test_without_any_bins_all_is_one_row():
    discretizer = Discretizer((1, 1), (0.0, 0.0), (1.0, 1.0))
    assert discretizer.grid == Grid((), (), (), (), (), UNFOLDED)
    assert discretizer([math.inf, -5.0]) == 0


def test_rounding_lifts_nothing_into_a_bin_that_is_not_there():
    """The last value below the upper end, divided by the width, may round up to n."""
    for n in range(2, 400):
        for low, high in ((-0.2095, 0.2095), (-0.1, 0.3), (0.0, 1e-3), (-2.4, 2.4)):
            discretizer = Discretizer((n,), (low,), (high,))
            assert discretizer([math.nextafter(high, low)]) == n - 1
            assert discretizer([low]) == 0


@given(
    st.tuples(*[st.integers(1, 7)] * 4),
    st.lists(st.floats(-3, 3), min_size=4, max_size=4),
)
def test_a_mirror_image_has_the_same_row_and_the_other_hand(bins, values):
    ends = (1.0, 2.0, 0.3, 1.5)
    mirrored = Discretizer(bins, tuple(-end for end in ends), ends, mirror=True)
    edges = [np.linspace(-end, end, n + 1) for n, end in zip(bins, ends, strict=True)]
    on_edges = any(
        np.isclose(value, edge, atol=1e-9).any() for value, edge in zip(values, edges, strict=True)
    )
    row, flipped = mirrored.folded(values)
    assert 0 <= 2 * row < mirrored.n_rows
    if not on_edges:
        other, other_flipped = mirrored.folded([-value for value in values])
        in_the_middle = mirrored(values) == mirrored([-value for value in values])
        assert other == row
        assert (other_flipped != flipped) or in_the_middle
    plain = Discretizer(bins, mirrored.low, mirrored.high)
    assert plain.folded(values) == (plain(values), False)


@pytest.mark.parametrize("bins", [(2, 3), (3, 3), (1, 1), (4, 1)])
def test_what_half_a_table_says_of_the_whole(bins):
    discretizer = Discretizer(bins, (-1.0, -1.0), (1.0, 1.0), mirror=True)
    learned = np.arange(2.0 * discretizer.n_rows).reshape(-1, 2)
    learned[(discretizer.n_rows + 1) // 2 :] = np.nan
    table = discretizer.unfolded(learned)
    assert table.shape == (discretizer.n_states, 2)
    for values in np.random.default_rng(0).uniform(-1, 1, (50, 2)).tolist():
        row, flipped = discretizer.folded(values)
        expected = learned[row][::-1] if flipped else learned[row]
        assert table[discretizer(values)].tolist() == expected.tolist()


def test_a_tie_is_broken_in_the_mirror_as_it_is_here():
    discretizer = Discretizer((3,), (-1.0,), (1.0,), mirror=True)
    table = discretizer.unfolded(np.array([[1.0, 1.0], [2.0, 2.0], [np.nan, np.nan]]))
    assert np.argmax(table, axis=1).tolist() == [0, 0, 1]
    assert np.allclose(table, [[1.0, 1.0], [2.0, 2.0], [1.0, 1.0]], atol=1e-15, rtol=0)


def test_a_grid_that_is_not_symmetric_has_no_mirror():
    assert Discretizer((2, 1), (-1.0, -1.0), (1.0, 3.0), mirror=True).n_rows == 2
    with pytest.raises(ConfigError, match=r"as long to the left as to the right; -1.0 to 3.0"):
        Discretizer((2, 2), (-1.0, -1.0), (1.0, 3.0), mirror=True)


def test_the_same_grid_is_an_equal_discretizer():
    assert TrainConfig().discretizer() == TUNED
    assert hash(TrainConfig().discretizer()) == hash(TUNED)
    assert "grid" not in repr(TUNED)


def test_the_articles_grid():
    """`((state + range) / width).astype(int)`, as its code has it, inside the ranges."""
    discretizer = TrainConfig.preset("article").discretizer()
    ranges = np.array([float(np.float32(math.radians(24))), 3.5])
    width = ranges * 2 / [25, 25]
    rng = np.random.default_rng(0)
    for theta, theta_dot in rng.uniform(-ranges, ranges, size=(500, 2)):
        row, column = ((np.array([theta, theta_dot]) + ranges) / width).astype(int)
        assert discretizer([0.0, 0.0, theta, theta_dot]) == row * 25 + column


@pytest.mark.parametrize(
    ("bins", "low", "high", "message"),
    [
        ((0,), (-1.0,), (1.0,), "from 1 up"),
        ((-3,), (-1.0,), (1.0,), "from 1 up"),
        ((2.5,), (-1.0,), (1.0,), "whole numbers"),
        ((3,), (1.0,), (1.0,), "low < high"),
        ((3,), (1.0,), (-1.0,), "low < high"),
        ((3,), (-math.inf,), (1.0,), "finite"),
        ((3,), (math.nan,), (1.0,), "finite"),
        ((3,), ("a",), (1.0,), "finite"),
        ((3, 3), (-1.0,), (1.0,), "one value per dimension"),
        ((1001, 1000), (-1.0, -1.0), (1.0, 1.0), "1001000 states"),
    ],
)
def test_grids_that_make_no_sense(bins, low, high, message):
    with pytest.raises(ConfigError, match=message):
        Discretizer(bins, low, high)
