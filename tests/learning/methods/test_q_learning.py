"""Q-learning by known answers."""

import numpy as np
import pytest

STEPWISE = {"alpha": 0.5, "gamma": 0.9, "epsilon": 0.0, "td_lambda": None}


def test_one_update(at_work):
    q = at_work([[1.0, 2.0], [3.0, 4.0]], **STEPWISE)
    q.step(0, 1, 1.0, 1)
    # 2 + 0.5 (1 + 0.9 · 4 - 2) = 3.3
    assert q.table == [[1.0, pytest.approx(3.3)], [3.0, 4.0]]


def test_a_terminated_step_has_no_future_and_a_truncated_one_has(at_work):
    q = at_work([[1.0, 2.0], [3.0, 4.0]], **STEPWISE)
    q.step(0, 1, 1.0, 1, terminated=True)
    q.step(0, 0, 1.0, 1, truncated=True)
    assert q.table[0] == [pytest.approx(2.8), 1.5]


def test_the_last_step_can_be_left_out(at_work):
    for lam in (None, 0.9):
        q = at_work(
            [[1.0, 2.0], [3.0, 4.0]], **STEPWISE | {"td_lambda": lam}, learn_last_step=False
        )
        q.step(0, 1, 1.0, 1, terminated=True)
        q.replay([0, 1], [1], [1.0], terminated=True)
        assert q.table == [[1.0, 2.0], [3.0, 4.0]]


def test_schedules_follow_the_episode(at_work):
    q = at_work([[0.0, 0.0]], alpha=0.5, epsilon=1.0, decay=0.5)
    for number, rates in ((0, (0.5, 1.0)), (5, (0.25, 0.5)), (50, (0.0, 0.0))):
        q.begin(number)
        assert q.rates == rates


def test_an_episode_is_learned_backwards_from_lambda_returns(at_work):
    q = at_work([[0.0, 0.0], [0.0, 10.0], [4.0, 2.0]], **STEPWISE | {"td_lambda": 0.5})
    q.step(0, 0, 1.0, 1)
    q.replay([0, 1, 2, 99], [0, 1], [1.0, 1.0], terminated=False)
    # The last step: G = 1 + 0.9 · 4 = 4.6 moves 10 half way, to 7.3. The first:
    # G = 1 + 0.9 (0.5 · 7.3 + 0.5 · 4.6) = 6.355, half way from 0.
    assert q.table == [[pytest.approx(3.1775), 0.0], [0.0, pytest.approx(7.3)], [4.0, 2.0]]


def test_nothing_comes_after_a_terminated_episode(at_work):
    q = at_work([[0.0, 0.0], [0.0, 0.0], [4.0, 2.0]], alpha=1.0, gamma=0.9, td_lambda=1.0)
    q.replay([0, 1, 2], [0, 1], [1.0, 1.0], terminated=True)
    assert q.table == [[1.9, 0.0], [0.0, 1.0], [4.0, 2.0]]


def test_lambda_0_is_one_step_learning_in_reverse_order(at_work):
    table = np.random.default_rng(3).normal(size=(4, 2)).tolist()
    replayed, stepped = at_work(table, **STEPWISE | {"td_lambda": 0.0}), at_work(table, **STEPWISE)
    states, actions, rewards = [0, 2, 1, 3], [1, 0, 1], [1.0, 0.5, 1.0]
    replayed.replay(states, actions, rewards, terminated=True)
    for t in (2, 1, 0):
        stepped.step(states[t], actions[t], rewards[t], states[t + 1], terminated=t == 2)
    np.testing.assert_allclose(replayed.table, stepped.table, rtol=1e-14)
