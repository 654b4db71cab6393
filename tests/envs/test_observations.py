"""Observations by cosine and sine: the same numbers in every environment."""

import math
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from mjcartpole.envs.cartpole import CartPoleEnv
from mjcartpole.envs.observations import observed, with_cosines
from mjcartpole.envs.vector import CartPoleVectorEnv
from mjcartpole.errors import ConfigError
from mjcartpole.task import SWING_UP, TASKS

UP = math.inf


def as_said(state):
    x, x_dot, *others = state
    pairs = zip(others[0::2], others[1::2], strict=True)
    each = [(np.cos(theta), np.sin(theta), theta_dot) for theta, theta_dot in pairs]
    return np.float32([x, x_dot, *np.ravel(each)])


@pytest.mark.parametrize("model", ["cartpole", "wieland"])
@pytest.mark.parametrize("task", TASKS)
def test_single_and_vector_give_the_cosine_and_sine_of_the_state(task, model):
    settings = {"model": model, "observation": "trig"}
    envs = gymnasium.make_vec(f"mjcartpole/{task}", num_envs=3, **settings)
    env = gymnasium.make(f"mjcartpole/{task}", **settings).unwrapped
    plain = gymnasium.make(f"mjcartpole/{task}", model=model).unwrapped
    np.testing.assert_array_equal(env.reset(seed=4)[0], as_said(env.state))
    together, _ = envs.reset(seed=1)
    plain.reset(seed=4)
    plain.state = env.state = envs.unwrapped.state[:, 1]
    for _ in range(3):
        np.testing.assert_array_equal(together[1], observed(env.state, env.task, "trig"))
        actions = np.ones_like(envs.action_space.sample())
        together, *_ = envs.step(actions)
        observation, *rest = env.step(actions[1])
        assert rest == list(plain.step(actions[1])[1:])
        np.testing.assert_array_equal(observation, as_said(env.state))
        np.testing.assert_array_equal(env.state, plain.state)


def test_the_space_has_its_bounds():
    env, envs = CartPoleEnv(observation="trig", x_limit=1.0), CartPoleVectorEnv(observation="trig")
    np.testing.assert_array_equal(env.observation_space.high, np.float32([2.0, UP, 1, 1, UP]))
    np.testing.assert_array_equal(env.observation_space.low, -env.observation_space.high)
    assert envs.single_observation_space.high[0] == np.float32(4.8)
    env.x_threshold = 3.0
    np.testing.assert_array_equal(env.observation_space.high, np.float32([6.0, UP, 1, 1, UP]))
    two = CartPoleEnv(model="wieland", observation="trig").observation_space
    np.testing.assert_array_equal(two.high, np.float32([4.8, UP, *[1, 1, UP] * 2]))


def test_it_does_not_jump_where_a_pole_turns_right_round():
    states = np.array([[0.0, 0.0, math.pi - 1e-6, 2.0], [0.0, 0.0, math.pi + 1e-6, 2.0]])
    there, here = observed(states, SWING_UP, "trig")
    np.testing.assert_allclose(there, here, atol=3e-6)
    assert np.ptp(observed(states, SWING_UP, "state")[:, 2]) > 6


@pytest.mark.parametrize("task", TASKS)
def test_gymnasiums_checker_is_silent(task):
    env = gymnasium.make(f"mjcartpole/{task}", observation="trig")
    with warnings.catch_warnings():
        # It finds unbounded velocities odd, as it does in gymnasium's own.
        warnings.filterwarnings("ignore", message=".*A Box observation space m")
        check_env(env.unwrapped, skip_render_check=True)
    again = gymnasium.make(type(env.spec).from_json(env.spec.to_json()))
    assert again.observation_space == env.observation_space


@pytest.mark.parametrize("make", [CartPoleEnv, CartPoleVectorEnv])
def test_an_unknown_observation(make):
    with pytest.raises(ConfigError, match=r"observation 'trigs' is unknown.*state, trig"):
        make(observation="trigs")


def test_dm_control_has_them_as_its_suite_does():
    dm = pytest.importorskip("mjcartpole.envs.dm", exc_type=ImportError)
    env = dm.load("SwingUp-v0", model="wieland", seed=3, observation="trig")
    seen = env.reset().observation
    whole = with_cosines(env.physics.state)
    assert list(env.observation_spec()) == list(seen) == ["position", "velocity"]
    np.testing.assert_array_equal(seen["position"], whole[[0, 2, 3, 5, 6]])
    np.testing.assert_array_equal(seen["velocity"], env.physics.state[1::2])
    with pytest.raises(ConfigError, match="observation 'sin' is unknown"):
        dm.load(observation="sin")
