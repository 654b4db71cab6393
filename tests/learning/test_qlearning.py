"""The update and the choice, by known answers."""

import numpy as np
import pytest

from mjcartpole.learning.qlearning import TabularQ, choose, learn_episode, learn_step
from mjcartpole.learning.schedules import LinearSchedule


def learner(table, *, alpha=0.5, epsilon=0.0, gamma=0.9, ties="first", seed=0, lam=None):
    return TabularQ(
        np.array(table, dtype=np.float64),
        gamma=gamma,
        alpha=LinearSchedule(alpha, 0.0, 10),
        epsilon=LinearSchedule(epsilon, 0.0, 10),
        ties=ties,
        learn_last_step=True,
        td_lambda=lam,
        rng=np.random.default_rng(seed),
    )


def test_one_update():
    q = learner([[1.0, 2.0], [3.0, 4.0]])
    q.update(0, 1, 1.0, 1, terminated=False)
    # 2 + 0.5 (1 + 0.9 · 4 - 2) = 3.3
    assert q.q_table.tolist() == [[1.0, pytest.approx(3.3)], [3.0, 4.0]]


def test_a_terminated_step_has_no_future():
    q = learner([[1.0, 2.0], [3.0, 4.0]])
    q.update(0, 1, 1.0, 1, terminated=True)
    assert q.q_table[0, 1] == 1.5


def test_greedy_takes_the_better_action_and_the_first_of_equals():
    q = learner([[1.0, 2.0], [2.0, 1.0], [1.0, 1.0]])
    assert [q.act(s) for s in (0, 1, 2)] == [1, 0, 0]


def test_random_ties_are_drawn_from_the_learners_own_generator():
    def draw(seed):
        q = learner([[1.0, 1.0]], ties="random", seed=seed)
        return [q.act(0) for _ in range(200)]

    assert 60 < sum(draw(0)) < 140
    assert draw(0) == draw(0) != draw(1)


def test_exploration_has_the_probability_of_epsilon():
    q = learner([[0.0, 1.0]], epsilon=0.5)
    share = np.mean([q.act(0) == 0 for _ in range(20_000)])
    # A random action is the worse one half of the time; 5 standard deviations of 0.0031.
    assert abs(share - 0.25) < 0.016


def test_schedules_follow_the_episode():
    q = learner([[0.0, 0.0]], alpha=0.5, epsilon=1.0)
    q.begin_episode(5)
    assert (q.alpha, q.epsilon) == (0.25, 0.5)
    q.begin_episode(50)
    assert (q.alpha, q.epsilon) == (0.0, 0.0)


def test_an_episode_is_learned_backwards_from_lambda_returns():
    q = learner([[0.0, 0.0], [0.0, 10.0], [4.0, 2.0]], lam=0.5)
    q.replay([0, 1, 2], [0, 1], [1.0, 1.0], over=False)
    # The last step: G = 1 + 0.9 · 4 = 4.6 moves 10 half way, to 7.3. The first:
    # G = 1 + 0.9 (0.5 · 7.3 + 0.5 · 4.6) = 6.355, half way from 0.
    assert q.q_table.tolist() == [
        [pytest.approx(3.1775), 0.0],
        [0.0, pytest.approx(7.3)],
        [4.0, 2.0],
    ]


def test_nothing_comes_after_a_terminated_episode():
    q = learner([[0.0, 0.0], [0.0, 0.0], [4.0, 2.0]], alpha=1.0, lam=1.0)
    q.replay([0, 1, 2], [0, 1], [1.0, 1.0], over=True)
    assert q.q_table.tolist() == [[1.9, 0.0], [0.0, 1.0], [4.0, 2.0]]


def test_lambda_0_is_one_step_learning_in_reverse_order():
    table = np.random.default_rng(3).normal(size=(4, 2)).tolist()
    replayed, stepped = learner(table, lam=0.0), learner(table)
    states, actions, rewards = [0, 2, 1, 3], [1, 0, 1], [1.0, 0.5, 1.0]
    replayed.replay(states, actions, rewards, over=True)
    for t in (2, 1, 0):
        stepped.update(states[t], actions[t], rewards[t], states[t + 1], terminated=t == 2)
    np.testing.assert_allclose(replayed.q_table, stepped.q_table, rtol=1e-14)


class Counting:
    """Stands in for a generator: gives what it is told to, and counts."""

    def __init__(self, *values):
        self.values = list(values)

    def random(self):
        return self.values.pop(0)


@pytest.mark.parametrize(
    ("draws", "epsilon", "draw_ties", "action"),
    [
        ((0.5,), 0.5, True, 1),  # as large as epsilon is not below it
        ((0.49, 0.49), 0.5, True, 0),
        ((0.49, 0.5), 0.5, True, 1),
        ((0.0,), 0.0, True, 1),
    ],
)
def test_one_number_is_drawn_and_one_more_for_a_random_action(draws, epsilon, draw_ties, action):
    rng = Counting(*draws)
    assert choose([9.0, 9.0, 1.0, 2.0], 1, epsilon, draw_ties, rng) == action
    assert rng.values == []


@pytest.mark.parametrize(
    ("draw_ties", "draws", "action"),
    [(False, (0.9,), 0), (True, (0.9, 0.2), 0), (True, (0.9, 0.7), 1)],
)
def test_a_tie_is_drawn_where_that_is_asked_for(draw_ties, draws, action):
    rng = Counting(*draws)
    assert choose([0.0, 1.0, 3.0, 3.0], 1, 0.1, draw_ties, rng) == action
    assert rng.values == []


def test_the_table_is_changed_in_place():
    table = np.array([[1.0, 2.0], [3.0, 4.0]])
    q = learner(table)
    assert q.q_table is not table, "the helper copies"
    before = q.q_table
    q.update(1, 0, 1.0, 0, terminated=True)
    assert q.q_table is before
    assert before[1, 0] == 2.0


def test_the_functions_are_what_the_learner_does():
    table = np.random.default_rng(1).normal(size=(3, 2))
    q, flat = learner(table), table.reshape(-1).copy()
    q.update(0, 1, 1.0, 2, terminated=False)
    learn_step(flat, 0, 1, 1.0, 2, False, 0.5, 0.9)
    assert q.q_table.tobytes() == flat.tobytes()
    q = learner(flat.reshape(3, 2), lam=0.3)
    q.replay([0, 1, 2], [1, 0], [1.0, 1.0], over=False)
    learn_episode(flat, [0, 1, 2, 99], [1, 0, 99], [1.0, 1.0, 99.0], 2, False, 0.5, 0.9, 0.3)
    assert q.q_table.tobytes() == flat.tobytes(), "what lies beyond its steps is not looked at"


def test_an_episode_without_steps_teaches_nothing():
    q = learner([[1.0, 2.0]], lam=0.9)
    q.replay([0], [], [], over=False)
    assert q.q_table.tolist() == [[1.0, 2.0]]
