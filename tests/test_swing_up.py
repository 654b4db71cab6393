"""SwingUp-v0: poles that hang, turn right round, and are the same for all who play them."""

import itertools
import math
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from mjcartpole.envs.backend import make_env
from mjcartpole.envs.registration import env_id
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.evaluation import evaluate
from mjcartpole.learning.training import train
from mjcartpole.physics.bodies import starting_state
from mjcartpole.physics.load import load_model
from mjcartpole.rewards import upright
from mjcartpole.task import SWING_UP, wrapped

CHAIN = "tests/models/chain.xml"
GRID = {"bins": (1, 3, 8, 6), "low": (-2.4, -3.0, -math.pi, -9.0), "high": (2.4, 3.0, math.pi, 9.0)}


def pushes(seed, n=400):
    """Long pushes to one side: enough to turn a pole right round."""
    runs = np.random.default_rng(seed).integers(2, 25, size=n).tolist()
    return list(itertools.islice(itertools.cycle(np.repeat([1, 0] * (n // 2), runs).tolist()), n))


@pytest.mark.parametrize("backend", ["mujoco", "gym"])
def test_a_pole_hangs_turns_and_is_paid_for_standing(backend):
    env = make_env(backend, task=SWING_UP)
    observation, _ = env.reset(seed=3)
    assert abs(abs(observation[2]) - math.pi) <= 0.05
    farthest, angle_before, jumped = 0.0, observation[2], False
    for action in pushes(0):
        observation, reward, terminated, _, _ = env.step(action)
        assert env.observation_space.contains(observation)
        theta = wrapped(float(env.unwrapped.state[2]))
        assert reward == upright(0.0, 0.0, theta, 0.0, False)
        assert observation[2] == np.float32(theta)
        jumped |= abs(observation[2] - angle_before) > math.pi
        farthest, angle_before = max(farthest, abs(env.unwrapped.state[2])), observation[2]
        assert terminated == (abs(env.unwrapped.state[0]) > 2.4)
        if terminated:
            break
    assert jumped, "it went past the bottom"


def test_both_backends_start_alike():
    starts = [make_env(b, task=SWING_UP).reset(seed=5)[0] for b in ("mujoco", "gym")]
    np.testing.assert_array_equal(*starts)


def test_gymnasiums_checker_is_silent():
    env = gymnasium.make(env_id(SWING_UP)).unwrapped
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*A Box observation space m")
        check_env(env, skip_render_check=True)


@pytest.mark.parametrize("model", ["cartpole", CHAIN, "twopoles"])
def test_the_vector_and_dm_control_move_as_the_environment(model):
    single = gymnasium.make(env_id(SWING_UP), model=model, integrator="mujoco").unwrapped
    envs = gymnasium.make_vec(env_id(SWING_UP), num_envs=1, model=model, integrator="mujoco")
    first, firsts = single.reset(seed=1)[0], envs.reset(seed=1)[0]
    np.testing.assert_array_equal(first, firsts[0])
    dm = pytest.importorskip("mjcartpole.envs.dm", exc_type=ImportError)
    third = dm.load(SWING_UP.name, model=model, seed=1, discrete=True)
    third.reset()
    for action in pushes(2):
        observation, reward, terminated, _, _ = single.step(action)
        seen, rewards, terminations, _, _ = envs.step(np.array([action]))
        np.testing.assert_array_equal(observation, seen[0])
        assert (np.float32(reward), terminated) == (rewards[0], terminations[0])
        step = third.step(action)
        assert step.reward == reward
        position = np.float32(step.observation["position"])
        np.testing.assert_array_equal(position, observation[0::2])
        if terminated:
            break


def test_a_pole_on_another_hangs_in_line_with_it():
    assert starting_state(load_model(CHAIN), SWING_UP).tolist() == [0, 0, math.pi, 0, 0, 0]
    beside = starting_state(load_model("twopoles"), SWING_UP).tolist()
    assert beside == [0, 0, math.pi, 0, math.pi, 0]


@pytest.mark.parametrize(
    ("backend", "model"), [("gym", "cartpole"), ("mujoco", "cartpole"), ("mujoco", "twopoles")]
)
def test_both_engines_learn_and_play_it_alike(backend, model):
    config = TrainConfig(
        backend=backend, model=model, task=SWING_UP, episodes=6, epsilon=0.1, **GRID
    )
    compiled, plain = (train(config, engine=engine) for engine in ("compiled", "python"))
    np.testing.assert_array_equal(compiled.q_table, plain.q_table)
    np.testing.assert_array_equal(compiled.returns, plain.returns)
    where = {"backend": backend, "model": model, "task": SWING_UP, "episodes": 2}
    played = [evaluate(plain.policy, engine=each, **where) for each in ("compiled", "python")]
    assert played[0] == played[1]
