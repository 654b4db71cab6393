"""CartPole-v1's rules, on both sides of every limit."""

import math

import gymnasium
import numpy as np
import pytest

from mjcartpole import task
from mjcartpole.task import CARTPOLE_V1

UP = math.inf


@pytest.mark.parametrize(
    ("x", "theta", "over"),
    [
        (0.0, 0.0, False),
        (CARTPOLE_V1.x_limit, 0.0, False),
        (math.nextafter(CARTPOLE_V1.x_limit, UP), 0.0, True),
        (-CARTPOLE_V1.x_limit, 0.0, False),
        (math.nextafter(-CARTPOLE_V1.x_limit, -UP), 0.0, True),
        (0.0, CARTPOLE_V1.theta_limit, False),
        (0.0, math.nextafter(CARTPOLE_V1.theta_limit, UP), True),
        (0.0, -CARTPOLE_V1.theta_limit, False),
        (0.0, math.nextafter(-CARTPOLE_V1.theta_limit, -UP), True),
        (UP, 0.0, True),
    ],
)
def test_termination_is_strict(x, theta, over):
    assert CARTPOLE_V1.has_ended(x, theta) is over


def test_numbers_are_gymnasiums():
    env = gymnasium.make("CartPole-v1").unwrapped
    assert env.tau == task.CONTROL_STEP
    assert env.x_threshold == CARTPOLE_V1.x_limit
    assert env.theta_threshold_radians == CARTPOLE_V1.theta_limit
    np.testing.assert_array_equal(CARTPOLE_V1.observation_bound(), env.observation_space.high)
    spec = gymnasium.spec("CartPole-v1")
    assert (spec.max_episode_steps, 475.0) == (CARTPOLE_V1.time_limit, CARTPOLE_V1.reward_threshold)


@pytest.mark.parametrize(
    ("terminated", "already_over", "plain", "sutton_barto"),
    [
        (False, False, 1.0, 0.0),
        (True, False, 1.0, -1.0),
        (True, True, 0.0, -1.0),
        (False, True, 1.0, 0.0),
    ],
)
def test_reward(terminated, already_over, plain, sutton_barto):
    arguments = {"terminated": terminated, "already_over": already_over}
    assert task.reward(**arguments, sutton_barto=False) == plain
    assert task.reward(**arguments, sutton_barto=True) == sutton_barto
    # Compiled code has no names for arguments.
    assert task.reward(terminated, already_over, False) == plain
    assert task.reward(terminated, already_over, True) == sutton_barto
