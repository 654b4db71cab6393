"""Tasks: CartPole-v1's rules on both sides of every limit, and rules that make no sense."""

import dataclasses
import math

import gymnasium
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjcartpole import task
from mjcartpole.envs.registration import register_task
from mjcartpole.errors import ConfigError
from mjcartpole.rewards import upright
from mjcartpole.task import CARTPOLE_V1, TASKS, Task, resolve, worst_pole

UP = math.inf
X, THETA = CARTPOLE_V1.x_limit, CARTPOLE_V1.theta_limit
PUNISHING = CARTPOLE_V1.with_changes(reward="minus-one-at-the-end")


@pytest.mark.parametrize(
    ("x", "theta", "over"),
    [
        (0.0, 0.0, False),
        (X, 0.0, False),
        (math.nextafter(X, UP), 0.0, True),
        (-X, 0.0, False),
        (math.nextafter(-X, -UP), 0.0, True),
        (0.0, THETA, False),
        (0.0, math.nextafter(THETA, UP), True),
        (0.0, -THETA, False),
        (0.0, math.nextafter(-THETA, -UP), True),
        (UP, 0.0, True),
    ],
)
def test_termination_is_strict(x, theta, over):
    assert CARTPOLE_V1.has_ended(x, theta) is over


def test_no_limits_end_nothing():
    free = Task("free", x_limit=UP, theta_limit=UP)
    assert not free.has_ended(1e300, -1e300)
    np.testing.assert_array_equal(free.observation_bound(), np.float32([UP, UP, math.pi, UP]))


@given(st.floats(-1e6, 1e6))
def test_an_angle_counts_from_minus_pi_to_pi(theta):
    there = task.wrapped(theta)
    assert -math.pi <= there <= math.pi
    assert math.cos(there) == pytest.approx(math.cos(theta), abs=1e-9)
    if -math.pi <= theta < math.pi:
        assert there == theta
    states = np.array([[theta, theta, theta, theta, 3 * theta, theta]])
    expected = [[theta, theta, there, theta, task.wrapped(3 * theta), theta]]
    np.testing.assert_array_equal(task.SWING_UP.seen(states), expected)
    assert CARTPOLE_V1.seen(states) is states


def test_no_number_is_an_angle_as_little_as_before():
    assert math.isnan(task.wrapped(math.nan))
    assert math.isnan(task.wrapped(math.inf))


def test_numbers_are_gymnasiums():
    env = gymnasium.make("CartPole-v1").unwrapped
    assert env.tau == task.CONTROL_STEP
    assert (env.x_threshold, env.theta_threshold_radians) == (X, THETA)
    np.testing.assert_array_equal(CARTPOLE_V1.observation_bound(), env.observation_space.high)
    spec = gymnasium.spec("CartPole-v1")
    assert spec.max_episode_steps == CARTPOLE_V1.time_limit
    assert spec.reward_threshold == CARTPOLE_V1.reward_threshold


@pytest.mark.parametrize(
    ("task", "most"),
    [
        (CARTPOLE_V1, 500),
        (PUNISHING, 0),
        (Task("own", reward=lambda *state: state[0]), UP),
    ],
)
def test_the_most_that_an_episode_returns(task, most):
    assert task.most_return == most


def test_episodes_of_another_length_are_solved_by_as_large_a_share_of_them():
    for usual in (None, 500):
        assert CARTPOLE_V1.with_changes(max_episode_steps=usual) is CARTPOLE_V1
    both = CARTPOLE_V1, Task("none agreed")
    short, other = (each.with_changes(max_episode_steps=100) for each in both)
    assert (short.time_limit, short.reward_threshold, short.x_limit) == (100, 95.0, X)
    assert (other.time_limit, other.reward_threshold) == (100, None)
    punished = dataclasses.replace(PUNISHING, reward_threshold=-0.1)
    assert punished.with_changes(max_episode_steps=7).reward_threshold is None


