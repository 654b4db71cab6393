"""What environments take: rules where they are made, `reset(options=…)` later."""

import math

import gymnasium
import numpy as np
import pytest

from mjcartpole.envs.backend import make_env
from mjcartpole.envs.cartpole import CartPoleEnv
from mjcartpole.envs.options import rules_of, start_bounds
from mjcartpole.envs.vector import CartPoleVectorEnv
from mjcartpole.errors import ConfigError
from mjcartpole.task import CARTPOLE_V1, Task


def test_what_is_left_out_is_as_usual():
    usual = CARTPOLE_V1.start_low, CARTPOLE_V1.start_high
    assert start_bounds({}, usual) == usual == (-0.05, 0.05)
    assert start_bounds({"low": np.array(-0.2)}, usual) == (-0.2, 0.05)


@pytest.mark.parametrize(
    "options",
    [
        {"low": "x", "high": "y"},
        {"low": 10.0, "high": 8.0},
        {"low": [-1.0, -1.0], "high": [1.0, 1.0]},
        {"low": np.array([-1.0, -1.0])},
        {"high": None},
        {"low": math.nan},
        {"high": math.inf},
        {"high": 10**400},
        {"low": -1e308, "high": 1e308},
        {"state": (0, 0, 0, 0)},
        {"lo": -0.1},
        {1: 2},
        ["low"],
        "low",
        3,
    ],
)
def test_what_makes_no_sense_is_a_value_error_and_changes_nothing(options):
    env = CartPoleEnv()
    env.reset(seed=0)
    before, draws = env.state, env.np_random.bit_generator.state
    with pytest.raises(ConfigError):
        env.reset(seed=5, options=options)
    np.testing.assert_array_equal(env.state, before)
    assert env.np_random.bit_generator.state == draws


@pytest.mark.parametrize("edits", [{"pole.length": 3.0}, ["pole.length=3"]])
def test_edits_hold_until_the_next_reset(edits):
    env, long, usual = CartPoleEnv(), CartPoleEnv(edits={"pole.length": 3.0}), CartPoleEnv()
    for other, options in ((long, {"edits": edits}), (usual, None)):
        env.reset(seed=1, options=options)
        other.reset(seed=1)
        assert env.length == other.length
        np.testing.assert_array_equal(env.step(1)[0], other.step(1)[0])


def test_edits_add_to_what_was_set():
    env = CartPoleEnv()
    env.masspole = 0.2
    env.reset(options={"edits": {"pole.length": 3.0}})
    assert (env.masspole, env.length) == (0.2, 1.5)
    env.reset()
    assert (env.masspole, env.length) == (0.2, 0.5)


def test_edits_that_make_no_sense_leave_the_episode_as_it_is():
    env = CartPoleEnv()
    env.reset(seed=0)
    before = env.state
    with pytest.raises(ConfigError, match=r"did you mean 'pole\.length'"):
        env.reset(options={"edits": {"pole.lenght": 3.0}})
    np.testing.assert_array_equal(env.state, before)
    assert env.length == 0.5


CHANGES = {
    "x_limit": 0.5,
    "theta_limit": 0.4,
    "start_low": 0.1,
    "start_high": 0.12,
    "start_angle": -0.05,
    "reward": "upright",
}


def steps_of(env):
    """What an episode under constant action 0 gives, from reset on."""
    seen = [(env.reset(seed=3)[0].tolist(), 0.0, False)]
    while not seen[-1][2]:
        observation, reward, over, _, _ = env.step(0)
        seen.append((observation.tolist(), reward, over))
    return seen


@pytest.mark.parametrize("backend", ["mujoco", "gym"])
def test_changed_rules_are_those_of_a_task_that_has_them(backend):
    rules = CARTPOLE_V1.with_changes(**CHANGES)
    played = steps_of(make_env(backend, **CHANGES, max_episode_steps=80))
    assert played == steps_of(make_env(backend, task=rules))
    start, (last, paid, _) = played[0][0], played[-1]
    assert all(0.1 <= value <= 0.12 for value in (start[0], start[1], start[3]))
    assert 0.05 <= start[2] <= 0.07
    assert abs(last[2]) > 0.4 or abs(last[0]) > 0.5
    assert paid == pytest.approx((1 + math.cos(last[2])) / 2)
    assert make_env(backend, max_episode_steps=80).spec.max_episode_steps == 80


@pytest.mark.parametrize(
    ("rule", "index", "inside"), [("x_limit", 0, 0.3), ("theta_limit", 2, 0.3)]
)
def test_both_sides_of_a_changed_limit_in_every_environment(rule, index, inside):
    env, envs = CartPoleEnv(**{rule: inside}), CartPoleVectorEnv(2, **{rule: inside})
    gyms = make_env("gym", **{rule: inside})
    outside = math.nextafter(inside, 2)
    start = np.zeros((4, 2))
    start[index] = inside, outside
    envs.reset()
    envs.state = start
    # Positions move by the old velocities, which are none.
    assert envs.step([1, 1])[2].tolist() == [False, True]
    for each in (env, gyms):
        assert each.observation_space.high[index] == np.float32(2 * inside)
        for column in (0, 1):
            each.reset()
            each.unwrapped.state = start[:, column]
            assert each.step(1)[2] is bool(column)
    assert envs.single_observation_space == env.observation_space


def test_environments_are_made_again_with_their_rules():
    for changes in (CHANGES, {"task": CARTPOLE_V1.with_changes(**CHANGES)}):
        env = gymnasium.make("mjcartpole/CartPole-v1", **changes)
        again = gymnasium.make(type(env.spec).from_json(env.spec.to_json()))
        assert env.unwrapped.task == again.unwrapped.task == CARTPOLE_V1.with_changes(**CHANGES)
        assert steps_of(env) == steps_of(again)


def test_rewards_and_lengths_that_are_given_twice():
    with pytest.raises(ConfigError, match="leave out one of the two"):
        CartPoleEnv(reward="upright", sutton_barto_reward=True)
    with pytest.raises(TypeError, match=r"'max_episode_steps'; gymnasium\.make takes it"):
        CartPoleEnv(max_episode_steps=5)
    with pytest.raises(TypeError, match="unexpected keyword argument 'x_limt'"):
        CartPoleVectorEnv(x_limt=5)
    own = Task("own", reward=lambda *state: state[0])
    assert rules_of(own, {}, sutton_barto_reward=True).reward(0, 0, 0, 0, True) == -1.0


@pytest.mark.parametrize("make", [CartPoleEnv, CartPoleVectorEnv])
def test_a_start_of_nothing_but_zeros_has_no_wrong_sign(make):
    observation, _ = make().reset(seed=0, options={"low": 0.0, "high": -0.0})
    assert not observation.any()
