"""Expected SARSA by known answers."""

import pytest

HALF = {"method": "expected-sarsa", "alpha": 0.5, "gamma": 0.9, "epsilon": 0.5}


def test_one_update_uses_the_mean_over_the_next_action(at_work):
    q = at_work([[1.0, 2.0], [3.0, 4.0]], **HALF)
    q.step(0, 1, 1.0, 1)
    # The better action has 0.75 of the probability: 0.75 · 4 + 0.25 · 3 = 3.75.
    assert q.table[0] == [1.0, pytest.approx(2 + 0.5 * (1 + 0.9 * 3.75 - 2))]


def test_without_exploration_it_is_q_learning(at_work):
    table = [[1.0, 2.0], [3.0, 4.0]]
    ours = at_work(table, **HALF | {"epsilon": 0.0})
    theirs = at_work(table, alpha=0.5, gamma=0.9, epsilon=0.0, td_lambda=None)
    for q in (ours, theirs):
        q.step(0, 1, 1.0, 1)
        q.step(1, 0, 0.5, 0, truncated=True)
    assert ours.table == theirs.table


def test_a_terminated_step_has_no_future(at_work):
    q = at_work([[1.0, 2.0], [3.0, 4.0]], **HALF)
    q.step(0, 1, 1.0, 1, terminated=True)
    assert q.table[0] == [1.0, 1.5]


def test_the_last_step_can_be_left_out(at_work):
    q = at_work([[1.0, 2.0], [3.0, 4.0]], **HALF, learn_last_step=False)
    q.step(0, 1, 1.0, 1, terminated=True)
    assert q.table == [[1.0, 2.0], [3.0, 4.0]]
