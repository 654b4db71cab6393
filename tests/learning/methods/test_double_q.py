"""Double Q-learning by known answers."""

import copy

import numpy as np
import pytest

from worlds import Lure, Walk

HALF = {"method": "double-q", "alpha": 0.5, "gamma": 0.9, "epsilon": 0.0}
FIRST, SECOND = [[1.0, 2.0], [3.0, 4.0]], [[0.0, 5.0], [7.0, 6.0]]


def two_tables(at_work, second=SECOND, **values):
    q = at_work(FIRST, **HALF | values)
    q.memory.second[:] = np.ravel(second)
    return q


def test_a_coin_decides_which_table_learns_what_the_other_thinks_of_its_choice(at_work):
    learned = set()
    for seed in range(12):
        q = two_tables(at_work, seed=seed)
        q.step(0, 1, 1.0, 1)
        learned.add((round(q.q[1], 9), round(q.memory.second[1], 9)))
    # The first prefers action 1, of which the second thinks 6: half way from 2 to 1 + 0.9 · 6.
    # The second prefers action 0, of which the first thinks 3: half way from 5 to 1 + 0.9 · 3.
    assert learned == {(4.2, 5.0), (2.0, 4.35)}


@pytest.mark.parametrize(("ending", "target"), [("terminated", 1.0), ("truncated", 6.4)])
def test_a_terminated_step_has_no_future_and_a_truncated_one_has(at_work, ending, target):
    q = two_tables(at_work, FIRST)
    q.memory.second[3] = q.q[3] = 6.0
    q.step(0, 1, 1.0, 1, **{ending: True})
    assert q.q[1] + q.memory.second[1] == pytest.approx(2 + (2 + target) / 2)


def test_the_last_step_can_be_left_out(at_work):
    q = two_tables(at_work, learn_last_step=False)
    q.step(0, 1, 1.0, 1, terminated=True)
    assert (q.table, q.memory.second.tolist()) == (FIRST, np.ravel(SECOND).tolist())


def test_it_acts_by_the_mean_of_both(at_work):
    q = two_tables(at_work)
    assert q.greedy_values.tolist() == [[0.5, 3.5], [5.0, 5.0]]
    assert [q.act(0), q.act(1)] == [1, 0]
    assert two_tables(at_work, [[4.0, 0.0], [0.0, 0.0]]).act(0) == 0


def by_the_book(tables, steps, coins, alpha, gamma):
    """Learn as section 6.7 says."""
    for (s, a, r, s_next, terminated), second in zip(steps, coins, strict=True):
        mine, other = tables[::-1] if second else tables
        future = 0.0 if terminated else other[s_next][int(np.argmax(mine[s_next]))]
        mine[s][a] = (1 - alpha) * mine[s][a] + alpha * (r + gamma * future)


def test_it_learns_what_the_book_says(at_work):
    steady = {"alpha_final": 0.5, "epsilon": 0.7, "epsilon_final": 0.7}
    tables = np.random.default_rng(5).normal(size=(2, 7, 2))
    q = at_work(tables[0], **HALF | steady)
    q.memory.second[:] = tables[1].ravel()
    coins, after_step = [], q.step

    def step(*transition, **ending):
        coins.append(copy.deepcopy(q.rng).random() < 0.5)
        after_step(*transition, **ending)

    q.step = step
    steps = [each for episode in q.play(Walk(7), 30) for each in episode]
    by_the_book(tables, steps, coins, 0.5, 0.9)
    np.testing.assert_allclose([q.q, q.memory.second], tables.reshape(2, -1), atol=1e-12)


def test_luck_is_not_taken_for_value(at_work):
    """The way into noise is worth -0.1; Q-learning takes the luckier action's value for it.

    Its two values there scatter by sqrt(alpha / (2 - alpha)) = 1/3, and of two such the larger is
    1/3 / sqrt(pi) = 0.19 above their mean.
    """
    values = {"alpha": 0.2, "alpha_final": 0.2, "gamma": 1.0, "epsilon_final": 1.0}
    found = []
    for method in ({"method": "q-learning", "td_lambda": None}, {"method": "double-q"}):
        q, seen = at_work([[0.0, 0.0]] * 2, **values, **method), []
        for seed in range(300):
            q.play(Lure(), 20, seed)
            seen.append(q.greedy_values[0, 0])
        found.append(np.mean(seen[20:]))
    assert found == [pytest.approx(0.09, abs=0.06), pytest.approx(-0.1, abs=0.06)]
