"""Continuous-v0: at its ends CartPole-v1, bit for bit, and between them what MuJoCo makes of it."""

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from mjcartpole.envs.backend import make_env
from mjcartpole.envs.cartpole import CartPoleEnv
from mjcartpole.envs.registration import env_id
from mjcartpole.errors import ConfigError, InvalidActionError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.physics.load import load_model
from mjcartpole.physics.simulation import Simulation
from mjcartpole.task import CONTINUOUS, control_of

ID = env_id(CONTINUOUS)
LOPSIDED = {"motor:push.ctrlrange": "-0.7 1"}


def push(value):
    return np.array([value], dtype=np.float32)


@pytest.mark.parametrize("backend", ["mujoco", "gym"])
def test_at_the_ends_it_is_cartpole_v1(backend):
    ours, plain = make_env(backend, task=CONTINUOUS), make_env(backend)
    np.testing.assert_array_equal(ours.reset(seed=4)[0], plain.reset(seed=4)[0])
    over = False
    while not over:
        action = int(plain.unwrapped.state[2] > 0)
        here, there = ours.step(push(2 * action - 1)), plain.step(action)
        np.testing.assert_array_equal(here[0], there[0])
        assert here[1:4] == there[1:4]
        over = here[2] or here[3]


@pytest.mark.parametrize("edits", [None, LOPSIDED])
def test_between_them_is_the_control_between_theirs(edits):
    env = gymnasium.make(ID, edits=edits).unwrapped
    simulation = Simulation(load_model("cartpole", edits))
    env.reset(seed=1)
    simulation.state = env.state
    for value in np.random.default_rng(0).uniform(-1, 1, 6).astype(np.float32):
        env.step(push(value))
        simulation.step(control_of(float(value), simulation.cartpole.controls))
        np.testing.assert_array_equal(env.state, simulation.state)


def test_the_vector_moves_as_the_environment():
    envs, env = gymnasium.make_vec(ID, num_envs=2), gymnasium.make(ID)
    envs.reset(seed=0)
    env.reset(seed=0)
    env.unwrapped.state = envs.unwrapped.state[:, 1]
    for value in (0.3, -0.9, 1.0):
        seen = envs.step(np.array([[-0.5], [value]], dtype=np.float32))
        assert env.step(push(value))[0].tolist() == seen[0][1].tolist()


def test_gymnasiums_checker_is_silent():
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*A Box observation space m")
        check_env(gymnasium.make(ID).unwrapped, skip_render_check=True)


@pytest.mark.parametrize("action", [1, 0.5, push(1.1), push(np.nan), np.zeros(2, np.float32), None])
@pytest.mark.parametrize("backend", ["mujoco", "gym"])
def test_what_is_no_push_is_refused(backend, action):
    env = make_env(backend, task=CONTINUOUS)
    env.reset()
    with pytest.raises(InvalidActionError, match="a push from -1 to 1, shape"):
        env.step(action)


def test_what_are_no_pushes_is_refused():
    envs = gymnasium.make_vec(ID, num_envs=2)
    envs.reset()
    with pytest.raises(InvalidActionError, match=r"2 pushes from -1 to 1, shape \(2, 1"):
        envs.step(np.array([0, 1]))


def test_it_is_no_game_for_two_actions():
    with pytest.raises(ConfigError, match="takes pushes; see ContinuousCartPoleEnv"):
        CartPoleEnv(task=CONTINUOUS)
    with pytest.raises(ConfigError, match="a table chooses between two actions"):
        TrainConfig(task=CONTINUOUS)
