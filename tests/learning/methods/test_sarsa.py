"""SARSA by known answers."""

import numpy as np
import pytest

from nightly import few
from worlds import Cliff

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


@pytest.mark.parametrize(
    ("method", "episodes", "row", "off"),
    few(
        [
            ("q-learning", 500, 1, 0.01),
            ("sarsa", 500, 2, 2.5),
            ("sarsa", 2_000, 2, 1.0),
            ("expected-sarsa", 2_000, 2, 1.0),
        ],
        ("q-learning", 500, 1, 0.01),
        ("sarsa", 500, 2, 2.5),
    ),
)
def test_it_keeps_away_from_a_cliff_along_which_q_learning_goes(
    at_work, method, episodes, row, off
):
    cliff, common = Cliff(12, 4), {"gamma": 1.0, "alpha": 0.5, "alpha_final": 0.01}
    ways = {"td_lambda": None} if method == "q-learning" else {}
    for seed in (0, 1):
        q = at_work(
            np.zeros((cliff.n, 2)), method=method, episodes=episodes, seed=seed,
            epsilon=0.2, epsilon_final=0.2, **common, **ways,
        )  # fmt: skip
        played = q.play(cliff, episodes, seed)
        assert cliff.way(q.table) == [row] * 12
        # What is explored costs a fall now and then: Q-learning does not see that, SARSA does.
        values = cliff.values(0.0 if method == "q-learning" else 0.2)
        assert max(q.table[0]) == pytest.approx(values[0].max(), abs=off)
        returns = [sum(step[2] for step in steps) for steps in played[-100:]]
        assert (np.mean(returns) < -26.5) == (method == "q-learning")
