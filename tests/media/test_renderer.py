import itertools
import math
import os
import subprocess
import sys
import threading

import mujoco
import numpy as np
import pytest

from mjcartpole.errors import RenderError
from mjcartpole.media import gl
from mjcartpole.media import renderer as renderer_module
from mjcartpole.media.hud import Moment
from mjcartpole.media.overlay import Overlay
from mjcartpole.media.renderer import GLRenderer, open_renderer
from mjcartpole.media.scene import Scene
from mjcartpole.physics.load import load_model
from mjcartpole.task import Task
from nightly import at_night, few

WIDTH, HEIGHT = 640, 480
HALF_VIEW = 9 * math.tan(math.radians(26) / 2) * WIDTH / HEIGHT
"""Metres from the middle of the side camera's picture to its edge, at the pole's distance."""

STATES = [
    (0.0, 0.0, 0.0, 0.0),
    (1.234, 0.5, 0.2, -1.0),
    (-0.77, 0.0, -0.17, 2.0),
    (2.4, 0.0, 0.2094, 0.0),
    (-2.4, 0.0, -0.031, 0.0),
    (0.3, 0.0, 1.2, 0.0),
]

WITHOUT_CAMERA = """
<mujoco model="bare">
  <option timestep="0.02"/>
  <worldbody>
    <body>
      <joint name="slider" type="slide" axis="1 0 0"/>
      <geom type="box" size="0.2 0.1 0.1" rgba="0 0 1 1"/>
      <body>
        <joint name="hinge" type="hinge" axis="0 1 0"/>
        <geom type="capsule" fromto="0 0 0 0 0 1" size="0.03" rgba="1 0.6 0 1"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="slider"/></actuator>
</mujoco>
"""


@pytest.fixture(scope="module")
def cartpole():
    return load_model()


@pytest.fixture(scope="module", params=["gl", "sketch"])
def kind(request):
    if request.param == "sketch":
        return "sketch"
    backend = gl.find_backend()
    if backend is None:
        pytest.skip("no OpenGL works here")
    return backend


@pytest.fixture(scope="module")
def renderer(cartpole, kind):
    with open_renderer(cartpole, width=WIDTH, height=HEIGHT, kind=kind) as renderer:
        yield renderer


def pixels_of(frame, colour):
    """Columns and rows, shape (2, n), of the pixels of the pole or of the cart."""
    red, green, blue = (frame[..., index].astype(int) for index in range(3))
    pole = (red > blue + 60) & (green > blue + 30)
    cart = (blue > red + 60) & (blue > green + 30)
    rows, columns = np.nonzero(pole if colour == "pole" else cart)
    return np.array([columns, rows])


def measured_angle(frame):
    """The pole's angle from upright in radians, positive to the right: its pixels' main axis."""
    columns, rows = pixels_of(frame, "pole")
    axes = np.linalg.svd(np.array([columns - columns.mean(), rows - rows.mean()]))[0]
    right, down = axes[:, 0]
    return math.atan2(right, -down) if down < 0 else math.atan2(-right, down)


def measured_position(frame):
    """The cart's position in metres."""
    columns, _ = pixels_of(frame, "cart")
    middle = (columns.min() + columns.max() + 1) / 2
    return (middle - WIDTH / 2) / (WIDTH / 2) * HALF_VIEW


@pytest.mark.parametrize("state", STATES)
def test_the_picture_is_true(renderer, state):
    frame = renderer.render(state)
    assert frame.shape == (HEIGHT, WIDTH, 3)
    assert frame.dtype == np.uint8
    assert measured_angle(frame) == pytest.approx(state[2], abs=math.radians(1))
    assert measured_position(frame) == pytest.approx(state[0], abs=0.02 * 4.8)


def random_states(count, seed):
    """States all over the track, the pole within and beyond its limits, shape (n, 4)."""
    high = np.array([2.4, 3.0, 0.5, 3.0])
    return np.random.default_rng(seed).uniform(-high, high, (count, 4))


