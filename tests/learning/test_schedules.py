"""Numbers that change as training goes on."""

import pytest

from mjcartpole.learning.schedules import linear


@pytest.mark.parametrize(
    ("episode", "value"), [(0, 1.0), (25, 0.775), (50, 0.55), (99, 0.109), (100, 0.1), (10**6, 0.1)]
)
def test_a_straight_line_and_then_constant(episode, value):
    assert linear(1.0, 0.1, 100, episode) == pytest.approx(value, rel=1e-12)


def test_no_slope_means_the_end_at_once():
    assert linear(1.0, 0.1, 0, 0) == 0.1


def test_the_ends_are_exact():
    assert [linear(0.3, 0.01, 1000, episode) for episode in (0, 1000)] == [0.3, 0.01]


def test_a_slope_of_part_of_an_episode_has_its_start():
    assert [linear(1.0, 0.1, 0.5, episode) for episode in (0, 1)] == [1.0, 0.1]


def test_whole_numbers_are_numbers():
    assert [linear(1, 0, 4, episode) for episode in range(6)] == [1, 0.75, 0.5, 0.25, 0, 0]
