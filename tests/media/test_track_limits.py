"""Posts where a task's limits of the track are not CartPole-v1's."""

import math

import numpy as np
import pytest

from mjcartpole.media.renderer import open_renderer
from mjcartpole.media.scene import Scene
from mjcartpole.physics.load import load_model
from mjcartpole.task import CARTPOLE_V1, SWING_UP


def posts(x_limit, state=(0.0, 0.0, 0.0, 0.0)):
    scene = Scene(
        load_model("cartpole"), 320, 240, "free", task=SWING_UP.with_changes(x_limit=x_limit)
    )
    scene.show(state)
    return scene.wedges


@pytest.mark.parametrize("x_limit", [2.4, math.inf])
def test_the_usual_track_and_one_without_an_end_have_none(x_limit):
    assert posts(x_limit) == []


@pytest.mark.parametrize("x", [0.0, -0.7])
def test_they_stand_where_the_hinge_is_at_the_limits(x):
    there = [wedge.corners for wedge in posts(1.2, (x, 0.0, 0.3, 0.0))]
    assert [corners[:, 0].mean() for corners in there] == pytest.approx([-1.2, 1.2])
    for corners in there:
        assert np.ptp(corners[:, 2]) == pytest.approx(0.5)
        assert np.ptp(corners[:, 1]) == pytest.approx(0.0)


def test_pictures_show_them_and_keep_them_while_the_cart_moves():
    cartpole = load_model("cartpole")
    narrow = CARTPOLE_V1.with_changes(x_limit=1.2)
    drawn = []
    for task in (CARTPOLE_V1, narrow):
        with open_renderer(cartpole, width=320, height=240, kind="sketch", task=task) as renderer:
            renderer.render((0.9, 0.0, 0.0, 0.0))
            drawn.append(renderer.render((0.0, 0.0, 0.0, 0.0)).astype(int))
    columns = np.flatnonzero((drawn[0] != drawn[1]).any(axis=(0, 2)))
    assert columns.size and (columns + columns[::-1] == 319).all()
