"""What `reset(options=…)` takes."""

import math

import numpy as np
import pytest

from mjcartpole.envs.cartpole import CartPoleEnv
from mjcartpole.envs.options import reset_options, usual
from mjcartpole.envs.vector import CartPoleVectorEnv
from mjcartpole.errors import ConfigError
from mjcartpole.task import CARTPOLE_V1


def test_what_is_left_out_is_as_usual():
    usually = usual(CARTPOLE_V1)
    assert reset_options({}, usually) == usually == (-0.05, 0.05, ())
    assert reset_options({"low": np.array(-0.2)}, usually) == (-0.2, 0.05, ())


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


@pytest.mark.parametrize("make", [CartPoleEnv, CartPoleVectorEnv])
def test_a_start_of_nothing_but_zeros_has_no_wrong_sign(make):
    observation, _ = make().reset(seed=0, options={"low": 0.0, "high": -0.0})
    assert not observation.any()