@pytest.mark.parametrize("steps", [0, -1, 2.5, True, 10**7 + 1])
def test_episodes_that_have_no_length_are_refused(steps):
    with pytest.raises(ConfigError, match="from 1 to 10,000,000, not"):
        CARTPOLE_V1.with_changes(max_episode_steps=steps)


@pytest.mark.parametrize(("terminated", "sutton_barto"), [(False, 0.0), (True, -1.0)])
def test_reward(terminated, sutton_barto):
    state = (0.1, 0.2, 0.3, 0.4)
    assert CARTPOLE_V1.reward(*state, terminated) == 1.0
    assert PUNISHING.reward(*state, terminated) == sutton_barto


@pytest.mark.parametrize(
    "rules",
    [
        {"x_limit": 0.0},
        {"theta_limit": -1.0},
        {"x_limit": math.nan},
        {"start_low": 0.1, "start_high": 0.0},
        {"start_high": UP},
        {"time_limit": 0},
        {"time_limit": 10.5},
        {"reward": 1.0},
    ],
)
def test_rules_that_make_no_sense(rules):
    with pytest.raises(ConfigError, match=next(iter(rules))):
        Task("odd", **rules)


def test_some_rules_are_others():
    changed = resolve("CartPole-v1", x_limit=np.float32(0.5), theta_limit=UP, start_low=0)
    assert changed == dataclasses.replace(CARTPOLE_V1, x_limit=0.5, theta_limit=UP, start_low=0.0)
    assert changed.changes == {"x_limit": 0.5, "theta_limit": UP, "start_low": 0.0}
    assert resolve(changed.name, **changed.changes) == changed
    same = {"x_limit": 2.4, "reward": "one-per-step", "start_angle": None}
    assert CARTPOLE_V1.with_changes(**same) is CARTPOLE_V1
    assert CARTPOLE_V1.with_changes(reward=upright).reward_threshold is None
    assert CARTPOLE_V1.with_changes(reward="upright").reward is upright


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"x_limit": 0}, r"x_limit must be a number \(m\) more than 0"),
        ({"start_low": 0.06}, r"start_low \(0\.06\) is above start_high \(0\.05\)"),
        ({"start_angle": 3.1}, r"between theta = 3\.05 and 3\.15 rad, all beyond theta_limit"),
        ({"start_high": 9, "start_low": 3}, r"between x = 3 and 9 m, all beyond x_limit, 2\.4"),
        ({"x_limit": 1e-9}, r"-0\.05 and 0\.05 m, nearly all beyond x_limit, 1e-09"),
        ({"theta_limit": 4e-4}, "rad, nearly all beyond theta_limit"),
    ],
)
def test_changes_that_make_no_sense_are_told_in_one_line(changes, message):
    with pytest.raises(ConfigError, match=message) as told:
        CARTPOLE_V1.with_changes(**changes)
    assert "\n" not in str(told.value)


def test_no_such_rule():
    with pytest.raises(TypeError, match="unexpected keyword argument 'x_limits'"):
        CARTPOLE_V1.with_changes(x_limits=1.0)


def test_the_worst_pole_is_what_the_rules_look_at():
    assert worst_pole((1.0, 2.0, -3.0, -4.0)) == (1.0, 2.0, -3.0, -4.0)
    assert worst_pole((-1.0, 2.0, -0.1, 4.0, 0.05, -5.0)) == (-1.0, 2.0, 0.1, 5.0)


def test_an_unknown_task():
    with pytest.raises(ConfigError, match="'nothing' is unknown; available: CartPole-v1"):
        resolve("nothing")
    assert resolve("CartPole-v1") is resolve(CARTPOLE_V1) is CARTPOLE_V1


def test_a_name_is_taken_once(monkeypatch):
    with pytest.raises(ConfigError, match="already"):
        register_task(Task("CartPole-v1"))
    assert register_task(CARTPOLE_V1) is CARTPOLE_V1
    with pytest.raises(ConfigError, match="cannot be called 'no name'"):
        register_task(Task("no name"))
    assert "no name" not in TASKS
