"""Prioritized sweeping by known answers, and against value iteration on matrices."""

import numpy as np
import pytest

from mjcartpole.errors import ConfigError
from mjcartpole.learning.config import TrainConfig
from worlds import Slippery, Walk, best_values, counted

SWEEPING = {"method": "prioritized-sweeping", "gamma": 0.9, "epsilon": 0.0}
AT_RANDOM = {"epsilon": 1.0, "epsilon_final": 1.0}


def test_what_happened_at_the_end_reaches_the_beginning_at_once(at_work):
    q = at_work([[0.0, 0.0]] * 4, **SWEEPING)
    for s in range(3):
        q.step(s, 0, 0.0, s + 1)
    q.step(3, 1, 1.0, 0, terminated=True)
    values = [0.9**3, 0.9**2, 0.9]
    assert q.table == [*([pytest.approx(value), 0.0] for value in values), [0.0, 1.0]]


def test_the_most_outdated_comes_first(at_work):
    q = at_work([[0.0, 0.0]] * 4, **SWEEPING, planning=1)
    # States 0 and 1 lead to 2 and 3, which are found to be worth 1 and 5.
    for s in (0, 1):
        q.step(s, 0, 0.0, s + 2)
    q.step(2, 0, 1.0, 2, terminated=True)
    q.step(3, 0, 5.0, 3, terminated=True)
    assert q.table == [[0.0, 0.0], [0.0, 0.0], [1.0, 0.0], [5.0, 0.0]]
    assert q.memory.heap[:2].tolist() == [2, 0]
    assert q.memory.priority[[2, 0]].tolist() == [4.5, 0.9]
    q.step(3, 0, 5.0, 3, terminated=True)
    assert q.table[:2] == [[0.0, 0.0], [4.5, 0.0]]


def test_small_changes_are_left(at_work):
    q = at_work([[0.0, 0.0]] * 2, **SWEEPING, threshold=1.0)
    q.step(0, 0, 1.0, 1)
    assert q.table[0] == [0.0, 0.0] and q.memory.n_queued[0] == 0
    q.step(0, 0, 1.5, 1)
    assert q.table[0] == [1.25, 0.0]


def test_a_truncated_step_goes_on_and_the_last_one_can_be_left_out(at_work):
    q = at_work([[1.0, 2.0], [3.0, 4.0]], **SWEEPING)
    q.step(0, 1, 1.0, 1, truncated=True)
    assert q.table[0] == [1.0, pytest.approx(4.6)]
    q = at_work([[1.0, 2.0], [3.0, 4.0]], **SWEEPING, learn_last_step=False)
    q.step(0, 1, 1.0, 1, terminated=True)
    assert q.table == [[1.0, 2.0], [3.0, 4.0]]


def test_a_walk_has_the_values_of_its_shortest_way(at_work):
    q = at_work([[0.0, 0.0]] * 7, **SWEEPING | AT_RANDOM)
    q.play(Walk(7), 30)
    right = [0.9 ** (6 - s) for s in range(7)]
    left = [0.0, *(0.9 * value for value in right[:-1])]
    np.testing.assert_allclose(q.table, np.transpose([left, right]), atol=0.01)


@pytest.mark.parametrize(("order", "planning"), [("priority", 5_000), ("random", 400)])
def test_it_is_value_iteration_on_the_matrices_of_what_was_seen(at_work, order, planning):
    settings = {"order": order, "planning": planning, "threshold": 0.001}
    q = at_work([[0.0, 0.0]] * 4, **SWEEPING | AT_RANDOM | settings)
    played = q.play(Slippery(4), 6)
    expected = best_values(*counted(played, 4), 0.9)
    # With an empty queue none is out of date by more than 0.001: within 1 / (1 - gamma) times that.
    # 400 random updates are some 50 of each pair: 0.9^50 of what the last step changed is left.
    np.testing.assert_allclose(q.table, expected, atol=0.01)
    assert q.memory.n_queued[0] == 0


def test_a_full_list_of_predecessors_takes_no_more(at_work):
    q = at_work([[0.0, 0.0]] * 5, **SWEEPING, predecessors=2)
    for s in range(1, 5):
        q.step(s, 0, 0.0, 0)
        q.step(s, 0, 0.0, 0)
    assert q.memory.n_predecessors[0] == 2
    assert q.memory.predecessors[:4].tolist() == [2, 4, 0, 0]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"planning": 0}, "planning must be a whole number from 1 to"),
        ({"predecessors": 0}, "predecessors must be a whole number from 1 to"),
        ({"threshold": -1.0}, "threshold must be a number above 0"),
        ({"order": "any"}, "order must be 'priority' or 'random', not 'any'"),
        ({"tilings": 4}, "method 'prioritized-sweeping' has no tilings; available: "),
    ],
)
def test_values_that_make_no_sense(values, message):
    with pytest.raises(ConfigError, match=message):
        TrainConfig(method="prioritized-sweeping", **values)


def test_lists_that_are_too_large_are_refused(at_work):
    with pytest.raises(ConfigError, match=r"5 states with 900000 predecessors each .* give fewer"):
        at_work([[0.0, 0.0]] * 5, **SWEEPING, predecessors=900_000)
