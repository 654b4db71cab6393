"""Numbers that change as training goes on."""

import pytest

from mjcartpole.learning.schedules import LinearSchedule


@pytest.mark.parametrize(
    ("episode", "value"), [(0, 1.0), (25, 0.775), (50, 0.55), (99, 0.109), (100, 0.1), (10**6, 0.1)]
)
def test_a_straight_line_and_then_constant(episode, value):
    assert LinearSchedule(1.0, 0.1, 100)(episode) == pytest.approx(value, rel=1e-12)


def test_no_slope_means_the_end_at_once():
    assert LinearSchedule(1.0, 0.1, 0)(0) == 0.1


def test_the_ends_are_exact():
    schedule = LinearSchedule(0.3, 0.01, 1000)
    assert (schedule(0), schedule(1000)) == (0.3, 0.01)
