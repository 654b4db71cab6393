"""The name under which gymnasium knows the environment."""

import gymnasium

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
