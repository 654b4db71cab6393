"""CartPole-v1's names on our environment, held against CartPole-v1 itself."""

import math
import warnings

import gymnasium
import numpy as np
import pytest

from mjcartpole.envs.cartpole import CartPoleEnv
from mjcartpole.errors import ConfigError, SettingError
from mjcartpole.physics.load import load_model

ENV_ID = "mjcartpole/CartPole-v1"
NAMES = [
    "gravity",
    "masscart",
    "masspole",
    "total_mass",
    "length",
    "polemass_length",
    "force_mag",
    "tau",
    "kinematics_integrator",
    "x_threshold",
    "theta_threshold_radians",
    "steps_beyond_terminated",
]


@pytest.mark.parametrize("name", NAMES)
def test_reading_gives_what_cartpole_v1_has(name):
    ours, gyms = gymnasium.make(ENV_ID), gymnasium.make("CartPole-v1")
    assert ours.has_wrapper_attr(name)
    assert ours.get_wrapper_attr(name) == gyms.get_wrapper_attr(name)


def test_reading_says_what_an_edited_model_has():
    env = CartPoleEnv(model="long", edits={"cart.mass": 3, "timestep": 0.01}, own_timestep=True)
    model = load_model("long").model
    assert env.masspole == model.body("pole").mass[0]
    assert env.length == model.body("pole").ipos[2] > 0.5
    assert (env.masscart, env.tau) == (3.0, 0.01)
    env.simulation.model.opt.gravity[2] = -5.0
    assert env.gravity == 5.0


def follow(env, name, value):
    """Set what CartPole-v1 caches, too."""
    setattr(env, name, value)
    env.total_mass = env.masspole + env.masscart
    env.polemass_length = env.masspole * env.length


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("gravity", 3.7),
        ("masscart", 2.5),
        ("masspole", 0.4),
        ("length", 1.25),
        ("force_mag", 25.0),
        ("tau", 0.013),
        ("kinematics_integrator", "semi-implicit"),
        ("x_threshold", 0.06),
        ("theta_threshold_radians", 0.9),
        ("theta_threshold_radians", math.inf),
    ],
)
def test_setting_moves_as_cartpole_v1_does(name, value):
    ours = gymnasium.make(ENV_ID).unwrapped
    gyms = gymnasium.make("CartPole-v1").unwrapped
    ours.reset(seed=3)
    setattr(ours, name, value)
    follow(gyms, name, value)
    for read_at in ("once", "after the reset"):
        assert getattr(ours, name) == value, read_at
        ours.reset(seed=3), gyms.reset(seed=3)
    for turn in range(40):
        (a, *ours_rest), (b, *gyms_rest) = ours.step(turn % 3 > 0), gyms.step(int(turn % 3 > 0))
        np.testing.assert_allclose(a, b, rtol=1e-5, atol=1e-6)
        assert ours_rest == gyms_rest
        if ours_rest[1]:
            break


def test_setting_has_its_effect_from_the_next_reset_and_adds_up():
    env = CartPoleEnv()
    env.reset(seed=0)
    free = CartPoleEnv()
    free.reset(seed=0)
    env.gravity, env.length = 1.0, 2.0
    np.testing.assert_array_equal(env.step(1)[0], free.step(1)[0])
    env.reset(seed=0)
    free.reset(seed=0)
    assert (env.gravity, env.length, env.simulation.cartpole.poles) == (1.0, 2.0, 1)
    assert (env.step(1)[0] != free.step(1)[0]).any()
    assert free.gravity == 9.8


def test_wrappers_set_and_read_through():
    env = gymnasium.make(ENV_ID)
    assert env.set_wrapper_attr("length", 0.75)
    assert env.unwrapped.length == env.get_wrapper_attr("length") == 0.75
    envs = gymnasium.make_vec(ENV_ID, num_envs=2, vectorization_mode="sync")
    envs.set_attr("masspole", [0.2, 0.3])
    assert envs.get_attr("masspole") == (0.2, 0.3)
    assert envs.get_attr("total_mass") == (1.2, 1.3)


@pytest.mark.parametrize("name", ["total_mass", "polemass_length"])
def test_what_follows_from_others_is_not_set(name):
    env = CartPoleEnv()
    with pytest.raises(SettingError, match="set one of these") as caught:
        setattr(env, name, 2.0)
    assert isinstance(caught.value, AttributeError)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("length", -1.0, "more than 0"),
        ("length", "long", "length cannot be 'long'"),
        ("masspole", [1.0, 2.0], "masspole cannot be"),
        ("gravity", None, "gravity cannot be None"),
        ("gravity", math.nan, "finite"),
        ("tau", 0, "more than 0"),
        ("force_mag", math.inf, "finite"),
        ("kinematics_integrator", "leapfrog", "available: euler, semi-implicit"),
        ("x_threshold", math.nan, "x_threshold must be"),
        ("theta_threshold_radians", 0, "theta_threshold_radians must be"),
    ],
)
def test_values_that_make_no_sense_change_nothing(name, value, message):
    env = CartPoleEnv()
    before = getattr(env, name)
    with pytest.raises(ConfigError, match=message):
        setattr(env, name, value)
    assert getattr(env, name) == before


def test_several_poles_have_a_number_each():
    env = CartPoleEnv(model="twopoles")
    assert len(env.masspole) == len(env.length) == len(env.polemass_length) == 2
    assert env.total_mass == pytest.approx(env.masscart + sum(env.masspole))
    env.length = (0.6, 0.4)
    env.reset(seed=0)
    assert env.length == (0.6, 0.4)
    with pytest.raises(ConfigError, match="one number each"):
        env.masspole = 0.1


def test_gravity_is_along_up():
    text = load_model("cartpole").xml.replace('gravity="0 0 -9.8"', 'gravity="0 0 9.8"')
    text = text.replace('pos="0 0 0.5"', 'pos="0 0 -0.5"')
    env = CartPoleEnv(model=text)
    assert env.gravity == 9.8
    with pytest.raises(ConfigError, match=r"not \+z.*option.gravity"):
        env.gravity = 3.0


def test_what_cannot_be_read_is_no_attribute():
    text = load_model("cartpole").xml.replace('ctrlrange="-1 1"', 'ctrlrange="-1 2"')
    assert not hasattr(CartPoleEnv(model=text), "force_mag")


@pytest.mark.parametrize("slip", ["mass_pole", "lenght", "x_treshold", "kinematic_integrator"])
def test_a_slip_is_an_error(slip):
    with pytest.raises(SettingError, match=f"no '{slip}', did you mean"):
        setattr(CartPoleEnv(), slip, 1.0)


def test_what_nothing_reads_is_a_word():
    env = CartPoleEnv()
    with pytest.warns(UserWarning, match="nothing reads"):
        env.friction = 0.1
    assert env.friction == 0.1


def test_a_subclass_and_a_wrapper_have_names_of_their_own():
    class Mine(CartPoleEnv):
        def __init__(self):
            super().__init__()
            self.mass_pole = self.friction = 1.0

    class Around(gymnasium.Wrapper):
        def __init__(self, env):
            super().__init__(env)
            self.lenght = 1.0

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert Around(Mine()).unwrapped.mass_pole == 1.0


def test_wider_limits_widen_the_space_of_observations():
    env, usual = CartPoleEnv(), CartPoleEnv().observation_space
    env.x_threshold = 1.0
    assert env.observation_space == usual
    env.x_threshold = 10.0
    assert env.observation_space.high[0] == 20.0
