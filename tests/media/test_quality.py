"""draft, normal, high: what each changes, and that an edit of the model's quality shows."""

import mujoco
import numpy as np
import pytest

from mjcartpole.errors import RenderError
from mjcartpole.media import gl
from mjcartpole.media.quality import level_of
from mjcartpole.media.renderer import open_renderer
from mjcartpole.media.scene import Scene
from mjcartpole.physics.load import load_model, models_folder

STATE = (0.4, 0.0, 0.13, 0.0)
DOCUMENT = (models_folder() / "cartpole.xml").read_text(encoding="utf-8")
ROUGH = DOCUMENT.replace('offsamples="4"', 'offsamples="0"')
SHADED = DOCUMENT.replace('shadowsize="0"', 'shadowsize="512"').replace(
    'castshadow="false"', 'castshadow="true"'
)


@pytest.fixture(scope="module")
def cartpole():
    return load_model()


@pytest.fixture(scope="module", params=["gl", "sketch"])
def kind(request):
    if request.param == "sketch":
        return "sketch"
    if (backend := gl.find_backend()) is None:
        pytest.skip("no OpenGL works here")
    return backend


def draw(cartpole, kind, quality):
    with open_renderer(cartpole, width=160, height=120, kind=kind, quality=quality) as renderer:
        return renderer.render(STATE).astype(int)


def colours(frame):
    return len(np.unique(frame.reshape(-1, 3), axis=0))


def test_an_unknown_quality_is_refused_with_those_there_are(cartpole):
    with pytest.raises(RenderError, match="'best' is unknown; available: draft, normal, high"):
        open_renderer(cartpole, quality="best")


def test_all_qualities_show_the_same_and_edges_get_smoother(cartpole, kind):
    draft, normal, high = (draw(cartpole, kind, quality) for quality in ("draft", "normal", "high"))
    assert np.abs(draft - normal).mean() < 0.02 * 255
    assert np.abs(high - normal).mean() < 0.01 * 255
    assert colours(draft) < colours(normal) < colours(high)


def test_normal_and_high_do_what_the_file_says_and_draft_does_not():
    if (backend := gl.find_backend()) is None:
        pytest.skip("no OpenGL works here")
    smooth, rough = load_model(), load_model(ROUGH)
    assert colours(draw(rough, backend, "normal")) < colours(draw(smooth, backend, "normal"))
    assert (draw(rough, backend, "draft") == draw(smooth, backend, "draft")).all()


def test_shadows_are_drawn_where_the_file_asks_for_them():
    if (backend := gl.find_backend()) is None:
        pytest.skip("no OpenGL works here")
    plain, shaded = load_model(), load_model(SHADED)
    assert (draw(plain, backend, "normal") != draw(shaded, backend, "normal")).any()
    assert (draw(plain, backend, "high") != draw(shaded, backend, "high")).any()
    assert (draw(plain, backend, "draft") == draw(shaded, backend, "draft")).all()


def test_a_level_leaves_the_cart_pole_alone(cartpole):
    scene = Scene(cartpole, 64, 48, "side", "draft")
    assert scene.model.vis.quality.offsamples == 0
    assert cartpole.model.vis.quality.offsamples == 4
    assert not scene.abstract.flags[mujoco.mjtRndFlag.mjRND_SHADOW]


def test_very_large_pictures_are_not_enlarged_further():
    high = level_of("high")
    assert high.fit(1920, 1080) == high
    assert high.fit(3840, 2160).enlargement == 1
    assert level_of("normal").fit(8192, 8192) == level_of("normal")
