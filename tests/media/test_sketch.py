import math

import numpy as np
import pytest

from mjcartpole.media.renderer import open_renderer
from mjcartpole.physics.load import load_model

# One metre is 100 pixels: the camera sees 2 m of height in 200 pixels, without perspective.
ORTHOGRAPHIC = """
<mujoco model="shapes">
  <option timestep="0.02"/>
  <visual><headlight ambient="1 1 1" diffuse="0 0 0"/></visual>
  <worldbody>
    <camera name="side" pos="0 -3 0" xyaxes="1 0 0 0 0 1" projection="orthographic" fovy="2"/>
    {still}
    <body>
      <joint name="slider" type="slide" axis="1 0 0"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/>
      {moving}
      <body>
        <joint type="hinge" axis="0 1 0"/>
        <inertial pos="0 0 0.5" mass="0.1" diaginertia="0.1 0.1 0.1"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="slider"/></actuator>
</mujoco>
"""


def shapes(moving="", still="", document=ORTHOGRAPHIC):
    return load_model(document.format(moving=moving, still=still))


def draw(cartpole, x=0.0, theta=0.0, **options):
    with open_renderer(cartpole, kind="sketch", width=200, height=200, **options) as renderer:
        return renderer.render((x, 0.0, theta, 0.0)).astype(int)


RED, BLUE = 'rgba="1 0 0 1"', 'rgba="0 0 1 1"'


@pytest.mark.parametrize(
    ("geom", "area"),
    [
        ('type="box" size="0.3 0.1 0.2"', 0.6 * 0.4),
        ('type="box" size="0.3 0.1 0.2" euler="0 30 0"', 0.6 * 0.4),
        ('type="sphere" size="0.4"', math.pi * 0.4**2),
        ('type="ellipsoid" size="0.5 0.2 0.3"', math.pi * 0.5 * 0.3),
        ('type="capsule" size="0.1 0.3"', math.pi * 0.1**2 + 0.2 * 0.6),
        ('type="cylinder" size="0.1 0.3"', 0.2 * 0.6),
        ('type="cylinder" size="0.3 0.1" euler="90 0 0"', math.pi * 0.3**2),
        ('type="cylinder" size="0.3 0.1" euler="45 0 0"', None),
    ],
)
def test_every_shape_covers_its_area(geom, area):
    if area is None:  # An end, as an ellipse, and half of another one, with the side between.
        area = math.pi * 0.3**2 * math.cos(math.pi / 4) + 0.6 * 0.2 * math.sin(math.pi / 4)
    frame = draw(shapes(f"<geom {geom} {RED}/>"))
    covered = frame[..., 0].sum() / 255 / 100**2
    # Pillow counts a polygon's border as inside: a quarter of a pixel all around.
    assert covered == pytest.approx(area, rel=0.04)
    assert (frame[..., 1:] == 0).all()


def test_a_plane_covers_its_area():
    frame = draw(shapes(still=f'<geom type="plane" size="0.4 0.3 1" zaxis="0 -1 0" {RED}/>'))
    assert frame[..., 0].sum() / 255 / 100**2 == pytest.approx(0.8 * 0.6, rel=0.02)


def test_a_shape_lies_where_it_is():
    frame = draw(shapes(f'<geom type="sphere" size="0.1" pos="0.2 0 0.3" {RED}/>'), x=0.25)
    rows, columns = np.mgrid[:200, :200] + 0.5
    weights = frame[..., 0]
    assert np.average(columns, weights=weights) == pytest.approx(100 + 45, abs=0.1)
    assert np.average(rows, weights=weights) == pytest.approx(100 - 30, abs=0.1)


def test_edges_are_smooth():
    frame = draw(shapes(f'<geom type="box" size="0.3 0.1 0.2" euler="0 10 0" {RED}/>'))
    between = (frame[..., 0] > 30) & (frame[..., 0] < 225)
    assert between.sum() > 100


