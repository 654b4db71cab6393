"""Numbers and an arrow in the picture, readable and in the right place."""

import math

import numpy as np
import pytest
from PIL import Image

from mjcartpole.errors import RenderError
from mjcartpole.media.hud import Moment, Strip
from mjcartpole.media.overlay import Overlay
from mjcartpole.media.palette import ACTION, INK, PAPER
from mjcartpole.media.renderer import open_renderer
from mjcartpole.media.text import Lettering
from mjcartpole.physics.load import load_model, models_folder

DOCUMENT = (models_folder() / "cartpole.xml").read_text(encoding="utf-8")
SIZES = [(320, 240), (640, 480), (1920, 1080)]
LARGER = [pytest.param(size, marks=pytest.mark.slow) for size in SIZES[1:]]


@pytest.fixture(scope="module")
def cartpole():
    return load_model()


def moment(x=0.3, theta=0.1, action=1, values=(49.25, 47.5), step=123):
    return Moment(step, float(step), (x, -0.43, theta, 1.1), action, values)


def draw(cartpole, shown, width=640, height=480, camera="side"):
    """A frame without and with the overlay, and the cart's box."""
    with open_renderer(
        cartpole, width=width, height=height, camera=camera, kind="sketch"
    ) as renderer:
        frame = renderer.render(shown.state)
        plain = frame.copy()
        result = Overlay(renderer.scene).draw(frame, shown)
        assert result is frame
        return plain, frame, renderer.scene.cart_box()


def arrow_pixels(frame, bottom):
    """Rows and columns of the arrow, which lies above the strip."""
    green = np.abs(frame[:bottom].astype(int) - ACTION).max(axis=2) < 12
    return np.nonzero(green)


def strip_height(width, height):
    return len(Strip(width, height).pixels)


@pytest.mark.parametrize("size", [SIZES[0], *LARGER])
@pytest.mark.parametrize("x", [-2.4, 0.0, 1.1, 2.4])
@pytest.mark.parametrize("action", [0, 1])
def test_the_arrow_is_at_the_cart_and_points_where_the_push_goes(cartpole, size, x, action):
    width, height = size
    _, frame, cart = draw(cartpole, moment(x, action=action), width, height)
    rows, columns = arrow_pixels(frame, height - strip_height(*size))
    cart_width = cart[2] - cart[0]
    middle = (columns.min() + columns.max() + 1) / 2
    assert middle == pytest.approx((cart[0] + cart[2]) / 2, abs=0.35 * cart_width)
    assert cart[3] <= rows.min() < cart[3] + 2 * (cart[3] - cart[1])
    # The head is the wider half.
    share_right = (columns > middle).mean()
    assert (share_right > 0.55) == (action == 1)
    assert (share_right < 0.45) == (action == 0)


@pytest.mark.parametrize("size", [*SIZES, (480, 480), (160, 120), (100, 80), (16, 16)])
@pytest.mark.parametrize("camera", ["side", "follow"])
def test_pole_and_cart_are_not_covered(cartpole, size, camera):
    plain, frame, cart = draw(cartpole, moment(-1.7, -0.2), *size, camera)
    changed = np.nonzero((plain != frame).any(axis=(1, 2)))[0]
    # Where the cart stands on the lower edge, the arrow has no other place.
    slack = 0 if size[1] > 100 else 12
    assert changed.min() >= cart[3] - slack
    red, green, blue = (plain[..., index].astype(int) for index in range(3))
    pole = (red > blue + 60) & (green > blue + 30)
    assert (plain[pole] == frame[pole]).all() or slack


def test_without_action_and_values_there_is_neither_arrow_nor_bar(cartpole):
    _, frame, _ = draw(cartpole, moment(action=None, values=None))
    assert not len(arrow_pixels(frame, 480)[0])


