"""A softmax policy: its probabilities, its gradient, and what may be asked of it."""

import math

import numpy as np
import pytest

from mjcartpole.errors import ConfigError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.methods.preferences import prefer_right, probability_of_right

METHODS = ["reinforce", "actor-critic"]


@pytest.mark.parametrize(("left", "right"), [(0.0, 0.0), (1.0, 3.0), (2.0, -1.5), (-4.0, -4.1)])
def test_the_probability_is_the_softmax(left, right):
    expected = math.exp(right) / (math.exp(left) + math.exp(right))
    assert probability_of_right([9.0, 9.0, left, right], 1) == pytest.approx(expected, rel=1e-15)


def test_however_far_apart_preferences_are_it_is_a_probability():
    assert [probability_of_right([0.0, h], 0) for h in (-1e308, -800.0, 800.0, 1e308)] == [
        *(0.0, pytest.approx(0.0, abs=1e-300)),
        *(1.0, 1.0),
    ]


@pytest.mark.parametrize("a", [0, 1])
def test_the_gradient_is_that_of_the_logarithm(a):
    def logarithm(*h):
        right = probability_of_right(h, 0)
        return math.log(right if a == 1 else 1 - right)

    h, small, found = [0.7, -0.4], 1e-6, [0.0, 0.0]
    prefer_right(found, 0, a - probability_of_right(h, 0))
    for each, step in enumerate(np.eye(2) * small):
        slope = (logarithm(*(h + step)) - logarithm(*(h - step))) / (2 * small)
        assert found[each] == pytest.approx(slope, abs=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_actions_are_drawn_by_it(at_work, method):
    q = at_work([[0.0, 0.0], [0.0, math.log(3.0)]], method=method)
    # 5 standard deviations of 0.0061 around 3/4.
    assert np.mean([q.act(1) for _ in range(5_000)]) == pytest.approx(0.75, abs=0.031)
    assert q.greedy_values.tolist() == q.table


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("name", "value"),
    [("alpha", -0.1), ("alpha_values_final", 2), ("gamma", 1.1), ("v_init", math.inf)],
)
def test_values_that_make_no_sense(method, name, value):
    with pytest.raises(ConfigError, match=f"{name} must be"):
        TrainConfig(method=method, **{name: value})
