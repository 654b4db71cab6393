"""Where things are in the picture, and the fan of the angles that are allowed."""

import math

import mujoco
import numpy as np
import pytest

from mjcartpole.errors import RenderError
from mjcartpole.media.scene import Scene, check_picture
from mjcartpole.physics.load import load_model, models_folder
from mjcartpole.task import CARTPOLE_V1, Task

DOCUMENT = (models_folder() / "cartpole.xml").read_text(encoding="utf-8")
LONG = DOCUMENT.replace('fromto="0 0 0 0 0 1"', 'fromto="0 0 0 0 0 2"')
HANGING = DOCUMENT.replace('pos="0 0 0.5" mass', 'pos="0 0 -0.5" mass').replace(
    'fromto="0 0 0 0 0 1"', 'fromto="0 0 0 0 0 -1"'
)
NO_GEOMS = """
<mujoco>
  <option timestep="0.02"/>
  <worldbody>
    <body>
      <joint name="s" type="slide" axis="1 0 0"/>
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <body>
        <joint type="hinge" axis="0 1 0"/>
        <inertial pos="0 0 0.5" mass="1" diaginertia="1 1 1"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="s"/></actuator>
</mujoco>
"""


def scene_of(document="cartpole", state=(0.0, 0.0, 0.0, 0.0), camera="side", task=CARTPOLE_V1):
    scene = Scene(load_model(document), 640, 480, camera, task=task)
    scene.show(state)
    return scene


def angles(wedge):
    """The rim's angles from upright in radians, positive to +x."""
    arms = wedge.corners[1:] - wedge.corners[0]
    return np.arctan2(arms[:, 0], arms[:, 2])


@pytest.mark.parametrize("state", [(0, 0, 0, 0), (1.3, 0, 0.2, 0), (-2.0, 0, -1.0, 0)])
def test_the_fan_moves_with_the_cart_and_not_with_the_pole(state):
    inside, left, right = scene_of(state=state).wedges
    assert inside.corners[0] == pytest.approx([state[0], 0, 0], abs=1e-12)
    assert angles(inside)[[0, -1]] == pytest.approx(
        [-CARTPOLE_V1.theta_limit, CARTPOLE_V1.theta_limit]
    )
    assert angles(left)[-1] == pytest.approx(-CARTPOLE_V1.theta_limit)
    assert angles(right)[0] == pytest.approx(CARTPOLE_V1.theta_limit)


@pytest.mark.parametrize(("document", "length"), [("cartpole", 1.03), (LONG, 2.03)])
def test_the_fan_is_a_little_longer_than_the_pole(document, length):
    corners = scene_of(document).wedges[0].corners
    radius = np.linalg.norm(corners[1:] - corners[0], axis=1)
    assert (radius > length).all()
    assert (radius < 1.1 * length).all()


def test_the_fan_stands_where_the_document_has_the_pole_hang():
    inside = scene_of(HANGING, (0.0, 0.0, 0.1, 0.0)).wedges[0]
    up = np.arctan2(*(inside.corners[1:] - inside.corners[0])[:, [0, 2]].T)
    assert sorted(up[[0, -1]]) == pytest.approx([-CARTPOLE_V1.theta_limit, CARTPOLE_V1.theta_limit])


def test_the_fan_shows_the_limit_of_its_task():
    inside = scene_of(task=Task("narrow", theta_limit=0.1)).wedges[0]
    assert angles(inside)[[0, -1]] == pytest.approx([-0.1, 0.1])


@pytest.mark.parametrize("limit", [math.pi, 4.0, math.inf])
def test_where_any_angle_is_allowed_there_is_no_fan(limit):
    scene = scene_of(task=Task("free", theta_limit=limit))
    assert scene.wedges == []
    assert scene.abstract.ngeom == scene.n_geoms


