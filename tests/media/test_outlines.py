"""Geometry in the plane: hulls."""

import math

import numpy as np
import pytest

from mjcartpole.media.outlines import convex_hull


def test_the_convex_hull_of_points():
    square = [(0, 0), (2, 0), (2, 2), (0, 2)]
    inside = [(1, 1), (0.5, 1.5), (1, 0), (2, 1)]
    hull = convex_hull(np.array(square + inside, float))
    assert sorted(map(tuple, hull.tolist())) == sorted(square)


def test_the_convex_hull_of_very_many_points_loses_little():
    turn = np.linspace(0, 2 * np.pi, 5000)
    hull = convex_hull(np.column_stack([np.cos(turn), np.sin(turn)]))
    x, y = hull.T
    area = abs(np.dot(x, np.roll(y, 1)) - np.dot(y, np.roll(x, 1))) / 2
    assert area == pytest.approx(math.pi, rel=0.01)


def test_the_convex_hull_of_hardly_any_points():
    assert len(convex_hull(np.array([(1.0, 2.0)]))) >= 1
    line = convex_hull(np.array([(0.0, 0.0), (1.0, 1.0), (2.0, 2.0)]))
    assert {tuple(corner) for corner in line.tolist()} == {(0.0, 0.0), (2.0, 2.0)}
