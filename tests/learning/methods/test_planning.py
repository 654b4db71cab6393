"""Planning by known answers, and by an independent solution."""

import dataclasses
from types import SimpleNamespace

import gymnasium
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from engines import DIVERGING, write
from mjcartpole.errors import ConfigError, SimulationError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.methods.action_values import QTable
from mjcartpole.learning.methods.planning import around, nodes_of, plan
from mjcartpole.learning.training import Training, train
from mjcartpole.rewards import minus_one_at_the_end
from mjcartpole.task import TASKS, register

SMALL = {
    "method": "planning",
    "backend": "gym",
    "bins": (1, 5, 9, 9),
    "low": (-2.4, -2.0, -0.2095, -2.0),
    "high": (2.4, 2.0, 0.2095, 2.0),
    "gamma": 0.97,
    "tolerance": 0.01,
    "episodes": 4,
}


def nodes(n, low, high):
    return Discretizer(n, low, high, interpolated=True)


def planned(dynamics, grid, gamma=0.9, tolerance=1e-10, sweeps=10_000):
    """The table, shape (nodes, 2)."""
    memory = QTable(np.zeros(2 * grid.n_rows))
    p = SimpleNamespace(gamma=gamma, tolerance=tolerance, sweeps=sweeps)
    plan(p, memory, grid, dynamics)
    return memory.q_table.reshape(-1, 2)


def walk(states, action):
    """A row of places 0 to 4; a step to the right of the last one pays 1, both ends end it."""
    after = states + (1.0 if action else -1.0)
    return after, (after[:, 0] > 4) * 1.0, (after[:, 0] < 0) | (after[:, 0] > 4)


def test_a_walk_is_worth_what_its_length_leaves():
    q = planned(walk, nodes((5,), (0.0,), (4.0,)))
    right = [0.9**4, 0.9**3, 0.9**2, 0.9, 1.0]
    left = [0.0, 0.9**5, 0.9**4, 0.9**3, 0.9**2]
    np.testing.assert_allclose(q, np.transpose([left, right]), atol=1e-9)


def test_two_sweeps_by_hand():
    def dynamics(states, action):
        return states + (0.25 if action else -0.5), states[:, 0] + 10 * action, states[:, 0] > 1.5

    q = planned(dynamics, nodes((3,), (0.0,), (2.0,)), sweeps=2)
    # The first sweep gives the rewards, of which the better are 10, 11 and 12. From 0, action 0
    # leads below the first node, whose value is taken; action 1 a quarter of the way to the second.
    assert q.tolist() == [
        [pytest.approx(0 + 0.9 * 10.0), pytest.approx(10 + 0.9 * 10.25)],
        [pytest.approx(1 + 0.9 * 10.5), pytest.approx(11 + 0.9 * 11.25)],
        [2.0, 12.0],
    ]


def glide(states, action):
    """A double integrator between two ends, which is to be kept near the middle."""
    x, v = states.T
    after = np.stack([x + 0.3 * v, v + (0.4 if action else -0.4)], axis=1)
    return after, 1.0 - after[:, 0] ** 2, np.abs(after[:, 0]) > 1


def hat(ends, n, value):
    """Weights of n nodes for one value, by numpy's own interpolation of each unit vector."""
    return [np.interp(value, np.linspace(*ends, n), unit) for unit in np.eye(n)]


def test_the_values_are_those_of_the_policy_and_no_action_is_better():
    grid = nodes((9, 7), (-1.0, -1.5), (1.0, 1.5))
    q = planned(glide, grid, gamma=0.95)
    states = [(x, v) for x in np.linspace(-1, 1, 9) for v in np.linspace(-1.5, 1.5, 7)]
    follow, reward = np.zeros((2, 63, 63)), np.zeros((2, 63))
    for action in (0, 1):
        after, reward[action], over = glide(np.array(states), action)
        for index in np.flatnonzero(~over):
            x, v = after[index]
            follow[action, index] = np.outer(hat((-1, 1), 9, x), hat((-1.5, 1.5), 7, v)).ravel()
    chosen, each = q.argmax(axis=1), np.arange(63)
    values = np.linalg.solve(np.eye(63) - 0.95 * follow[chosen, each], reward[chosen, each])
    np.testing.assert_allclose(q.max(axis=1), values, atol=1e-8)
    np.testing.assert_allclose(q, (reward + 0.95 * follow @ values).T, atol=1e-8)