@pytest.mark.parametrize("behind", [0.3, -0.3])
def test_the_nearer_shape_hides_the_farther_one(behind):
    moving = f'<geom type="box" size="0.1 0.1 0.1" {RED}/>'
    still = f'<geom type="box" size="0.2 0.1 0.2" pos="0 {behind} 0" {BLUE}/>'
    middle = draw(shapes(moving, still))[100, 100]
    assert middle.tolist() == ([255, 0, 0] if behind > 0 else [0, 0, 255])


def test_a_plane_lies_behind_what_stands_on_it():
    wall = f'<geom type="plane" size="5 5 1" zaxis="0 -1 0" pos="0 1 0" {BLUE}/>'
    frame = draw(shapes(f'<geom type="sphere" size="0.2" {RED}/>', wall))
    assert frame[100, 100].tolist() == [255, 0, 0]
    assert frame[0, 0].tolist() == [0, 0, 255]


def test_a_plane_is_not_seen_from_behind():
    assert draw(shapes(still='<geom type="plane" size="1 1 1" zaxis="0 1 0"/>')).max() == 0


def test_what_is_see_through_lets_colours_through():
    wall = f'<geom type="plane" size="5 5 1" zaxis="0 -1 0" pos="0 1 0" {BLUE}/>'
    frame = draw(shapes('<geom type="box" size="0.2 0.1 0.2" rgba="1 0 0 0.5"/>', wall))
    assert frame[100, 100] == pytest.approx([127, 0, 127], abs=2)


def test_materials_give_colour():
    document = ORTHOGRAPHIC.replace(
        "<worldbody>", '<asset><material name="m" rgba="0 1 0 1"/></asset><worldbody>', 1
    )
    geom = '<geom type="sphere" size="0.2" material="m"/>'
    cartpole = shapes(geom, "", document)
    assert draw(cartpole)[100, 100].tolist() == [0, 255, 0]


def test_a_lamp_brightens_the_side_that_it_shines_on():
    lamp = (
        '<light type="directional" dir="1 0 0" ambient="0 0 0" diffuse="1 1 1"/>'
        '<geom type="box" size="0.1 0.1 0.1" euler="0 0 45" rgba="0.5 0.5 0.5 1"/>'
    )
    document = ORTHOGRAPHIC.replace('ambient="1 1 1"', 'ambient="0.2 0.2 0.2"')
    frame = draw(shapes("", lamp, document))
    assert frame[100, 95, 0] > frame[100, 105, 0] + 50


@pytest.mark.parametrize("camera", ["side", "follow"])
def test_a_later_frame_equals_a_first_one(camera):
    """What is kept from frame to frame must not show."""
    cartpole = load_model()
    states = [(x, 0.0, theta, 0.0) for x in (-2.4, 0.3, 2.4) for theta in (-0.2, 2.0)]
    options = {"kind": "sketch", "camera": camera, "width": 320, "height": 240}
    with open_renderer(cartpole, **options) as kept:
        for state in states:
            with open_renderer(cartpole, **options) as fresh:
                assert (kept.render(state) == fresh.render(state)).all()


def test_a_cart_outside_the_picture_leaves_the_background():
    cartpole = load_model()
    with open_renderer(cartpole, kind="sketch") as renderer:
        far = renderer.render((50.0, 0.0, 0.0, 0.0))
        farther = renderer.render((-90.0, 0.0, 1.0, 0.0))
        assert (far == farther).all()
        assert (far != renderer.render((0.0, 0.0, 0.0, 0.0))).any()


def test_what_lies_behind_the_camera_is_not_drawn():
    still = f'<geom type="sphere" size="0.2" pos="0 -5 0" {RED}/>'
    assert draw(shapes(still=still)).max() == 0


