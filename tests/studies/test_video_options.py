"""How a film looks: what is written there is what pictures have anyway, and nonsense is refused."""

import pytest

from mjcartpole.errors import RenderError
from mjcartpole.media.quality import DEFAULT_QUALITY
from mjcartpole.media.renderer import DEFAULT_HEIGHT, DEFAULT_WIDTH
from mjcartpole.media.scene import DEFAULT_CAMERA
from mjcartpole.media.video import DEFAULT_FPS
from mjcartpole.physics.load import load_model
from mjcartpole.studies.video_options import VideoOptions


def test_the_defaults_are_those_of_a_picture():
    look = VideoOptions()
    assert (look.width, look.height) == (DEFAULT_WIDTH, DEFAULT_HEIGHT)
    assert (look.camera, look.quality, look.fps) == (DEFAULT_CAMERA, DEFAULT_QUALITY, DEFAULT_FPS)
    look.check(load_model())


@pytest.mark.parametrize("size", ["320x240", "320X240"])
def test_a_size_in_words(size):
    look = VideoOptions(size=size)
    assert (look.width, look.height) == (320, 240)


@pytest.mark.parametrize("size", ["", "640", "x480", "640x", "640x480x3", "-1x5", "6.5x3"])
def test_what_is_no_size(size):
    with pytest.raises(RenderError, match=r"such as 640x480, not '.*'"):
        VideoOptions(size=size)


def test_places_slow_down_and_end_at_the_last_state():
    assert VideoOptions(speed=0.5).places(3).tolist() == [0.0, 0.5, 1.0, 1.5, 2.0]
    assert VideoOptions(fps=25).places(5).tolist() == [0.0, 2.0, 4.0]
    fall = VideoOptions(fall=True).places(201)
    assert (fall[0], fall[-1], len(fall)) == (150.0, 200.0, 201)
