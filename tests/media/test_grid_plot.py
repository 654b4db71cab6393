"""Fields over two dimensions, drawn."""

import numpy as np
import pytest

from mjcartpole.media.grid_plot import LEGENDS, Field, Grid, Path
from mjcartpole.media.plots import write_plot

pytest.importorskip("matplotlib")
EDGES = np.array([-1.0, 0.0, 1.0]), np.array([0.0, 1.0, 2.0, 4.0])


def field(kind, values=((1.0, 2.0), (0.0, -4.0), (np.nan, 1.0)), title=""):
    return Field(kind, title, EDGES, np.array(values))


def grid(*fields, **more):
    return Grid("a", ("theta", "theta2_dot"), fields, **more)


def test_rows_are_the_cells_and_the_points():
    path = Path(np.array([[0.0, 1.0], [0.5, 1.5]]), "time limit", True)
    rows = list(grid([field("advantage", title="s")], paths=[path]).rows())
    assert rows[3] == {
        "what": "advantage",
        "slice": "s",
        "theta_low": 0.0,
        "theta_high": 1.0,
        "theta2_dot_low": 1.0,
        "theta2_dot_high": 2.0,
        "value": -4.0,
    }
    assert rows[4]["value"] is None
    assert rows[-1] == {"what": "path", "episode": 1, "step": 1, "theta": 0.5, "theta2_dot": 1.5}


def meshes(figure):
    from matplotlib.collections import QuadMesh

    return [mesh for axes in figure.axes for mesh in axes.collections if isinstance(mesh, QuadMesh)]


@pytest.mark.parametrize("kind", LEGENDS)
def test_what_is_drawn_is_what_the_rows_say(kind, tmp_path):
    drawn = grid([field(kind), field(kind, np.zeros((3, 2)))])
    figure = drawn.figure()
    write_plot(figure, tmp_path / "a.png")
    values = np.ma.concatenate([mesh.get_array().ravel() for mesh in meshes(figure)[:2]])
    expected = [row["value"] for row in drawn.rows()]
    if kind == "visits":
        expected = [value if value is not None and value >= 1 else None for value in expected]
    assert values.tolist() == expected


@pytest.mark.parametrize("kind", LEGENDS)
def test_left_and_right_and_little_and_much_differ_in_lightness(kind):
    (mesh, *_) = meshes(grid([field(kind, ((0.0, 1.0), (-9.0, 9.0), (1.0, 9.0)))]).figure())
    colours = mesh.to_rgba(np.array([[0.0, 1.0] if kind == "action" else [-9.0, 9.0]]))[0, :, :3]
    if kind in {"visits", "steps"}:
        colours = mesh.to_rgba(np.array([[1.0, 9.0]]))[0, :, :3]
    light = colours @ [0.299, 0.587, 0.114]
    assert abs(light[0] - light[1]) > 0.4


def test_the_middle_of_the_advantage_is_nothing():
    (mesh, *_) = meshes(grid([field("advantage")]).figure())
    assert (mesh.norm.vmin, mesh.norm.vmax) == (-4.0, 4.0)


def test_dimensions_have_units_and_notes_are_said():
    figure = grid([field("steps")], notes=["at x = 0"], limits=(0.5, None)).figure()
    assert (figure._supxlabel.get_text(), figure._supylabel.get_text()) == (
        "theta, rad",
        "theta2_dot, rad/s",
    )
    assert figure._suptitle.get_text() == "a\nat x = 0"
    assert [line.get_xdata()[0] for line in figure.axes[0].lines] == [-0.5, 0.5]


def test_a_path_ends_in_another_mark_if_it_lasted():
    points = np.array([[0.0, 1.0], [0.5, 1.5]])
    both = [Path(points, "time limit", True), Path(points, "pole fell", False)]
    marks = [
        line.get_marker() for line in grid([field("action")], paths=both).figure().axes[0].lines
    ]
    assert marks == ["None", "o", "s", "None", "o", "X"]


@pytest.mark.long
def test_where_there_is_nothing_a_plot_is_still_one(tmp_path):
    empty = np.full((3, 2), np.nan)
    for kind in LEGENDS:
        write_plot(grid([field(kind, empty)]).figure(), tmp_path / f"{kind}.pdf")
        assert (tmp_path / f"{kind}.pdf").stat().st_size > 1_000