@given(
    st.tuples(*[st.sampled_from([1, 2, 3, 6])] * 4),
    st.lists(st.tuples(*[st.floats(-2, 2)] * 4), min_size=1, max_size=5),
)
def test_what_is_multilinear_is_interpolated_exactly(bins, states):
    low, high = (-1.0, 0.0, -0.5, -1.5), (1.0, 0.5, 0.75, 1.5)
    grid = nodes(bins, low, high)

    def height(state):
        x, y, z, w = state.T
        return 3 + 2 * x - y + x * y - 4 * x * z * w + w * (1 - y * z * x)

    rows, weights = around(grid, np.array(states))
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-12)
    assert (weights >= 0).all() and (rows >= 0).all() and (rows < grid.n_rows).all()
    middle = (np.array(low) + high) / 2
    seen = np.where(np.array(bins) == 1, middle, np.clip(states, low, high))
    found = (weights * height(nodes_of(grid))[rows]).sum(axis=1)
    np.testing.assert_allclose(found, height(seen), atol=1e-12)


@pytest.mark.parametrize("backend", ["gym", "mujoco"])
def test_it_balances_from_the_first_episode_on(backend):
    result = train(TrainConfig(**SMALL | {"backend": backend}), engine="python")
    assert result.returns.tolist() == [500.0] * 4
    # Whatever it does, a step gives 1: at best for ever, and from everywhere at least once.
    assert 1.0 <= result.q_table.min() < result.q_table.max() < 1 / (1 - 0.97)
    np.testing.assert_allclose(result.q_table, result.q_table[:, ::-1, ::-1, ::-1, ::-1], rtol=1e-9)


def test_the_rewards_are_those_of_the_task():
    rules = TrainConfig().rules.with_changes(reward=minus_one_at_the_end)
    assert rules.reward is minus_one_at_the_end
    register(dataclasses.replace(rules, name="Planned-v0"))
    try:
        table = train(TrainConfig(**SMALL, task="Planned-v0"), engine="python").q_table
    finally:
        del TASKS["Planned-v0"]
    assert table.min() == -1.0 and -1.0 < table.max() < 0.0


def test_a_plan_is_made_once():
    first = Training(TrainConfig(**SMALL), engine="python")
    steps = first.run()
    next(steps)
    again = Training(TrainConfig(**SMALL), engine="python")
    again.restore(first.snapshot())
    again.learner.memory.q_table[:] = 7.0
    assert [*again.run()] == [2, 3, 4]
    assert set(again.learner.memory.q_table) == {7.0}


def test_an_environment_of_ones_own_shows_no_equations():
    with (
        gymnasium.make("CartPole-v1") as env,
        pytest.raises(ConfigError, match=r"'planning' needs equations, .* take the config's own"),
    ):
        Training(TrainConfig(**SMALL), env)


def test_too_many_nodes():
    with pytest.raises(ConfigError, match=r"68,024,448 weights; the most is 33,554,432"):
        planned(walk, nodes((9,) * 6, (-1.0,) * 6, (1.0,) * 6))


def test_physics_that_diverge(tmp_path):
    wild = write(tmp_path, DIVERGING["wild"])
    config = TrainConfig(**SMALL | {"backend": "mujoco", "model": wild})
    with pytest.raises(SimulationError, match="diverged"):
        train(config, engine="python")


def test_two_poles_are_planned_too():
    grid = {"bins": (1, 3, 3, 3, 3, 3), "low": (-1.0,) * 6, "high": (1.0,) * 6}
    config = TrainConfig(**SMALL | {"backend": "mujoco", "model": "twopoles", "sweeps": 3} | grid)
    result = train(config, engine="python")
    assert result.q_table.shape == (1, 3, 3, 3, 3, 3, 2)
    assert result.returns.min() > 0


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("gamma", 1.5, "gamma must be a number from 0 to 1"),
        ("tolerance", -1.0, "tolerance must be a number above 0, not -1.0"),
        ("tolerance", float("nan"), "tolerance must be"),
        ("sweeps", 0, "sweeps must be a whole number from 1 to"),
        ("sweeps", 2.0, "sweeps must be"),
    ],
)
def test_values_that_make_no_sense(name, value, message):
    with pytest.raises(ConfigError, match=message):
        TrainConfig(**SMALL | {name: value})
