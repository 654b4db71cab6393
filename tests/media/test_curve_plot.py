"""Learning curves, drawn."""

import numpy as np
import pytest

from mjcartpole.media.curve_plot import (
    MOST_POINTS,
    MOST_RAW,
    Curves,
    Line,
    curve_of,
    line_of_run,
    places,
    running_mean,
)
from mjcartpole.media.plots import write_plot

pytest.importorskip("matplotlib")


def test_a_running_mean_begins_where_there_are_enough():
    assert running_mean(np.array([1.0, 2.0, 6.0, 8.0]), 2).tolist() == [1.5, 4.0, 7.0]
    assert running_mean(np.array([3.0]), 1).tolist() == [3.0]


def test_places_are_few_and_have_both_ends():
    assert places(5, 2).tolist() == [2, 3, 4, 5]
    many = places(1_000_000, 7)
    assert (len(many), many[0], many[-1]) == (MOST_POINTS, 7, 1_000_000)


def test_raw_returns_are_drawn_one_by_one_or_as_what_they_lie_between():
    few = line_of_run("few", np.arange(9.0), 3)
    assert few.raw[1].tolist() == few.raw[2].tolist() == list(range(9))
    returns = np.random.default_rng(0).uniform(0, 500, 10_000)
    ends, low, high = line_of_run("many", returns, 3).raw
    assert len(ends) == MOST_RAW
    assert (low.min(), high.max()) == (returns.min(), returns.max())
    first = returns[: ends[0]]
    assert (low[0], high[0]) == (first.min(), first.max())


def test_rows_are_what_is_drawn():
    curves = curve_of("a", np.array([1.0, 3.0, 5.0]), [(2, 9.0)], (0, 500), 475.0)
    rows = list(curves.rows())
    assert [row["what"] for row in rows] == ["raw"] * 3 + ["smoothed"] * 3 + ["greedy"]
    axes = curves.figure().axes[0]
    drawn = [line.get_xydata().tolist() for line in axes.lines]
    for what in ("smoothed", "greedy"):
        points = [[row["episode"], row["return"]] for row in rows if row["what"] == what]
        assert points in drawn
    assert [[row["episode"], row["low"]] for row in rows[:3]] in drawn
    assert axes.get_ylim()[0] == 0


def band(name):
    ends = (np.array([1.0, 2.0]), np.array([3.0, 4.0]))
    return Line(name, np.array([1, 2]), np.array([2.0, 3.0]), np.array([5, 4]), ends)


def test_lines_are_told_apart_without_colours_and_named_below():
    figure = Curves([band("_a"), band("$b$"), band("c" * 90)], 1, of="iqm").figure()
    axes = figure.axes[0]
    assert len({line.get_linestyle() for line in axes.lines}) == 3
    assert len(axes.collections) == 3
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words[:2] == ["_a (4 to 5 seeds)", r"\$b\$ (4 to 5 seeds)"]
    assert "iqm and its 95 % interval" in axes.get_title("left")


def test_many_lines_have_no_raw_returns_behind_them():
    lines = [line_of_run(name, np.arange(4.0), 1) for name in "abc"]
    assert all(line.raw is None for line in Curves(lines, 1).shown)
    assert all(line.raw is not None for line in Curves(lines[:2], 1).shown)


@pytest.mark.parametrize("n", [1, 2])
def test_the_shortest_runs_can_be_drawn(n, tmp_path):
    write_plot(curve_of("a", np.full(n, 3.0), [], (None, None), None).figure(), tmp_path / "a.svg")
    assert (tmp_path / "a.svg").stat().st_size > 1_000
