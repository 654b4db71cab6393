"""Plots of transfers and sweeps."""

from dataclasses import replace

import numpy as np
import pytest

from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.learning.episodes import Episode
from mjcartpole.learning.evaluation import Evaluation
from mjcartpole.media.palette import CURVES, MISSING
from mjcartpole.media.plots import css, write_plot
from mjcartpole.studies.plots import curves, heat_map
from mjcartpole.studies.statistics import Interval
from mjcartpole.studies.sweep import SweepResult
from mjcartpole.studies.transfer import Cell, TransferResult
from mjcartpole.task import CARTPOLE_V1, Task

pytest.importorskip("matplotlib")

LEANING = Task("leaning", reward=lambda x, x_dot, theta, theta_dot, terminated: -abs(theta))


def cell(place, mean, policy="p"):
    """A cell with one episode; NaN is a failure."""
    if np.isnan(mean):
        return Cell(policy, place, error="diverged")
    episode = Episode(1, float(mean), 9, "pole fell")
    return Cell(policy, place, Evaluation("mujoco", 0, (episode,)), Interval(mean - 9, mean + 9))


def matrix(*means, names=None, task=CARTPOLE_V1):
    names = names or tuple(f"model {n}" for n in range(len(means)))
    cells = tuple(cell(name, mean) for name, mean in zip(names, means, strict=True))
    return TransferResult(("p",), names, cells, 0, task)


def swept(*means, policies=("p",), task=CARTPOLE_V1):
    """A sweep in which each policy has the same means."""
    cells = tuple(cell("x", mean, name) for name in policies for mean in means)
    played = TransferResult(policies, ("x",) * len(means), cells, 0, task)
    return SweepResult("pole.length", tuple(map(float, range(len(means)))), "m", played)


def texts(figure):
    """All words in a figure that say something."""
    from matplotlib.text import Text

    return [found.get_text() for found in figure.findobj(Text) if found.get_text()]


def colours(figure):
    """The colours of a heat map's cells, 0 to 255."""
    (image,) = figure.axes[0].images
    return image.to_rgba(image.get_array(), bytes=True)[0, :, :3].tolist()


def test_colours_go_from_one_end_of_viridis_to_the_other():
    assert colours(heat_map(matrix(0.0, 500.0))) == [[68, 1, 84], [253, 231, 36]]
    assert colours(heat_map(matrix(100.0, 500.0)))[0] != [68, 1, 84]


def test_where_a_step_pays_otherwise_the_scale_is_of_what_was_found():
    found = colours(heat_map(matrix(-20.0, -3.0, task=LEANING)))
    assert found == [[68, 1, 84], [253, 231, 36]]


def test_a_cell_says_its_mean_and_interval():
    words = texts(heat_map(matrix(100.04, 321.0)))
    for word in ("100.0", "91 to 109", "321.0", "312 to 330", "model 0", "model 1", "p"):
        assert word in words


def test_a_failed_cell_is_grey_and_says_so():
    figure = heat_map(matrix(100.0, float("nan")))
    assert colours(figure)[1] == list(MISSING)
    assert texts(figure).count("failed") == 1


def test_long_names_stay_inside(tmp_path):
    figure = heat_map(matrix(1.0, 2.0, names=("m" * 300, "\udcff")))
    assert "m" * 20 + "..." + "m" * 17 in texts(figure)
    write_plot(figure, tmp_path / "long.png")


def test_curves_have_a_line_and_a_band_for_each_policy():
    axes = curves(swept(500.0, 300.0, 10.0, policies=("a", "b"))).axes[0]
    lines, bands = axes.lines[:2], axes.collections
    assert [line.get_color() for line in lines] == [css(colour) for colour in CURVES[:2]]
    assert lines[0].get_ydata().tolist() == [500.0, 300.0, 10.0]
    assert len(bands) == 2
    assert axes.get_ylim() == (0, 500)


def test_what_was_added_is_said():
    added = Disturbances(delay=2, push="1@~4s")
    matrix_ = replace(matrix(1.0), disturbances=added)
    sweep_ = swept(1.0, 2.0)
    sweep_ = replace(sweep_, played=replace(sweep_.played, disturbances=added))
    for figure in (heat_map(matrix_), curves(sweep_)):
        assert any("\nwith --delay 2 --push '1@~4s'" in words for words in texts(figure))


def test_where_the_simulation_diverged_there_is_a_gap():
    (line, _threshold) = curves(swept(500.0, float("nan"), 10.0)).axes[0].lines
    assert np.isnan(line.get_ydata()).tolist() == [False, True, False]


def test_the_legend_says_where_each_policy_holds():
    figure = curves(swept(500.0, 480.0, 10.0, policies=("_a",)))
    assert "_a: holds from 0 (where the sweep begins) to 1" in texts(figure)
    assert "475" in texts(figure)
    assert "p: nowhere at 475" in texts(curves(swept(10.0, 20.0)))


def test_a_task_without_a_threshold_has_no_line_and_holds_nowhere():
    figure = curves(swept(-20.0, -3.0, task=LEANING))
    assert len(figure.axes[0].lines) == 1
    assert "p" in texts(figure)
    low, high = figure.axes[0].get_ylim()
    assert low < -29
    assert high > 6


@pytest.mark.parametrize("means", [(500.0,), (float("nan"),), (float("nan"), float("nan"))])
def test_few_values_can_be_drawn(means, tmp_path):
    write_plot(curves(swept(*means)), tmp_path / "few.png")
    write_plot(heat_map(matrix(*means)), tmp_path / "few.svg")
    assert (tmp_path / "few.png").read_bytes().startswith(b"\x89PNG")
    assert "</svg>" in (tmp_path / "few.svg").read_text(encoding="utf-8")
