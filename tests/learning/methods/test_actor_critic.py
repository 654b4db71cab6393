"""Actor-critic by known answers."""

import math

import numpy as np
import pytest

from mjcartpole.errors import ConfigError
from mjcartpole.learning.config import TrainConfig
from worlds import Walk

STEADY = {"method": "actor-critic", "decay": 0.0}


@pytest.mark.parametrize(
    ("lam", "first", "h_first"),
    # With lambda the first state has 0.8 · 0.5 of its traces left when the second error comes.
    [(0.5, 1.16 - 0.1 * 2 * 0.4, 0.4 - 0.5 * 2 * 0.2), (0.0, 1.16, 0.4)],
)
def test_two_steps(at_work, lam, first, h_first):
    rates = {"alpha_final": 0.5, "alpha_values_final": 0.1, "gamma": 0.8, "trace_lambda": lam}
    q = at_work([[0.0, 0.0]] * 2, **STEADY, **rates)
    v = q.memory.state_values
    v[:] = (1.0, 2.0)
    q.step(0, 1, 1.0, 1)
    # The error is 1 + 0.8 · 2 - 1 = 1.6, of which v takes 0.1, and h 0.5 · (1 - 1/2).
    assert v.tolist() == [pytest.approx(1.16), 2.0]
    assert q.table == [[pytest.approx(-0.4), pytest.approx(0.4)], [0.0, 0.0]]
    q.step(1, 0, 0.0, 0, terminated=True)
    # The error is 0 - 2: what led there is preferred less.
    assert v.tolist() == [pytest.approx(first), pytest.approx(1.8)]
    assert q.table == [
        [pytest.approx(-h_first), pytest.approx(h_first)],
        [pytest.approx(-0.5), pytest.approx(0.5)],
    ]


def test_a_truncated_step_has_a_future(at_work):
    q = at_work([[0.0, 0.0]] * 2, **STEADY, alpha_values_final=1.0, gamma=0.5)
    q.memory.state_values[:] = (1.0, 4.0)
    q.step(0, 1, 1.0, 1, truncated=True)
    assert q.memory.state_values[0] == 3.0


def test_faint_traces_are_forgotten_and_an_episode_leaves_none(at_work):
    q = at_work([[0.0, 0.0]] * 40, **STEADY, gamma=0.9, trace_lambda=0.5)
    for s in range(39):
        q.step(s, 1, 1.0, s + 1)
    # 0.45^25 is more than a billionth, 0.45^26 is less.
    assert q.memory.n_traced.tolist() == [26]
    assert q.memory.value_traces.nonzero()[0].tolist() == list(range(13, 39))
    q.step(39, 1, 1.0, 39, truncated=True)
    assert q.memory.n_traced.tolist() == [0]
    assert not q.memory.value_traces.any() and not q.memory.policy_traces.any()


def by_the_book(h, v, episodes, alpha, alpha_values, fade, gamma):
    """Learn as section 13.5 says, without gamma^t, all states at once."""
    for steps in episodes:
        z_v, z_h = np.zeros_like(v), np.zeros_like(h)
        for s, a, r, s_next, terminated in steps:
            error = r + (0.0 if terminated else gamma * v[s_next]) - v[s]
            z_v, z_h = fade * z_v, fade * z_h
            z_v[s] += 1
            z_h[s] += np.eye(2)[a] - np.exp(h[s]) / np.exp(h[s]).sum()
            v += alpha_values * error * z_v
            h += alpha * error * z_h


@pytest.mark.parametrize("lam", [0.0, 0.7, 1.0])
def test_it_learns_what_the_book_says(at_work, lam):
    h, v = np.random.default_rng(3).normal(size=(7, 2)), np.full(7, 0.3)
    rates = {"alpha_final": 0.3, "alpha_values_final": 0.2, "gamma": 0.9, "trace_lambda": lam}
    q = at_work(h, **STEADY, **rates, v_init=0.3)
    by_the_book(h, v, q.play(Walk(7), 60), 0.3, 0.2, 0.9 * lam, 0.9)
    np.testing.assert_allclose(q.table, h, atol=1e-7)
    np.testing.assert_allclose(q.memory.state_values, v, atol=1e-7)


@pytest.mark.parametrize("lam", [0.0, 0.8])
def test_a_random_walk_has_the_values_that_it_has(at_work, lam):
    rates = {"alpha_final": 0.0, "alpha": 0.0, "alpha_values_final": 0.0, "trace_lambda": lam}
    values = {"decay": 1.0, "gamma": 1.0, "v_init": 0.5, "episodes": 1_000}
    q = at_work([[0.0, 0.0]] * 5, **STEADY | rates | values)
    q.play(Walk(5), 1_000)
    np.testing.assert_allclose(q.memory.state_values, Walk(5).values(np.full(5, 0.5)), atol=0.06)
    assert q.table == [[0.0, 0.0]] * 5


@pytest.mark.parametrize("lam", [0.0, 0.8])
def test_on_average_it_goes_along_the_gradient(at_work, lam):
    """Of the start's value, where its critic is right (Sutton and others, 2000)."""
    h, tiny, episodes, world = np.array([0.3, -0.5, 0.2, 0.6, -0.1]), 1e-9, 1_500, Walk(5)

    def values(h):
        return world.values(1 / (1 + np.exp(-h)))

    rates = {"alpha_final": tiny, "alpha_values_final": 0.0, "gamma": 1.0, "trace_lambda": lam}
    q = at_work(np.column_stack([np.zeros(5), h]), **STEADY, **rates)
    q.memory.state_values[:] = values(h)
    moved = []
    for seed in range(episodes):
        before = q.q[1::2].copy()
        q.play(world, 1, seed)
        moved.append((q.q[1::2] - before) / tiny)
    small = np.eye(5) * 1e-6
    slope = [(values(h + each)[2] - values(h - each)[2]) / 2e-6 for each in small]
    error = np.std(moved, axis=0) / math.sqrt(episodes)
    assert (np.abs(np.mean(moved, axis=0) - slope) < 4 * error).all()
    assert (slope > 4 * error).all()


@pytest.mark.parametrize("lam", [-0.1, 1.5, math.nan])
def test_a_lambda_that_makes_no_sense(lam):
    with pytest.raises(ConfigError, match="trace_lambda must be a number from 0 to 1"):
        TrainConfig(method="actor-critic", trace_lambda=lam)
