"""Copies of a vector, pictures of it, and its end."""

import copy
import gc
import os
import pickle
import subprocess
import sys
import weakref

import gymnasium
import numpy as np
import pytest

from mjcartpole.envs.cartpole import CartPoleEnv
from mjcartpole.envs.vector import CartPoleVectorEnv
from mjcartpole.errors import (
    ConfigError,
)
from vectors import ENV_ID, MODELS, run

COPIES = {"deepcopy": copy.deepcopy, "copy": copy.copy}


COPIES["pickle"] = lambda envs: pickle.loads(pickle.dumps(envs))


@pytest.mark.parametrize("how", COPIES)
@pytest.mark.parametrize("name", ["reference", "all at once"])
def test_a_copy_goes_on_bit_for_bit_and_by_itself(name, how):
    envs = gymnasium.make_vec(ENV_ID, num_envs=5, max_episode_steps=20, model=MODELS[name])
    run(envs, 33)
    before = envs.state
    copied = COPIES[how](envs)
    assert (copied.spec.id, copied.num_envs) == (ENV_ID, 5)
    actions = np.random.default_rng(1).integers(0, 2, (50, 5))
    after = [copied.step(each)[:4] for each in actions]
    np.testing.assert_array_equal(envs.state, before)
    for each, results in zip(actions, after, strict=True):
        for mine, its in zip(envs.step(each)[:4], results, strict=True):
            assert mine.tobytes() == its.tobytes()
    assert copied.state.tobytes() == envs.state.tobytes()
    assert copied.reset(seed=3)[0].tobytes() == envs.reset(seed=3)[0].tobytes()


def test_a_copy_of_what_was_drawn_draws_by_itself():
    envs = CartPoleVectorEnv(2, render_mode="rgb_array", width=64, height=48)
    envs.reset(seed=0)
    pictures = envs.render()
    copied = copy.deepcopy(envs)
    envs.close()
    for mine, its in zip(pictures, copied.render(), strict=True):
        np.testing.assert_array_equal(mine, its)
    copied.close()


def test_a_vector_that_remembers_more_than_its_state_is_not_copied():
    envs = CartPoleVectorEnv(2, model=MODELS["sleeping"])
    with pytest.raises(ConfigError, match="cannot be copied"):
        copy.deepcopy(envs)


@pytest.mark.parametrize("mode", ["rgb_array", "rgb_array_list"])
def test_one_picture_per_environment(mode):
    envs = gymnasium.make_vec(ENV_ID, num_envs=2, render_mode=mode, width=160, height=120)
    assert envs.render() is None
    envs.reset(seed=0)
    envs.unwrapped.state = [(0.0, 1.0), (0.0, 0.0), (0.0, 0.1), (0.0, 0.0)]
    left, right = envs.render()
    single = CartPoleEnv(render_mode="rgb_array", width=160, height=120)
    single.state = (1.0, 0.0, 0.1, 0.0)
    assert left.shape == (120, 160, 3)
    assert np.abs(left.astype(int) - right).max() > 50
    np.testing.assert_array_equal(right, single.render())
    for each in (envs, envs, single):
        each.close()


def test_rendering_without_a_mode_warns():
    envs = CartPoleVectorEnv(2)
    envs.reset(seed=0)
    with pytest.warns(UserWarning, match="without specifying any render mode"):
        assert envs.render() is None
    envs.close()


@pytest.mark.long
def test_no_opengl_is_needed_whatever_the_environment_asks_for():
    code = (
        "import gymnasium, mjcartpole\n"
        f"envs = gymnasium.make_vec('{ENV_ID}', num_envs=2)\n"
        "envs.reset(seed=0)\n"
        "print(envs.step([0, 1])[1].tolist())"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "MUJOCO_GL": "nonsense"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.stdout, done.stderr) == ("[1.0, 1.0]\n", "")


@pytest.mark.parametrize("model", ["cartpole", "twopoles"])
@pytest.mark.parametrize("make", [CartPoleEnv, CartPoleVectorEnv])
def test_an_environment_that_nobody_holds_is_gone_at_once(make, model):
    """Found later by the garbage collector, in a forked process, MuJoCo would wait for its threads.

    They are not there, since a fork has none.
    """
    env = make(model=model)
    env.reset(seed=0)
    env.step([1] if make is CartPoleVectorEnv else 1)
    gone = weakref.ref(env)
    gc.disable()
    try:
        del env
        assert gone() is None
    finally:
        gc.enable()
