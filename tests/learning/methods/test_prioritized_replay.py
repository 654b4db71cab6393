"""Prioritized replay by known answers."""

import numpy as np
import pytest

from mjcartpole.errors import ConfigError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.methods.prioritized_replay import weight
from mjcartpole.learning.methods.sum_tree import find_leaf
from worlds import Walk

REPLAY = {"method": "prioritized-replay", "alpha": 0.5, "gamma": 0.9, "epsilon": 0.0, "replays": 1}
AT_RANDOM = {"epsilon": 1.0, "epsilon_final": 1.0}


def test_the_only_step_is_replayed_as_often_as_it_is_said(at_work):
    q = at_work([[1.0, 2.0], [3.0, 4.0]], **REPLAY | {"replays": 2})
    q.step(0, 1, 1.0, 1)
    # Half way from 2 to 1 + 0.9 · 4 = 4.6, twice.
    assert q.table == [[1.0, pytest.approx(3.95)], [3.0, 4.0]]


def test_a_terminated_step_has_no_future_and_a_truncated_one_has(at_work):
    for ending, value in (("terminated", 1.5), ("truncated", 3.3)):
        q = at_work([[1.0, 2.0], [3.0, 4.0]], **REPLAY)
        q.step(0, 1, 1.0, 1, **{ending: True})
        assert q.table[0] == [1.0, pytest.approx(value)]


def test_the_last_step_can_be_left_out(at_work):
    q = at_work([[1.0, 2.0], [3.0, 4.0]], **REPLAY, learn_last_step=False)
    q.step(0, 1, 1.0, 1, terminated=True)
    assert q.table == [[1.0, 2.0], [3.0, 4.0]] and q.memory.n_steps[0] == 0


def test_a_priority_is_that_of_the_last_error_and_a_new_step_has_the_largest(at_work):
    q = at_work([[0.0, 0.0]], **REPLAY | {"omega": 0.5, "floor": 0.25, "gamma": 0.0})
    q.step(0, 0, 6.0, 0, terminated=True)
    # The error was 6: the root of 6.25. The next step enters with it.
    assert q.memory.largest.tolist() == [2.5]
    assert q.memory.tree[q.memory.tree.size // 2] == 2.5
    q.step(0, 1, 0.0, 0, terminated=True)
    leaves = q.memory.tree[q.memory.tree.size // 2 :][:2].tolist()
    # One of both was replayed: the old one's error is 3 by now, the new one's 0.
    assert leaves in ([pytest.approx(3.25**0.5), 2.5], [2.5, 0.5])


def remembering(at_work, weights, **values):
    """Return a learner that remembers steps with these weights in the tree."""
    q = at_work([[0.0, 0.0]], **REPLAY | values)
    for i, priority in enumerate(weights):
        q.memory.largest[0] = priority
        q.method.remember(q.p, q.memory, q.transition(0, 0, float(i), 0))
    return q


def test_steps_are_drawn_by_their_priorities(at_work):
    found = np.zeros(3)
    q = remembering(at_work, [1.0, 2.0, 5.0])
    for _ in range(8_000):
        found[find_leaf(q.memory.tree, q.rng.random() * q.memory.tree[1], 3)] += 1
    # 5 standard deviations of at most 45.
    np.testing.assert_allclose(found, [1_000, 2_000, 5_000], atol=225)


def test_weights_undo_the_choice(at_work):
    q = remembering(at_work, [1.0, 3.0])
    # N P(i) is 2 · 1/4 and 2 · 3/4.
    for beta in (0.0, 0.5, 1.0):
        found = [weight(q.p, q.memory, i, beta) for i in (0, 1)]
        assert found == [pytest.approx(0.5**-beta), pytest.approx(1.5**-beta)]


def test_without_omega_all_are_alike(at_work):
    q = at_work([[0.0, 0.0]], **REPLAY | {"omega": 0.0, "replays": 8})
    for r in range(5):
        q.step(0, 0, float(r), 0)
    assert q.memory.tree[1] == 5.0 and weight(q.p, q.memory, 3, 1.0) == 1.0


def test_the_latest_steps_are_remembered(at_work):
    q = remembering(at_work, [1.0, 2.0, 5.0], replay_size=2)
    assert q.memory.rewards.tolist() == [2.0, 1.0]
    assert q.memory.tree.tolist() == [0.0, 7.0, 5.0, 2.0]


def test_beta_grows_to_1(at_work):
    q = at_work([[0.0, 0.0]], **REPLAY)
    for number, beta in ((0, 0.4), (10, 0.7), (20, 1.0)):
        q.begin(number)
        assert q.rates.beta == pytest.approx(beta)


@pytest.mark.parametrize("omega", [0.0, 0.6])
def test_a_walk_has_the_values_of_its_shortest_way(at_work, omega):
    q = at_work([[0.0, 0.0]] * 7, **REPLAY | AT_RANDOM, alpha_final=0.5, omega=omega)
    q.play(Walk(7), 60)
    right = [0.9 ** (6 - s) for s in range(7)]
    left = [0.0, *(0.9 * value for value in right[:-1])]
    np.testing.assert_allclose(q.table, np.transpose([left, right]), atol=0.01)


@pytest.mark.parametrize(("beta", "mean"), [(1.0, 0.25), (0.0, 1 / (1 + 3**0.5))])
def test_weights_bring_the_mean_back_that_priorities_shift(at_work, beta, mean):
    q = at_work([[0.3, 0.0]], **REPLAY | {"omega": 1.0, "floor": 1e-9})
    for r in (1.0, 0.0, 0.0, 0.0):
        q.method.remember(q.p, q.memory, q.transition(0, 0, r, 0, terminated=True))
    found = []
    for _ in range(4_000):
        i = find_leaf(q.memory.tree, q.rng.random() * q.memory.tree[1], 4)
        q.method.replay(q.p, q.memory, i, 0.01 * weight(q.p, q.memory, i, beta))
        found.append(q.q[0])
    # Drawn by its error and not weighted, the 1 holds against three zeros where
    # (1 - q)^2 = 3 q^2. A mean over 30 times 1 / 0.01 steps is known to about 0.006.
    assert np.mean(found[1_000:]) == pytest.approx(mean, abs=0.03)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"replay_size": 0}, "replay_size must be a whole number from 1 to 1,000,000, not 0"),
        ({"replays": 0.5}, "replays must be a whole number"),
        ({"omega": 2.0}, "omega must be a number from 0 to 1"),
        ({"beta": -0.1}, "beta must be"),
        ({"floor": 0}, "floor must be a number above 0"),
    ],
)
def test_values_that_make_no_sense(values, message):
    with pytest.raises(ConfigError, match=message):
        TrainConfig(method="prioritized-replay", **values)
