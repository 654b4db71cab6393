"""A window where there is a screen, a word where there is none."""

import os
import subprocess
import sys

import numpy as np
import pytest

from mjcartpole.media.window import NoWindow, ViewerWindow, open_window
from mjcartpole.physics.load import load_model

SCREEN = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")


def test_without_a_screen_it_says_so_and_goes_on(monkeypatch, caplog):
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    window = open_window(load_model())
    assert isinstance(window, NoWindow)
    assert "neither DISPLAY nor WAYLAND_DISPLAY is set" in caplog.text
    window.show(np.zeros(4))
    window.close()


@pytest.mark.long
@pytest.mark.skipif(sys.platform != "linux", reason="DISPLAY is X11's")
def test_a_display_that_does_not_answer_is_no_screen():
    code = (
        "import gymnasium, mjcartpole\n"
        "env = gymnasium.make('mjcartpole/CartPole-v1', render_mode='human')\n"
        "env.reset(seed=0); print(env.step(1)[1]); env.close()"
    )
    environment = {**os.environ, "DISPLAY": ":4711"}
    environment.pop("WAYLAND_DISPLAY", None)
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout) == (0, "1.0\n")
    assert done.stderr.count("\n") == 1
    assert "GLFW says 'X11: Failed to" in done.stderr


@pytest.mark.skipif(not SCREEN, reason="needs a screen; none here (DISPLAY is not set)")
def test_with_a_screen_it_opens():
    window = open_window(load_model())
    assert isinstance(window, ViewerWindow)
    window.show(np.array([0.0, 0.0, 0.1, 0.0]))
    window.close()
