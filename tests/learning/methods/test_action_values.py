"""What methods with a table of action values share: how they choose."""

import numpy as np
import pytest

from mjcartpole.errors import ConfigError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.methods import q_learning
from mjcartpole.learning.methods.action_values import choose, draw_table
from mjcartpole.learning.methods.parameters import numbers_of


def test_greedy_takes_the_better_action_and_the_first_of_equals(at_work):
    q = at_work([[1.0, 2.0], [2.0, 1.0], [1.0, 1.0]], epsilon=0.0)
    assert [q.act(s) for s in (0, 1, 2)] == [1, 0, 0]


def test_random_ties_are_drawn_from_the_learners_own_generator(at_work):
    def draw(seed):
        q = at_work([[1.0, 1.0]], ties="random", epsilon=0.0, seed=seed)
        return [q.act(0) for _ in range(200)]

    assert 60 < sum(draw(0)) < 140
    assert draw(0) == draw(0) != draw(1)


def test_exploration_has_the_probability_of_epsilon(at_work):
    q = at_work([[0.0, 1.0]], epsilon=0.5)
    share = np.mean([q.act(0) == 0 for _ in range(20_000)])
    # A random action is the worse one half of the time; 5 standard deviations of 0.0031.
    assert abs(share - 0.25) < 0.016


def numbers(ties="first", **values):
    return numbers_of(TrainConfig(ties=ties, **values), q_learning.Numbers)


class Counting:
    """Stands in for a generator: gives what it is told to, and counts."""

    def __init__(self, *values):
        self.values = list(values)

    def random(self):
        return self.values.pop(0)


@pytest.mark.parametrize(
    ("draws", "epsilon", "action"),
    [
        ((0.5,), 0.5, 1),  # as large as epsilon is not below it
        ((0.49, 0.49), 0.5, 0),
        ((0.49, 0.5), 0.5, 1),
        ((0.0,), 0.0, 1),
    ],
)
def test_one_number_is_drawn_and_one_more_for_a_random_action(draws, epsilon, action):
    rng = Counting(*draws)
    assert choose(numbers("random"), [9.0, 9.0, 1.0, 2.0], 1, epsilon, rng) == action
    assert rng.values == []


@pytest.mark.parametrize(
    ("ties", "draws", "action"),
    [("first", (0.9,), 0), ("random", (0.9, 0.2), 0), ("random", (0.9, 0.7), 1)],
)
def test_a_tie_is_drawn_where_that_is_asked_for(ties, draws, action):
    rng = Counting(*draws)
    assert choose(numbers(ties), [0.0, 1.0, 3.0, 3.0], 1, 0.1, rng) == action
    assert rng.values == []


@pytest.mark.parametrize("method", ["q-learning", "sarsa", "expected-sarsa"])
@pytest.mark.parametrize(("name", "value"), [("alpha", -0.1), ("gamma", 1.1), ("ties", "last")])
def test_values_that_make_no_sense(method, name, value):
    with pytest.raises(ConfigError, match=f"{name} must be"):
        TrainConfig(method=method, **{name: value})


def test_a_first_table_of_nothing_but_zeros_has_no_wrong_sign():
    table = draw_table(numbers(q_init_low=0.0, q_init_high=-0.0), 3, np.random.default_rng(0))
    assert table.tolist() == [0.0] * 6