@pytest.mark.parametrize(("limit", "extent"), [(1.0, 1.0), (2.4, 2.4), (math.inf, 2.4)])
def test_a_free_camera_sees_the_track_of_its_task(limit, extent):
    scene = scene_of(camera="free", task=Task("track", x_limit=limit))
    ends = scene.view.project(np.array([[-extent, 0.0, 0.0], [extent, 0.0, 0.0]]))[0]
    assert (ends[1] - ends[0])[0] == pytest.approx(640 / 1.2)


def test_a_pole_without_geoms_has_no_fan():
    scene = scene_of(NO_GEOMS)
    assert scene.wedges == []
    assert scene.abstract.ngeom == scene.n_geoms == 0
    assert scene.cart_box() is not None


def test_the_fan_is_in_the_picture_and_not_in_the_model():
    scene = scene_of()
    decorations = scene.abstract.geoms[scene.n_geoms : scene.abstract.ngeom]
    assert scene.n_geoms == scene.model.ngeom == load_model().model.ngeom
    assert len(decorations) > 3
    assert {geom.category for geom in decorations} == {int(mujoco.mjtCatBit.mjCAT_DECOR)}
    assert max(geom.rgba[3] for geom in decorations) < 0.6


@pytest.mark.parametrize("x", [-2.4, 0.0, 1.0])
def test_the_cart_is_where_it_is(x):
    scene = scene_of(state=(x, 0.0, 0.1, 0.0))
    left, top, right, bottom = scene.cart_box()
    # Perspective shows the cart, which is 4 to 18 cm behind the pole, a little smaller.
    metre = 240 / (9.04 * math.tan(math.radians(13)))
    assert (left + right) / 2 == pytest.approx(320 + x * metre, abs=5)
    assert right - left == pytest.approx(0.4 * metre, abs=5)
    assert (top + bottom) / 2 == pytest.approx(240 + 0.55 * metre, abs=2)


def test_what_moves_lies_in_its_box():
    scene = scene_of(state=(0.5, 0.0, 1.3, 0.0))
    left, top, right, bottom = scene.moving_box()
    tip = scene.view.project(np.array([[0.5 + math.sin(1.3), 0.0, math.cos(1.3)]]))[0][0]
    cart = scene.cart_box()
    assert left <= min(tip[0], cart[0])
    assert right >= max(tip[0], cart[2])
    assert top <= tip[1] <= cart[3] <= bottom


def test_a_push_to_the_right_points_to_the_right():
    across, down = scene_of(state=(1.0, 0.0, 0.0, 0.0)).push_direction()
    assert across > 0
    assert down == pytest.approx(0, abs=1e-9)


def test_what_stands_still_is_known():
    assert scene_of().is_still
    assert not scene_of(camera="follow").is_still
    moving_lamp = DOCUMENT.replace('<body name="pole">', '<body name="pole"><light/>')
    assert not scene_of(moving_lamp).is_still


@pytest.mark.parametrize(
    ("change", "by"),
    [
        ('name="ground"', 'name="ground" reflectance="0.3"'),
        ("<asset>", '<asset><texture type="skybox" builtin="flat" width="8" height="8"/>'),
        ('<body name="pole">', '<body name="pole"><site size="0.1"/>'),
    ],
)
def test_what_changes_more_than_the_pixels_that_it_covers_is_known(change, by):
    assert scene_of().is_local
    assert not scene_of(DOCUMENT.replace(change, by)).is_local


def test_shadows_change_more_than_the_pixels_that_they_fall_from():
    shaded = DOCUMENT.replace('shadowsize="0"', 'shadowsize="512"')
    assert scene_of(shaded).is_local
    assert not scene_of(shaded.replace('castshadow="false"', 'castshadow="true"')).is_local


def test_a_picture_can_be_checked_before_anything_is_drawn():
    cartpole = load_model()
    check_picture(cartpole, 640, 480, "follow")
    with pytest.raises(RenderError, match="no camera 'top'"):
        check_picture(cartpole, 640, 480, "top")
    with pytest.raises(RenderError, match="height 3"):
        check_picture(cartpole, 640, 3, "side")
