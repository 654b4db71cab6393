"""The name under which gymnasium knows the environment."""

import subprocess
import sys

import gymnasium
import pytest

import mjcartpole
from mjcartpole.envs.registration import ENV_ID, register


def test_registered_like_cartpole_v1():
    ours, reference = gymnasium.spec(ENV_ID), gymnasium.spec("CartPole-v1")
    assert ENV_ID == mjcartpole.ENV_ID == "mjcartpole/CartPole-v1"
    for field in ("max_episode_steps", "reward_threshold", "nondeterministic", "order_enforce"):
        assert getattr(ours, field) == getattr(reference, field)


def test_make_vec_knows_the_vector():
    assert gymnasium.spec(ENV_ID).vector_entry_point == "mjcartpole.envs.vector:CartPoleVectorEnv"


def test_registering_twice_does_nothing():
    before = gymnasium.registry[ENV_ID]
    register()
    assert gymnasium.registry[ENV_ID] is before


@pytest.mark.long
def test_one_word_brings_the_package_and_the_environment():
    """Where nothing of ours is imported yet, gymnasium does it."""
    code = (
        "import sys, gymnasium\n"
        "assert 'mjcartpole' not in sys.modules\n"
        "env = gymnasium.make('mjcartpole:mjcartpole/CartPole-v1', edits=['pole.length=1.5'])\n"
        "print(env.reset(seed=0)[0].shape, env.spec.id, env.spec.max_episode_steps)\n"
        "envs = gymnasium.make_vec('mjcartpole:mjcartpole/SwingUp-v0', num_envs=3)\n"
        "print(envs.reset(seed=0)[0].shape, type(envs.unwrapped).__name__)"
    )
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, check=False, text=True)
    assert done.stdout.splitlines() == [
        "(4,) mjcartpole/CartPole-v1 500",
        "(3, 4) CartPoleVectorEnv",
    ], done.stderr