def test_the_picture_is_true_for_states_nobody_chose_with_and_without_overlay(renderer):
    overlay = Overlay(renderer.scene)
    for step, state in enumerate(random_states(at_night(25, fast=6), seed=5)):
        frame = renderer.render(state)
        for _ in range(2):
            assert measured_angle(frame) == pytest.approx(state[2], abs=math.radians(1))
            assert measured_position(frame) == pytest.approx(state[0], abs=0.02 * 4.8)
            moment = Moment(step, float(step), state, step % 2, (3.0, 4.0))
            frame = overlay.draw(frame, moment)


@pytest.mark.parametrize("quality", ["draft", "high"])
def test_the_picture_is_true_at_every_quality(cartpole, kind, quality):
    with open_renderer(cartpole, kind=kind, quality=quality) as renderer:
        for state in random_states(at_night(5, fast=2), seed=6):
            frame = renderer.render(state)
            assert measured_angle(frame) == pytest.approx(state[2], abs=math.radians(1))
            assert measured_position(frame) == pytest.approx(state[0], abs=0.02 * 4.8)


def test_the_fan_is_faint_and_moves_with_the_cart(renderer):
    background = renderer.render((0.0, 0.0, 0.0, 0.0))[5, 5].astype(int)
    for x in (-1.5, 0.0, 1.5):
        # The pole leans to the left; to the right of upright there is the fan alone.
        frame = renderer.render((x, 0.0, -0.15, 0.0)).astype(int)
        column, row = renderer.scene.view.project(np.array([[x + 0.1, 0.0, 0.9]]))[0][0]
        inside = frame[int(row), int(column)]
        assert 8 < (background - inside).max() < 60
        outside = frame[int(row), int(column) + 30]
        assert np.abs(outside - background).max() < 3


@pytest.mark.parametrize("quality", few(["draft", "normal", "high"], "draft", long=("high",)))
def test_a_part_that_is_drawn_again_equals_a_whole_picture(cartpole, quality):
    """Only a box is drawn for each frame; but for rounding nobody can tell."""
    if (backend := gl.find_backend()) is None:
        pytest.skip("no OpenGL works here")
    # A sky behind the wall is never seen, but has every frame drawn as a whole.
    sky = '<asset><texture type="skybox" builtin="flat" width="8" height="8"/>'
    whole = load_model(cartpole.xml.replace("<asset>", sky))
    options = {"kind": backend, "quality": quality, "width": 320, "height": 240}
    with (
        open_renderer(cartpole, **options) as parts,
        open_renderer(whole, **options) as wholes,
    ):
        assert parts.scene.is_local
        assert not wholes.scene.is_local
        for state in [*random_states(8, seed=7), (9.0, 0.0, 0.0, 0.0), (2.7, 0.0, 3.0, 0.0)]:
            difference = np.abs(parts.render(state).astype(int) - wholes.render(state)).max(axis=2)
            assert (difference > 8).mean() < 1e-3
            assert difference.mean() < 0.01


def test_what_moves_may_pass_the_camera(kind):
    """Where a part of it is behind the camera, no box can tell where it is seen."""
    along = 'pos="-1 0 0.5" xyaxes="0 -1 0 0 0 1"'
    document = load_model().xml.replace('pos="0 -9 0.55" xyaxes="1 0 0 0 0 1"', along)
    with open_renderer(load_model(document), kind=kind, width=64, height=48) as renderer:
        ahead = renderer.render((0.0, 0.0, 0.0, 0.0))
        passing = renderer.render((-1.1, 0.0, 0.5, 0.0))
        assert renderer.scene.moving_box() is None
        behind = renderer.render((-2.4, 0.0, 0.0, 0.0))
        assert (ahead != passing).any()
        assert (ahead != behind).any()
        assert (renderer.render((0.0, 0.0, 0.0, 0.0)) == ahead).all()


def test_frames_of_different_states_differ_and_belong_to_the_caller(renderer):
    first = renderer.render((0.0, 0.0, 0.05, 0.0))
    kept = first.copy()
    second = renderer.render((0.01, 0.0, 0.05, 0.0))
    assert (first == kept).all()
    assert (first != second).any()
    assert (renderer.render((0.0, 0.0, 0.05, 0.0)) == first).all()


