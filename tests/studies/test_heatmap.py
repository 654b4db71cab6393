"""Pictures of transfers and sweeps."""

import numpy as np
import pytest

from mjcartpole.learning.episodes import Episode
from mjcartpole.studies.evaluation import Evaluation
from mjcartpole.studies.heatmap import NOTHING, SCALE, _ticks, curves, heat_map
from mjcartpole.studies.statistics import Interval
from mjcartpole.studies.sweep import SweepResult
from mjcartpole.studies.transfer import Cell, TransferResult


def cell(place, mean, policy="p"):
    """A cell with one episode; NaN is a failure."""
    if np.isnan(mean):
        return Cell(policy, place, error="diverged")
    episode = Episode(1, float(mean), int(mean), "pole fell")
    return Cell(policy, place, Evaluation("mujoco", 0, (episode,)), Interval(mean - 9, mean + 9))


def matrix(*means, names=None):
    names = names or tuple(f"model {n}" for n in range(len(means)))
    cells = tuple(cell(name, mean) for name, mean in zip(names, means, strict=True))
    return TransferResult(("p",), names, cells, 0)


def colours(picture):
    return {colour for _, colour in picture.getcolors(maxcolors=2**20)}


def test_colours_go_from_one_end_of_the_scale_to_the_other():
    found = colours(heat_map(matrix(0.0, 250.0, 500.0)))
    for part in (0, 2, 4):
        assert tuple(SCALE[part].tolist()) in found


def test_a_failed_cell_is_grey():
    assert NOTHING not in colours(heat_map(matrix(100.0)))
    assert NOTHING in colours(heat_map(matrix(100.0, float("nan"))))


def test_long_names_stay_inside():
    short = heat_map(matrix(1.0, 2.0))
    long = heat_map(matrix(1.0, 2.0, names=("m" * 300, "model")))
    assert short.height < long.height < 2 * short.height + 300
    assert long.width < 1500


def test_curves_have_a_line_for_each_policy():
    values = (0.5, 1.0, 1.5)
    cells = tuple(cell("x", mean, name) for name in "ab" for mean in (500.0, 300.0, 10.0))
    result = SweepResult(
        "pole.length", values, "cartpole", TransferResult(("a", "b"), ("x",) * 3, cells, 0)
    )
    two = curves(result)
    assert {(0, 114, 178), (213, 94, 0)} <= colours(two)
    one = curves(SweepResult("k", values, "m", matrix(500.0, float("nan"), 10.0)))
    assert (213, 94, 0) not in colours(one)
    assert one.height < two.height


def test_a_single_value_can_be_drawn():
    assert curves(SweepResult("k", (1.0,), "m", matrix(500.0))).size[0] > 0


@pytest.mark.parametrize(
    ("span", "ticks"),
    [
        ((0.5, 3.0), [0.5, 1.0, 1.5, 2.0, 2.5, 3.0]),
        ((0.0, 8.0), list(range(9))),
        ((-1.0, 1.0), [-1.0, -0.75, -0.5, -0.25, 0.0, 0.25, 0.5, 0.75, 1.0]),
        ((2.0, 2.0), [2.0]),
    ],
)
def test_ticks_are_round(span, ticks):
    assert _ticks(*span) == ticks