def test_a_ground_that_reaches_behind_the_camera_is_cut():
    document = ORTHOGRAPHIC.replace('projection="orthographic" fovy="2"', 'fovy="60"')
    ground = f'<geom type="plane" size="50 50 1" pos="0 0 -0.5" {RED}/>'
    frame = draw(shapes("", ground, document))
    reds = frame[..., 0].sum(axis=1)
    assert (reds[:99] == 0).all()
    assert (reds[110:] == 200 * 255).all()


def test_a_mesh_is_drawn_by_its_outline():
    mesh = (
        '<asset><mesh name="tetra" vertex="0 0 0  0.4 0 0  0 0 0.4  0 0.4 0"/></asset><worldbody>'
    )
    document = ORTHOGRAPHIC.replace("<worldbody>", mesh, 1)
    geom = f'<geom type="mesh" mesh="tetra" {RED}/>'
    frame = draw(shapes(geom, "", document))
    assert frame[..., 0].sum() / 255 / 100**2 == pytest.approx(0.4 * 0.4 / 2, rel=0.05)


def test_the_sky_is_the_background():
    sky = (
        '<asset><texture type="skybox" builtin="flat" rgb1="0.2 0.4 0.6" rgb2="0.2 0.4 0.6" '
        'width="8" height="8"/></asset><worldbody>'
    )
    document = ORTHOGRAPHIC.replace("<worldbody>", sky, 1)
    frame = draw(shapes("", "", document))
    assert frame[0, 0] == pytest.approx([51, 102, 153], abs=1)


INSIDES = ["box", "sphere", "capsule", "cylinder", "ellipsoid"]


@pytest.mark.parametrize("kind", INSIDES)
@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_a_camera_inside_of_a_shape_or_touching_it_does_no_harm(kind, projection):
    document = ORTHOGRAPHIC.replace("orthographic", projection).replace('fovy="2"', 'fovy="60"')
    for y in (-3.0, -2.99, -3.5, -2.5):
        inside = f'<geom type="{kind}" size="0.5 0.5 0.5" pos="0 {y} 0" {RED}/>'
        far = f'<geom type="box" size="0.3 0.1 0.3" {BLUE}/>'
        frame = draw(shapes(far, inside, document), theta=0.3)
        assert frame.shape == (200, 200, 3)


def test_a_shape_that_reaches_behind_the_camera_is_cut():
    document = ORTHOGRAPHIC.replace('projection="orthographic" fovy="2"', 'fovy="60"')
    rail = f'<geom type="capsule" size="0.05" fromto="0 -9 -0.3 0 9 -0.3" {RED}/>'
    frame = draw(shapes("", rail, document))
    assert frame[199, 100, 0] > 0
    assert frame[110:, :, 0].any(axis=1).all()


def test_a_plane_without_end_reaches_the_horizon():
    document = ORTHOGRAPHIC.replace('projection="orthographic" fovy="2"', 'fovy="60"')
    ground = f'<geom type="plane" size="0 0 1" pos="0 0 -0.5" {RED}/>'
    reds = draw(shapes("", ground, document))[..., 0].sum(axis=1)
    assert (reds[:99] == 0).all()
    assert (reds[110:] == 200 * 255).all()


@pytest.mark.parametrize("kind", INSIDES)
def test_a_shape_that_is_see_through_is_blended_once(kind):
    wall = f'<geom type="plane" size="5 5 1" zaxis="0 -1 0" pos="0 1 0" {BLUE}/>'
    geom = f'<geom type="{kind}" size="0.2 0.2 0.2" rgba="1 0 0 0.5"/>'
    assert draw(shapes(geom, wall))[100, 100] == pytest.approx([127, 0, 127], abs=2)


def test_a_size_that_is_no_number_is_left_out():
    cartpole = shapes(f'<geom name="odd" type="capsule" size="0.1 0.2" {RED}/>')
    cartpole.model.geom("odd").size[:] = np.nan
    with open_renderer(cartpole, kind="sketch", width=64, height=48) as renderer:
        assert renderer.render((0.0, 0.0, 0.0, 0.0)).max() == 0
