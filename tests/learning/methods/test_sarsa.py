"""SARSA by known answers."""

import pytest

GREEDY = {"method": "sarsa", "alpha": 0.5, "gamma": 0.9, "epsilon": 0.0}


def test_one_update_uses_the_action_that_is_taken_next(at_work):
    q = at_work([[1.0, 2.0], [3.0, 4.0]], **GREEDY)
    q.step(0, 1, 1.0, 1)
    assert q.table == [[1.0, pytest.approx(3.3)], [3.0, 4.0]]
    assert q.memory.next_action.tolist() == [1]
    assert q.act(1) == 1


def test_an_exploring_action_is_what_it_learns_from(at_work):
    for seed in range(8):
        q = at_work([[0.0, 0.0], [3.0, 5.0]], **GREEDY | {"epsilon": 1.0, "alpha": 1.0}, seed=seed)
        q.step(0, 0, 1.0, 1)
        taken = q.act(1)
        assert q.table[0][0] == pytest.approx(1.0 + 0.9 * [3.0, 5.0][taken])


def test_an_episode_that_is_over_leaves_no_action(at_work):
    for ending in ({"terminated": True}, {"truncated": True}):
        q = at_work([[1.0, 2.0], [3.0, 4.0]], **GREEDY)
        q.step(0, 0, 1.0, 1)
        q.step(1, 1, 1.0, 0, **ending)
        assert q.memory.next_action.tolist() == [-1]


def test_a_terminated_step_has_no_future_and_a_truncated_one_has(at_work):
    q = at_work([[1.0, 2.0], [3.0, 4.0]], **GREEDY)
    q.step(0, 1, 1.0, 1, terminated=True)
    q.step(0, 0, 1.0, 1, truncated=True)
    assert q.table[0] == [pytest.approx(2.8), 1.5]


def test_the_last_step_can_be_left_out(at_work):
    q = at_work([[1.0, 2.0], [3.0, 4.0]], **GREEDY, learn_last_step=False)
    q.step(0, 1, 1.0, 1, terminated=True)
    assert q.table == [[1.0, 2.0], [3.0, 4.0]]
