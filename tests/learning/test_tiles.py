"""Several offset grids: which rows a state has, and what its actions are worth."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjcartpole.errors import ConfigError
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.policy import Policy
from mjcartpole.learning.tiles import add_at, greedy, pair_at, place, row_in, tiles_of

HIGH = (1.0, 2.0, 0.3, 1.5)
LOW = tuple(-end for end in HIGH)


def rows_by_the_definition(values, bins, tilings):
    """Each tiling is the grid moved by a share of a bin, its first and last bins left open."""
    for tiling in range(tilings):
        columns, axis = [], 0
        for value, n, low, high in zip(values, bins, LOW, HIGH, strict=True):
            width = (high - low) / n
            step = tiling * (2 * axis + 1) % tilings
            offset = width * ((step + 0.5) / tilings - 0.5)
            columns.append(min(n - 1, max(0, math.floor((value - low + offset) / width))))
            axis += n > 1
        yield tiling * math.prod(bins) + int(np.ravel_multi_index(columns, bins))


def rows_of(discretizer, values):
    tiles = tiles_of(discretizer)
    row, within = place(tiles, discretizer(values))
    return [row_in(tiles, tiling, row, within) for tiling in range(discretizer.tilings)]


@given(
    st.tuples(*[st.integers(1, 7)] * 4).filter(lambda bins: max(bins) > 1),
    st.sampled_from([2, 4, 16, 64]),
    st.lists(st.floats(-3, 3).map(lambda value: round(value, 3) + 1e-5), min_size=4, max_size=4),
)
def test_a_state_has_a_row_in_every_tiling(bins, tilings, values):
    discretizer = Discretizer(bins, LOW, HIGH, tilings=tilings)
    assert 0 <= discretizer(values) < discretizer.n_states
    assert rows_of(discretizer, values) == list(rows_by_the_definition(values, bins, tilings))


def test_near_states_share_all_rows_but_one():
    discretizer = Discretizer((4,), (-1.0,), (1.0,), tilings=8)
    places = np.linspace(-0.99, 0.99, 400)
    rows = [set(rows_of(discretizer, [place])) for place in places]
    steps = [len(after - before) for before, after in itertools.pairwise(rows)]
    assert set(steps) == {0, 1}
    assert sum(steps) == discretizer.n_states - 1 == 24


def test_the_value_is_the_sum_and_a_change_is_shared():
    discretizer = Discretizer((3, 4), LOW[:2], HIGH[:2], tilings=4)
    tiles, q = tiles_of(discretizer), np.zeros(2 * discretizer.n_rows)
    here, near, far = (discretizer(values) for values in ([0.0, 0.0], [0.1, 0.0], [0.9, 1.9]))
    add_at(tiles, q, here, 1, 8.0)
    assert pair_at(tiles, q, here) == (0.0, 8.0)
    assert sorted(q)[-5:] == [0.0, 2.0, 2.0, 2.0, 2.0]
    assert 0.0 < pair_at(tiles, q, near)[1] <= 8.0
    assert pair_at(tiles, q, far) == (0.0, 0.0)


def test_one_grid_is_a_table():
    q = [1.0, 2.0, 3.0, 4.0]
    add_at(None, q, 1, 0, 0.5)
    assert tiles_of(Discretizer((2,), (-1.0,), (1.0,))) is None
    assert pair_at(None, q, 1) == (3.5, 4.0)


@pytest.mark.parametrize("kind", [{"tilings": 4}, {"interpolated": True}], ids=str)
@pytest.mark.parametrize("mirror", [False, True])
def test_a_policy_of_several_rows_is_kept_in_a_file(tmp_path, mirror, kind):
    discretizer = Discretizer((2, 3, 1, 2), LOW, HIGH, mirror=mirror, **kind)
    values = np.random.default_rng(0).normal(size=(discretizer.n_rows, 2))
    policy = Policy.learned(discretizer, values)
    assert policy.q_table.shape == (*discretizer.shape, 2)
    policy.save(tmp_path / "policy.json")
    again = Policy.load(tmp_path / "policy.json")
    assert again.discretizer == discretizer
    assert (again.q_table == policy.q_table).all()
    for state in np.random.default_rng(1).uniform(-1, 1, (50, 4)).astype(np.float32):
        left, right = policy.values(state)
        assert again(state) == policy(state) == int(right > left)
        if mirror:
            assert policy.values(-state) == (right, left)


@given(
    st.tuples(*[st.integers(1, 6)] * 4),
    st.tuples(*[st.floats(-1.5, 1.5)] * 4),
)
def test_between_nodes_is_what_is_multilinear(bins, state):
    discretizer = Discretizer(bins, LOW, HIGH, interpolated=True)

    def height(x, v, z, w):
        return 3 * x - v * w + 4 * z

    ends = [(-end, end) if n > 1 else (0.0, 0.0) for n, end in zip(bins, HIGH, strict=True)]
    axes = [np.linspace(*each, n) for each, n in zip(ends, bins, strict=True)]
    q = np.repeat(height(*np.meshgrid(*axes, indexing="ij")), 2)
    q[1::2] *= 2
    found = pair_at(tiles_of(discretizer), q, discretizer(state))
    # A state counts as the middle of its cell, of which there are 1,024 between two nodes.
    half = [end / (n - 1) / 1024 if n > 1 else 0.0 for n, end in zip(bins, HIGH, strict=True)]
    off = 3 * half[0] + 1.5 * half[1] + 4 * half[2] + 2 * half[3] + 1e-9
    inside = height(*(np.clip(value, *each) for value, each in zip(state, ends, strict=True)))
    assert found == (pytest.approx(inside, abs=off), pytest.approx(2 * inside, abs=2 * off))


def test_nodes_are_states_and_what_is_learned_at_one_stays_there():
    discretizer = Discretizer((3, 2), LOW[:2], HIGH[:2], interpolated=True)
    tiles, q = tiles_of(discretizer), np.zeros(2 * discretizer.n_rows)
    add_at(tiles, q, discretizer([0.0, 2.5]), 1, 8.0)
    assert q.reshape(3, 2, 2)[1, 1].tolist() == [0.0, 8.0] and q.sum() == 8.0
    assert pair_at(tiles, q, discretizer([0.25, 1.0])) == (0.0, 8.0 * 0.75 * 0.75)
    add_at(tiles, q, discretizer([-0.5, -2.0]), 0, 4.0)
    assert q.reshape(3, 2, 2)[:2, 0, 0].tolist() == [2.0, 2.0]


def test_the_mirror_image_of_a_choice():
    discretizer = Discretizer((2,), (-1.0,), (1.0,), mirror=True, tilings=2)
    tiles, folding = tiles_of(discretizer), discretizer.grid.folding
    q = [0.0, 1.0] * discretizer.n_rows
    assert [greedy(tiles, q, s, folding) for s in range(3)] == [1, 1, 0]


@pytest.mark.parametrize(
    ("bins", "tilings", "message"),
    [
        ((1, 1, 1, 1), 2, r"bins \(1, 1, 1, 1\) end nowhere; give more bins"),
        ((2, 2, 2, 2), 3, "tilings must be one of 1, 2, 4, 8, 16, 32, 64, not 3"),
        ((2, 2, 2, 2), 0, "not 0"),
        ((20, 20, 20, 20), 16, r"in 16 tilings make 2560000 states; the most is 1000000"),
    ],
)
def test_tilings_that_make_no_sense(bins, tilings, message):
    with pytest.raises(ConfigError, match=message):
        Discretizer(bins, LOW, HIGH, tilings=tilings)


def test_cells_that_cannot_be_counted():
    bins, ends = (3, *[2] * 11), (1.0,) * 12
    low = tuple(-end for end in ends)
    with pytest.raises(ConfigError, match="in 64 tilings are too many to count"):
        Discretizer(bins, low, ends, tilings=64)
