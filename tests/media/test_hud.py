"""The strip of text: what it writes fits."""

import math

import numpy as np
import pytest

from mjcartpole.media.hud import Moment, Strip, _in_five_signs


@pytest.mark.parametrize(
    ("total", "text"),
    [
        (0.0, "0"),
        (500.0, "500"),
        (10_000.0, "10000"),
        (2.5, "2.5"),
        (2.40571, "2.41"),
        (184.273, "184.3"),
        (-62.418, "-62.4"),
        (-1234.56, "-1235"),
        (123_456.7, "123457"),
    ],
)
def test_a_return_fits_its_field(total, text):
    assert _in_five_signs(total) == text


def test_an_angle_counts_from_minus_180_to_180_degrees():
    strip, other = Strip(640, 480), Strip(640, 480)
    shown = strip.show(Moment(0, 0.0, (0.0, 0.0, 1.0, 0.0))).copy()
    turned = other.show(Moment(0, 0.0, (0.0, 0.0, 1.0 + 2 * math.pi, 0.0)))
    np.testing.assert_array_equal(shown, turned)
