"""A window where there is a screen, a word where there is none."""

import os

import numpy as np
import pytest

from mjcartpole.media.window import NoWindow, ViewerWindow, open_window
from mjcartpole.physics.model import load_model

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


@pytest.mark.skipif(not SCREEN, reason="needs a screen; none here (DISPLAY is not set)")
def test_with_a_screen_it_opens():
    window = open_window(load_model())
    assert isinstance(window, ViewerWindow)
    window.show(np.array([0.0, 0.0, 0.1, 0.0]))
    window.close()
