"""Slices of a table."""

import itertools

import numpy as np
import pytest

from mjcartpole.errors import ConfigError
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.policy import Policy
from mjcartpole.learning.slices import (
    check_of_state,
    choose_axes,
    edges_along,
    slices,
    stations,
    visit_edges,
)

LOW, HIGH = (-2.4, -0.75, -0.2, -1.5), (2.4, 0.75, 0.2, 1.5)
TUNED = Discretizer((1, 3, 6, 8), LOW, HIGH)
TILED = Discretizer((4, 1, 2, 2), LOW, HIGH, tilings=8)
NODES = Discretizer((13, 13, 3, 3), LOW, HIGH, interpolated=True)
TWO = Discretizer((2, 1, 2, 2, 2, 2), LOW + LOW[2:], HIGH + HIGH[2:])


def table_of(grid):
    return np.random.default_rng(0).normal(size=(*grid.shape, 2))


def test_what_is_shown_if_nothing_is_asked_for():
    assert choose_axes(TUNED) == choose_axes(TUNED, ("theta", "theta_dot"), "x_dot")
    assert choose_axes(TILED).over == 0, "x_dot has one bin"
    assert choose_axes(Discretizer((1, 1, 2, 1), LOW, HIGH)).over is None
    assert choose_axes(TWO).dims == (2, 3)
    assert choose_axes(TUNED, over="none").over is None
    assert choose_axes(TUNED, at={"x_dot": 0.5}).held == (0.0, 0.5, 0.0, 0.0)
    aside = Discretizer((2, 1, 1, 1), (1.0, *LOW[1:]), HIGH)
    assert choose_axes(aside, over="none").held[0] == pytest.approx(1.7)


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"dims": ("x", "y")}, "dimension 'y' is unknown; available: x, x_dot, theta, theta_dot"),
        ({"dims": ("x",)}, "two different dimensions"),
        ({"dims": ("x", "x")}, "two different dimensions"),
        ({"over": "theta"}, "once"),
        ({"over": "x_dot", "at": {"x_dot": 1.0}}, "once"),
        ({"at": {"theta": 1.0}}, "once"),
        ({"over": "z"}, "'z' is unknown"),
    ],
)
def test_what_makes_no_sense_is_refused(asked, words):
    with pytest.raises(ConfigError, match=words):
        choose_axes(TUNED, **asked)


def test_actions_before_are_dimensions_of_their_own():
    grid = Discretizer((1, 3, 6, 8, 2, 2), (*LOW, -1, -1), (*HIGH, 1, 1), actions=2)
    axes = choose_axes(grid)
    assert (axes.dims, axes.over) == ((2, 3), 1)
    assert axes.held[4:] == (1.0, 1.0)
    table = table_of(grid)
    drawn = slices("", grid, table, choose_axes(grid, over="action_2_before"), shown=("action",))
    assert len(drawn.fields[0]) == 2
    left = slices(
        "",
        grid,
        table,
        choose_axes(grid, over="none", at={"action_1_before": -1}),
        shown=("action",),
    )
    assert left.notes == ["at x_dot = 0, action_1_before = -1, action_2_before = 1"]
    expected = np.argmax(table[0, 1, :, :, 0, 1], axis=-1).T
    assert left.fields[0][0].values.tolist() == expected.tolist()
    with pytest.raises(ConfigError, match="of a state 'action_1_before' is unknown"):
        check_of_state(grid, ["action_1_before"])


def test_a_grid_for_something_else_is_refused():
    with pytest.raises(ConfigError, match="for no cart-pole"):
        choose_axes(Discretizer((4,), (0.0,), (1.0,)))


def test_within_a_cell_the_table_says_the_same():
    assert edges_along(TUNED, 0).tolist() == [-2.4, 2.4]
    assert edges_along(TUNED, 1) == pytest.approx([-0.75, -0.25, 0.25, 0.75])
    fine = edges_along(TILED, 0)
    assert (len(fine), fine[0], fine[-1]) == (26, -2.4, 2.4)
    policy = Policy(TILED, table_of(TILED))
    for low, high in itertools.pairwise(fine):
        inside = [low + share * (high - low) for share in (0.01, 0.5, 0.99)]
        seen = {policy.values(np.array([x, 0, 0.1, 0.1], np.float32)) for x in inside}
        assert len(seen) == 1


def test_visits_have_the_bins_themselves_or_what_is_nearest_to_a_node():
    assert visit_edges(TILED, 0) == pytest.approx([-2.4, -1.2, 0, 1.2, 2.4])
    assert visit_edges(NODES, 2) == pytest.approx([-0.2, -0.1, 0.1, 0.2])


def test_where_a_dimension_is_cut():
    words, values = zip(*stations(TUNED, 1), strict=True)
    assert words == ("x_dot below -0.25", "x_dot -0.25 to 0.25", "x_dot above 0.25")
    assert values == pytest.approx([-0.5, 0.0, 0.5])
    assert [round(value, 3) for _, value in stations(NODES, 0)] == [-2.4, -1.2, 0.0, 1.2, 2.4]
    assert len(stations(TUNED, 3)) == 5


def test_slices_are_the_tables_own_numbers():
    table, visits = table_of(TUNED), np.arange(288).reshape(1, 3, 6, 8, 2)
    grid = slices("t", TUNED, table, choose_axes(TUNED), visits=visits)
    assert [[field.kind for field in row] for row in grid.fields] == [
        [kind] * 3 for kind in ("action", "advantage", "visits")
    ]
    for column in range(3):
        action, advantage, seen = (row[column].values for row in grid.fields)
        cut = table[0, column].swapaxes(0, 1)
        assert (advantage == cut[..., 1] - cut[..., 0]).all()
        assert (action == (cut[..., 1] > cut[..., 0])).all()
        assert (seen == visits[0, column].sum(axis=-1).T).all()
    turned = slices("t", TUNED, table, choose_axes(TUNED, ("theta_dot", "theta")))
    assert (turned.fields[0][1].values == grid.fields[0][1].values.T).all()


def test_where_others_are_held_is_said_and_so_are_missing_visits():
    grid = slices("t", NODES, table_of(NODES), choose_axes(NODES, at={"x": 1.5}))
    assert list(grid.notes) == ["at x = 1.5", "its visits were not counted"]
    assert len(grid.fields) == 2
    only = slices("t", TUNED, table_of(TUNED), choose_axes(TUNED), shown=("visits",))
    assert only.fields[0][0].kind == "action"
    with pytest.raises(ConfigError, match="picture of a table 'q' is unknown"):
        slices("t", TUNED, table_of(TUNED), choose_axes(TUNED), shown=("q",))
