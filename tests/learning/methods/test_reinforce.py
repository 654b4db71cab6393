"""REINFORCE by known answers."""

import math

import numpy as np
import pytest

from worlds import Corridor, Walk

STEADY = {"method": "reinforce", "decay": 0.0}


def test_one_episode(at_work):
    q = at_work([[0.0, 0.0]] * 3, **STEADY, alpha_final=0.5, alpha_values_final=0.1, gamma=0.5)
    q.memory.state_values[:] = (1.0, 2.0, 8.0)
    q.step(0, 1, 1.0, 1)
    assert q.table == [[0.0, 0.0]] * 3
    q.replay([0, 1, 2, 99], [1, 0], [1.0, 3.0], terminated=True)
    # G = 3 is 1 more than 2 was worth, and G = 1 + 0.5 · 3 = 2.5 is 1.5 more than 1; both actions
    # were as likely, so action 0 gains 0.5 · 1 · 0.5 there, and action 1 0.5 · 1.5 · 0.5 here.
    assert q.table == [[-0.375, 0.375], [0.25, -0.25], [0.0, 0.0]]
    assert q.memory.state_values.tolist() == [pytest.approx(1.15), pytest.approx(2.1), 8.0]


def test_a_truncated_episode_would_have_gone_on(at_work):
    q = at_work([[0.0, 0.0]] * 2, **STEADY, alpha_final=1.0, alpha_values_final=0.5, gamma=0.5)
    q.memory.state_values[:] = (1.0, 4.0)
    q.replay([0, 1], [1], [1.0], terminated=False)
    assert q.memory.state_values.tolist() == [2.0, 4.0]  # half way from 1 to 1 + 0.5 · 4


def by_the_book(h, v, episodes, alpha, alpha_values, gamma):
    """Learn as section 13.4 says, without gamma^t, and the last step first."""
    for steps in episodes:
        for t in reversed(range(len(steps))):
            s, a = steps[t][:2]
            total = sum(gamma ** (k - t) * steps[k][2] for k in range(t, len(steps)))
            advantage = total - v[s]
            v[s] += alpha_values * advantage
            softmax = np.exp(h[s]) / np.exp(h[s]).sum()
            h[s] += alpha * advantage * (np.eye(2)[a] - softmax)


def test_it_learns_what_the_book_says(at_work):
    h, v = np.random.default_rng(3).normal(size=(7, 2)), np.full(7, 0.3)
    q = at_work(h, **STEADY, alpha_final=0.3, alpha_values_final=0.2, gamma=0.9, v_init=0.3)
    by_the_book(h, v, q.play(Walk(7), 60), 0.3, 0.2, 0.9)
    np.testing.assert_allclose(q.table, h, atol=1e-12)
    np.testing.assert_allclose(q.memory.state_values, v, atol=1e-12)


def test_on_average_it_goes_along_the_gradient(at_work):
    """Of the start's value, whatever the baseline: Williams's theorem."""
    world, p, tiny, episodes = Corridor(), 0.3, 1e-9, 3_000
    steady = {"alpha_values_final": 0.0, "gamma": 1.0, "v_init": -12.0}
    q = at_work([[0.0, math.log(p / (1 - p))]], **STEADY, alpha_final=tiny, **steady)
    before, moved = q.q[1], []
    for seed in range(episodes):
        q.play(world, 1, seed)
        moved.append((q.q[1] - before) / tiny)
        before = q.q[1]
    slope = (world.value(p + 1e-6) - world.value(p - 1e-6)) / 2e-6 * p * (1 - p)
    error = np.std(moved) / math.sqrt(episodes)
    assert np.mean(moved) == pytest.approx(slope, abs=4 * error)
    assert slope > 8 * error


def test_it_finds_the_best_policy_of_a_corridor_that_looks_alike(at_work):
    steady = {"alpha": 1e-3, "alpha_final": 0.0, "decay": 1.0, "episodes": 1_000, "v_init": -12.0}
    q = at_work([[0.0, -1.0]], **STEADY | steady, gamma=1.0)
    q.play(Corridor(), 1_000)
    p = 1 / (1 + math.exp(q.q[0] - q.q[1]))
    assert p == pytest.approx(2 - math.sqrt(2), abs=0.08)
    assert Corridor().value(p) > -12.0