def test_the_track_ends_are_in_the_picture(renderer):
    frame = renderer.render((0.0, 0.0, 0.0, 0.0)).astype(int)
    red = (frame[..., 0] > frame[..., 1] + 60) & (frame[..., 0] > frame[..., 2] + 60)
    pole = (frame[..., 1] > frame[..., 2] + 30) & red
    columns = np.nonzero((red & ~pole).any(axis=0))[0]
    ends = (np.array([columns.min(), columns.max() + 1]) - WIDTH / 2) / (WIDTH / 2) * HALF_VIEW
    assert ends == pytest.approx([-2.66, 2.66], abs=0.05)


def test_the_following_camera_keeps_the_cart_in_the_middle(cartpole, kind):
    with open_renderer(cartpole, kind=kind, camera="follow", width=WIDTH) as renderer:
        for x in (-2.0, 1.5):
            columns, _ = pixels_of(renderer.render((x, 0.0, 0.0, 0.0)), "cart")
            assert columns.mean() == pytest.approx(WIDTH / 2, abs=0.1 * WIDTH)


def test_a_model_without_a_camera_is_seen_as_a_whole(kind):
    with open_renderer(load_model(WITHOUT_CAMERA), kind=kind) as renderer:
        for x in (-2.4, 0.0, 2.4):
            columns, _ = pixels_of(renderer.render((x, 0.0, 0.0, 0.0)), "cart")
            assert columns.min() > 0
            assert columns.max() < WIDTH - 1
            assert np.sign(columns.mean() - WIDTH / 2 + 0.5).round() == np.sign(x) or x == 0


@pytest.mark.parametrize(("width", "height"), [(16, 16), (333, 77), (2000, 1200)])
def test_any_size_works(cartpole, kind, width, height):
    with open_renderer(cartpole, kind=kind, width=width, height=height) as renderer:
        frame = renderer.render((0.0, 0.0, 0.0, 0.0))
    assert frame.shape == (height, width, 3)
    assert frame.std() > 0


@pytest.mark.parametrize("state", [(0.0, 0.0, 0.0), (0.0, 0.0, math.nan, 0.0), 1.0])
def test_what_is_no_state_is_refused(renderer, state):
    with pytest.raises(RenderError, match="4 finite numbers"):
        renderer.render(state)


def test_a_closed_renderer_says_so(cartpole, kind):
    renderer = open_renderer(cartpole, kind=kind, width=16, height=16)
    renderer.close()
    renderer.close()
    with pytest.raises(RenderError, match="closed"):
        renderer.render((0.0, 0.0, 0.0, 0.0))


@pytest.mark.parametrize("size", [15, 8193, -1, 640.0, "640", None])
@pytest.mark.parametrize("side", ["width", "height"])
def test_a_size_that_makes_no_sense_is_refused(cartpole, side, size):
    with pytest.raises(RenderError, match=f"{side} .*from 16 to 8192"):
        open_renderer(cartpole, kind="sketch", **{side: size})


def test_an_unknown_camera_is_refused_with_those_there_are(cartpole):
    with pytest.raises(RenderError, match="no camera 'top'; available: side, follow"):
        open_renderer(cartpole, camera="top")
    with pytest.raises(RenderError, match="no camera 'top'; available: free"):
        open_renderer(load_model(WITHOUT_CAMERA), camera="top")


def test_an_unknown_kind_is_refused(cartpole):
    with pytest.raises(RenderError, match="'vulkan' is unknown; available: auto, egl"):
        open_renderer(cartpole, kind="vulkan")


def test_a_backend_asked_for_by_name_that_does_not_work_is_an_error(cartpole, monkeypatch):
    monkeypatch.setattr(gl, "can_use", lambda backend: False)
    with pytest.raises(RenderError, match="OpenGL by osmesa does not work here"):
        open_renderer(cartpole, kind="osmesa")
    with open_renderer(cartpole) as renderer:
        assert renderer.kind == "sketch"


def test_a_backend_that_fails_after_its_probe_gives_way_to_the_sketch(cartpole, monkeypatch):
    def fail(*_):
        raise RenderError("no context")

    monkeypatch.setattr(gl, "find_backend", lambda: "egl")
    monkeypatch.setattr(renderer_module, "GLRenderer", fail)
    with open_renderer(cartpole) as renderer:
        assert renderer.kind == "sketch"


