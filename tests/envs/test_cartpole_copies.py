"""Copies of an environment go on by themselves."""

import copy
import pickle

import cloudpickle
import gymnasium
import numpy as np
import pytest

from mjcartpole.envs.cartpole import CartPoleEnv
from mjcartpole.errors import (
    ResetNeededError,
)

ENV_ID = "mjcartpole/CartPole-v1"


def pickled(env):
    return pickle.loads(pickle.dumps(env))


def cloudpickled(env):
    return cloudpickle.loads(cloudpickle.dumps(env))


@pytest.mark.parametrize("copied", [copy.deepcopy, pickled, cloudpickled])
@pytest.mark.parametrize("model", ["cartpole", "twopoles", "friction"])
@pytest.mark.parametrize("integrator", ["gym", "mujoco"])
def test_a_copy_in_mid_episode_goes_on_bit_equal(copied, model, integrator):
    """The time limit, the generator and the episodes after this one included."""
    env = gymnasium.make(ENV_ID, model=model, integrator=integrator, max_episode_steps=15)
    env.reset(seed=3)
    env.action_space.seed(3)
    for turn in range(4):
        env.step(turn % 2)
    other = copied(copied(env))
    before = env.unwrapped.state
    ahead, behind = (play(each) for each in (other, env))
    for mine, theirs in zip(ahead, behind, strict=True):
        np.testing.assert_array_equal(mine[0], theirs[0])
        assert mine[1:] == theirs[1:]
    assert (before != env.unwrapped.state).any()


def play(env, steps=60):
    """Random actions over several episodes."""
    found = []
    for _ in range(steps):
        found.append(env.step(env.action_space.sample()))
        if found[-1][2] or found[-1][3]:
            found.append(env.reset())
    return found


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, pickled])
def test_a_copy_draws_with_a_renderer_of_its_own(copied):
    env = CartPoleEnv(render_mode="rgb_array", width=160, height=120)
    assert copied(env).state is None
    env.reset(seed=0)
    picture = env.render()
    other = copied(env)
    other.step(1)
    np.testing.assert_array_equal(env.render(), picture)
    env.step(1)
    env.close()
    np.testing.assert_array_equal(other.render(), env.render())
    other.close()
    env.close()


def test_a_copy_keeps_what_was_set_and_what_a_subclass_has():
    env = CartPoleEnv()
    env.x_threshold, env.length = 1.0, 2.0
    other = pickled(env)
    other.masspole = 0.3
    assert (other.x_threshold, other.length, env.masspole) == (1.0, 2.0, 0.1)
    other.reset(seed=0)
    with pytest.raises(ResetNeededError):
        env.step(0)
    assert pickled(Tagged()).tag == ["mine"]


class Tagged(CartPoleEnv):
    """With a name of its own."""

    def __init__(self):
        super().__init__()
        self.tag = ["mine"]


def test_a_copy_after_the_end_counts_on():
    env = CartPoleEnv()
    env.reset(seed=0)
    while not env.step(1)[2]:
        pass
    other = copy.deepcopy(env)
    assert env.steps_beyond_terminated == other.steps_beyond_terminated == 0
    with pytest.warns(UserWarning, match="already returned"):
        assert other.step(1)[1] == 0.0
    assert (env.steps_beyond_terminated, other.steps_beyond_terminated) == (0, 1)