@pytest.mark.parametrize("size", SIZES)
def test_the_bar_of_the_chosen_action_is_marked_and_bars_show_the_values(size):
    strip = Strip(*size)
    for action, values in ((0, (10.0, 5.0)), (1, (5.0, 10.0))):
        pixels = strip.show(moment(action=action, values=values)).copy()
        chosen = (pixels == ACTION).all(axis=2)
        rows, columns = np.nonzero(chosen)
        assert (rows.mean() < len(pixels) / 2) == (action == 0)
        other = strip.show(moment(action=1 - action, values=values))
        shorter = np.nonzero((other == ACTION).all(axis=2))[1]
        ratio = (shorter.max() + 1 - shorter.min()) / (columns.max() + 1 - columns.min())
        assert ratio == pytest.approx(0.5, abs=0.1)


@pytest.mark.parametrize("values", [(0.0, 0.0), (-3.0, 1.0), (1e9, -1e-9), (math.inf, 1.0)])
def test_any_values_can_be_shown(values):
    strip = Strip(640, 480)
    before = strip.show(moment(values=None)).copy()
    assert (strip.show(moment(values=values)) != before).any()


@pytest.mark.parametrize("size", SIZES)
def test_text_is_readable(size):
    """Letters are at least as high as ten pixels ask for, dark on light, and not cut off."""
    height = size[1]
    pixels = Strip(*size).show(moment()).astype(int)
    ink = np.abs(pixels - PAPER).sum(axis=2) > 200
    ink[: max(1, height // 200)] = False
    rows = np.nonzero(ink.any(axis=1))[0]
    assert rows.min() > 0
    assert rows.max() < len(pixels) - 1
    assert not ink[:, -2:].any()
    assert len(pixels) < 0.2 * height
    assert Lettering(10).height >= 10


def test_a_strip_that_is_used_again_equals_a_new_one():
    used = Strip(640, 480)
    for step in range(0, 2000, 37):
        used.show(moment(step - 500.0, step / 100, step % 2, (step / 7, -step / 9), step))
    assert (used.show(moment()) == Strip(640, 480).show(moment())).all()


def test_different_moments_look_different():
    strip = Strip(640, 480)
    moments = [
        moment(),
        moment(x=0.31),
        moment(theta=-0.1),
        moment(step=124),
        moment(action=0),
        moment(values=(49.24, 47.5)),
    ]
    pictures = {strip.show(each).tobytes() for each in moments}
    assert len(pictures) == len(moments)


def test_digits_do_not_jump():
    text = Lettering(16)
    assert len({text.width(digit) for digit in "0123456789"}) == 1
    assert text.width("-1.5") == text.width("+1.5")


def test_a_minus_is_a_bar_in_the_middle():
    text = Lettering(32)
    cell = np.full((text.height, text.width("-"), 3), PAPER, np.uint8)
    text.number(cell, "-", INK)
    ink = np.abs(cell.astype(int) - PAPER).sum(axis=2) > 100
    rows, columns = np.nonzero(ink)
    assert columns.max() - columns.min() > 3 * (rows.max() - rows.min())
    assert 0.3 < rows.mean() / text.height < 0.7


def test_long_text_is_shortened_in_its_middle():
    text = Lettering(12)
    long = "runs/tuned-mujoco-seed0/" + "x" * 200
    assert text.fitted(long, 150).shape[1] <= 150
    assert (text.fitted("short", 150) == text.line("short")).all()
    assert text.fitted(long, 4).shape[1] <= 4


def test_a_frame_of_another_size_is_refused(cartpole):
    with open_renderer(cartpole, kind="sketch", width=64, height=48) as renderer:
        renderer.render((0.0, 0.0, 0.0, 0.0))
        with pytest.raises(RenderError, match="64x48"):
            Overlay(renderer.scene).draw(np.zeros((48, 65, 3), np.uint8), moment())


def test_colours_are_far_from_those_of_pole_cart_and_stops(cartpole):
    hues = [Image.new("RGB", (1, 1), ACTION).convert("HSV").getpixel((0, 0))[0]]
    for name in ("pole", "cart", "stop_left"):
        geom = cartpole.model.geom(name)
        rgb = (255 * cartpole.model.mat_rgba[geom.matid[0], :3]).astype(int)
        hues.append(
            Image.new("RGB", (1, 1), tuple(rgb.tolist())).convert("HSV").getpixel((0, 0))[0]
        )
    distances = [min(abs(hues[0] - hue), 256 - abs(hues[0] - hue)) for hue in hues[1:]]
    assert min(distances) > 30