def test_drawing_leaves_the_model_alone(cartpole, renderer):
    model = cartpole.model
    before = model.qpos0.copy(), model.vis.global_.offwidth, model.body_mass.copy()
    renderer.render((1.0, 0.0, 0.2, 0.0))
    after = model.qpos0, model.vis.global_.offwidth, model.body_mass
    assert all(np.array_equal(a, b) for a, b in zip(before, after, strict=True))


def test_a_renderer_may_move_to_another_thread(cartpole, kind):
    frames = []
    with open_renderer(cartpole, kind=kind, width=64, height=48) as renderer:
        here = renderer.render((1.0, 0.0, 0.1, 0.0))
        thread = threading.Thread(
            target=lambda: frames.append(renderer.render((1.0, 0.0, 0.1, 0.0)))
        )
        thread.start()
        thread.join()
    assert (frames[0] == here).all()


def test_renderers_do_not_disturb_each_other(cartpole, kind):
    state = (0.5, 0.0, 0.1, 0.0)
    with (
        open_renderer(cartpole, kind=kind, width=64, height=48) as small,
        open_renderer(cartpole, kind=kind, width=160, height=120) as large,
    ):
        before = small.render(state)
        large.render((-1.0, 0.0, 0.0, 0.0))
        assert (small.render(state) == before).all()


def test_a_failing_drawing_context_is_a_render_error(cartpole, monkeypatch):
    if (backend := gl.find_backend()) is None:
        pytest.skip("no OpenGL works here")

    def fail(*_):
        raise mujoco.FatalError("gladLoadGL error")

    monkeypatch.setattr(mujoco, "MjrContext", fail)
    with pytest.raises(RenderError, match=r"MuJoCo cannot draw by .*: gladLoadGL error"):
        GLRenderer(Scene(cartpole, 16, 16, "side"), backend)


@pytest.mark.long
def test_egl_osmesa_and_sketch_show_the_same(cartpole, tmp_path):
    """The other OpenGL in a process of its own, since one process can only have one of them."""
    code = """
import sys, numpy
from mjcartpole.media.renderer import open_renderer
from mjcartpole.physics.load import load_model
from mjcartpole.task import Task
kind, states, path = sys.argv[1:]
with open_renderer(load_model(), kind=kind) as renderer:
    assert renderer.kind == kind
    numpy.save(path, [renderer.render(state) for state in numpy.load(states)])
"""
    states = random_states(at_night(8, fast=2), seed=8)
    np.save(tmp_path / "states.npy", states)
    frames, here = {}, {"sketch", gl.find_backend()} - {None}
    for kind in here:
        with open_renderer(cartpole, kind=kind) as renderer:
            frames[kind] = np.array([renderer.render(state) for state in states], float)
    for kind in {"egl", "osmesa"} - here:
        if sys.platform == "linux" and gl.works(kind):
            paths = [str(tmp_path / "states.npy"), str(tmp_path / f"{kind}.npy")]
            wish = {"MUJOCO_GL": kind, "PYOPENGL_PLATFORM": kind}
            command = [sys.executable, "-c", code, kind, *paths]
            subprocess.run(command, env={**os.environ, **wish}, check=True, timeout=120)
            frames[kind] = np.load(paths[1]).astype(float)
    if len(frames) == 1:
        pytest.skip("neither EGL nor OSMesa works here")
    for one, other in itertools.combinations(frames.values(), 2):
        assert np.abs(one - other).mean() < 0.01 * 255
    for frame, state in ((f[i], s) for f in frames.values() for i, s in enumerate(states)):
        assert measured_angle(frame) == pytest.approx(state[2], abs=math.radians(1))
        assert measured_position(frame) == pytest.approx(state[0], abs=0.02 * 4.8)


def test_the_limits_of_a_task_are_drawn(cartpole, kind):
    def drawn(**limits):
        task = Task("drawn", **limits)
        with open_renderer(cartpole, width=160, height=120, kind=kind, task=task) as renderer:
            return renderer.render(STATES[0])

    with open_renderer(cartpole, width=160, height=120, kind=kind) as renderer:
        usual = renderer.render(STATES[0])
    assert np.array_equal(drawn(), usual)
    assert not np.array_equal(drawn(theta_limit=0.1), usual)
    assert not np.array_equal(drawn(theta_limit=math.inf), drawn(theta_limit=0.1))
