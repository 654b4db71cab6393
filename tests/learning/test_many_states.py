"""A policy in many states at once, against the same policy in each of them."""

import numpy as np
import pytest

from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.many_states import actions_in, homes_in, values_in
from mjcartpole.learning.policy import Policy
from mjcartpole.learning.tiles import home, tiles_of

LOW, HIGH = (-2.4, -1.0, -0.2, -1.5), (2.4, 1.0, 0.2, 1.5)
GRIDS = {
    "bins": Discretizer((1, 3, 6, 8), LOW, HIGH),
    "one state": Discretizer((1, 1, 1, 1), LOW, HIGH),
    "tilings": Discretizer((2, 3, 4, 1), LOW, HIGH, tilings=8),
    "tilings in a mirror": Discretizer((3, 2, 4, 2), LOW, HIGH, mirror=True, tilings=4),
    "nodes": Discretizer((1, 2, 5, 4), LOW, HIGH, interpolated=True),
    "nodes in a mirror": Discretizer((1, 3, 4, 3), LOW, HIGH, mirror=True, interpolated=True),
    "two poles": Discretizer((2, 1, 2, 3, 2, 2), LOW + LOW[2:], HIGH + HIGH[2:], tilings=2),
}


@pytest.fixture(params=GRIDS)
def policy(request):
    grid = GRIDS[request.param]
    # Few values, so that many states have a tie.
    table = np.random.default_rng(1).integers(0, 3, (*grid.shape, 2)).astype(float)
    return Policy(grid, table)


@pytest.fixture
def states(policy):
    """States inside and outside, on edges, and in the middle."""
    grid, rng = policy.discretizer, np.random.default_rng(2)
    drawn = rng.uniform(-1.3, 1.3, (300, len(grid.bins))) * grid.high
    edges = np.array([grid.low, grid.high, np.zeros(len(grid.bins))])
    return np.concatenate([drawn, edges]).astype(np.float32).astype(np.float64)


def test_values_and_actions_are_the_policys_to_the_bit(policy, states):
    grid, table = policy.discretizer, policy.q_table
    seen = states.astype(np.float32)
    assert values_in(grid, table, states).tolist() == [list(policy.values(each)) for each in seen]
    assert actions_in(grid, table, states).tolist() == [policy(each) for each in seen]


def test_states_are_counted_where_training_counts_them(policy, states):
    grid = policy.discretizer
    expected = [home(tiles_of(grid), grid(each)) for each in states.tolist()]
    assert homes_in(grid, states).tolist() == expected
    assert max(expected) < np.prod(grid.bins)


def test_the_nearest_node_counts_and_the_tiling_that_is_not_moved():
    nodes = Discretizer((1, 1, 3, 1), LOW, HIGH, interpolated=True)
    places = np.array([[0, 0, angle, 0] for angle in (-9, -0.11, -0.09, 0.09, 0.11, 9)])
    assert homes_in(nodes, places).tolist() == [0, 0, 1, 1, 2, 2]
    tiled = Discretizer((1, 1, 2, 1), LOW, HIGH, tilings=4)
    assert homes_in(tiled, places).tolist() == [0, 0, 0, 1, 1, 1]
