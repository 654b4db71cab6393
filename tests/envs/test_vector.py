"""The vector of environments: its interface, its rules, and what it refuses."""

import doctest

import gymnasium
import mujoco
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from mjcartpole.envs import vector
from mjcartpole.envs.vector import CartPoleVectorEnv
from mjcartpole.errors import (
    ConfigError,
    InvalidActionError,
    ModelNotFoundError,
    RenderError,
    ResetNeededError,
    SettingError,
    SimulationError,
)
from mjcartpole.task import CARTPOLE_V1
from vectors import ENV_ID, REFERENCE, TOUCHING, changed_text, run


def test_the_specification_in_the_docstring_holds():
    assert doctest.testmod(vector).failed == 0
    assert doctest.testmod(vector).attempted > 5


def test_make_vec_gives_it():
    envs = gymnasium.make_vec(ENV_ID, num_envs=3)
    reference = gymnasium.make_vec("CartPole-v1", num_envs=3)
    assert isinstance(envs, CartPoleVectorEnv)
    for name in ("num_envs", "max_episode_steps", "metadata"):
        assert getattr(envs, name) == getattr(reference, name)
    for name in ("action_space", "observation_space"):
        assert getattr(envs, name) == getattr(reference, name)
        assert getattr(envs, f"single_{name}") == getattr(reference, f"single_{name}")
    assert envs.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    assert gymnasium.make_vec(ENV_ID, num_envs=2, max_episode_steps=7).max_episode_steps == 7


def test_single_environments_can_still_be_put_together():
    envs = gymnasium.make_vec(ENV_ID, num_envs=2, vectorization_mode="sync")
    assert isinstance(envs, SyncVectorEnv)
    assert len(run(envs, 30)) == 31
    envs.close()


@pytest.mark.parametrize("steps", [3, 5])
def test_a_reset_in_the_middle_or_at_the_end_starts_all_anew(steps):
    envs = CartPoleVectorEnv(3, max_episode_steps=5)
    envs.reset(seed=1)
    for _ in range(steps):
        envs.step([0, 1, 0])
    envs.reset()
    flags = [envs.step([0, 1, 0])[1:4] for _ in range(5)]
    assert [rewards.tolist() for rewards, *_ in flags] == [[1.0] * 3] * 5
    assert [truncations.all() for *_, truncations in flags] == [False] * 4 + [True]


def test_bounds_of_the_start_hold_until_the_next_reset():
    options = {"low": 0.01, "high": 0.02}
    envs = gymnasium.make_vec(ENV_ID, num_envs=8, max_episode_steps=2)
    reference = gymnasium.make_vec("CartPole-v1", num_envs=8, max_episode_steps=2)
    for each in (envs, reference):
        first, _ = each.reset(seed=3, options=options)
        for _ in range(3):
            again, *_ = each.step(np.ones(8, dtype=int))
        for observations in (first, again):
            assert observations.min() >= 0.01
            assert observations.max() <= 0.02
    np.testing.assert_array_equal(again.T, envs.state.astype(np.float32))
    assert envs.reset(seed=3)[0].min() < 0


def mask(*values):
    return np.array(values, dtype=bool)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"low": 1.0, "high": 0.0}, r"Lower bound \(1.0\) must be lower"),
        ({"low": "x"}, r"An option \(x\) could not be converted"),
        ({"edits": {"pole.length": 1}}, "no option 'edits'; available: low, high, reset_mask"),
        ({"reset_mask": [True, False]}, "array of 2 booleans"),
        ({"reset_mask": np.array([1, 0])}, "array of 2 booleans"),
        ({"reset_mask": mask(True)}, "array of 2 booleans"),
        ({"reset_mask": mask(False, False)}, "one at least True"),
    ],
)
def test_options_that_make_no_sense(options, message):
    envs = CartPoleVectorEnv(2)
    envs.reset(seed=3)
    before = envs.state, envs.np_random.bit_generator.state
    with pytest.raises(ConfigError, match=message):
        envs.reset(seed=4, options=options)
    # Nothing has been reset by half.
    np.testing.assert_array_equal(envs.state, before[0])
    assert envs.np_random.bit_generator.state == before[1]


def test_a_mask_says_who_starts():
    envs = CartPoleVectorEnv(3, max_episode_steps=4)
    with pytest.raises(ResetNeededError, match="without reset_mask first"):
        envs.reset(options={"reset_mask": mask(True, False, True)})
    envs.reset(seed=0)
    for _ in range(3):
        envs.step([0, 1, 0])
    before = envs.state
    options = {"reset_mask": mask(True, False, True), "low": 0.01, "high": 0.02}
    observations, _ = envs.reset(options=options)
    np.testing.assert_array_equal(envs.state[:, 1], before[:, 1])
    np.testing.assert_array_equal(observations.T, envs.state.astype(np.float32))
    assert (envs.state[:, [0, 2]] >= 0.01).all()
    assert (envs.state[:, [0, 2]] <= 0.02).all()
    truncations = [envs.step([0, 1, 0])[3].tolist() for _ in range(5)]
    assert truncations[0] == [False, True, False]
    assert truncations[3] == [True, False, True]
    # Those who are started by hand at their end do not start by themselves once more.
    observations, _ = envs.reset(options={"reset_mask": mask(False, True, False)})
    assert envs.step([0, 1, 0])[1].tolist() == [1.0, 1.0, 1.0]


def test_a_start_beyond_the_limits_ends_with_the_step_after_it():
    envs = CartPoleVectorEnv(2, max_episode_steps=1)
    envs.reset(seed=0, options={"low": 1.0, "high": 1.1})
    flags = [envs.step(np.zeros(2, dtype=int))[1:4] for _ in range(3)]
    assert [terminations.all() for _, terminations, _ in flags] == [True, False, True]
    assert [rewards.tolist() for rewards, *_ in flags] == [[1, 1], [0, 0], [1, 1]]


@pytest.mark.parametrize("place", [0, 2])
@pytest.mark.parametrize("sign", [-1, 1])
def test_limits_are_strict(place, sign):
    envs = CartPoleVectorEnv(2)
    limit = (CARTPOLE_V1.x_limit, 0, CARTPOLE_V1.theta_limit)[place]
    states = np.zeros((4, 2))
    states[place] = sign * limit, sign * np.nextafter(limit, np.inf)
    envs.state = states
    assert envs.step([0, 1])[2].tolist() == [False, True]


def test_what_was_returned_is_never_written_again():
    envs = CartPoleVectorEnv(16, max_episode_steps=9)
    results, copies = [], []
    envs.reset(seed=0)
    for _ in range(40):
        results.append((*envs.step(np.ones(16, dtype=int))[:4], envs.state))
        copies.append([array.copy() for array in results[-1]])
    for result, copied in zip(results, copies, strict=True):
        for array, before in zip(result, copied, strict=True):
            np.testing.assert_array_equal(array, before)


def test_what_was_returned_may_be_written():
    envs, untouched = (
        CartPoleVectorEnv(4, max_episode_steps=3),
        CartPoleVectorEnv(4, max_episode_steps=3),
    )
    for each in (envs, untouched):
        each.reset(seed=0)
    for _ in range(10):
        results = envs.step(np.ones(4, dtype=int))
        expected = untouched.step(np.ones(4, dtype=int))
        for array, other in zip(results[:4], expected[:4], strict=True):
            np.testing.assert_array_equal(array, other)
            array[...] = 1


def test_observations_are_contiguous():
    envs = CartPoleVectorEnv(4)
    assert envs.reset(seed=0)[0].flags.c_contiguous
    assert envs.step([0, 1, 0, 1])[0].flags.c_contiguous


GOOD_ACTIONS = [
    np.array([0, 1]),
    np.array([0, 1], dtype=np.int8),
    np.array([0, 1], dtype=np.int32),
    np.array([0, 1], dtype=np.uint32),
    np.array([False, True]),
    np.array([[0, 5], [1, 5]])[:, 0],
    [0, 1],
    (0, True),
]


BAD_ACTIONS = [
    np.array([0, 2]),
    np.array([-1, 1]),
    np.array([1, -1]),
    np.array([2, 3]),
    np.array([-2, 3]),
    np.array([0, 2**40]),
    np.array([0, 1], dtype=np.uint64),
    np.array([0.0, 1.0]),
    np.array([[0, 1]]),
    np.array([0]),
    np.array([0, 1, 0]),
    np.array(["0", "1"]),
    [0, 2],
    [0.0, 1.0],
    [0],
    1,
    None,
]


@pytest.mark.parametrize("actions", GOOD_ACTIONS, ids=repr)
def test_actions_that_the_space_contains(actions):
    envs = CartPoleVectorEnv(2)
    envs.state = np.zeros((4, 2))
    assert envs.action_space.contains(actions)
    envs.step(actions)
    assert np.sign(envs.state[1]).tolist() == [-1, 1]


@pytest.mark.parametrize("actions", BAD_ACTIONS, ids=repr)
def test_actions_that_the_space_does_not_contain(actions):
    envs = CartPoleVectorEnv(2)
    envs.reset(seed=0)
    before = envs.state
    with pytest.raises(InvalidActionError, match="2 integers, each 0 or 1"):
        envs.step(actions)
    np.testing.assert_array_equal(envs.state, before)


def test_a_step_needs_a_reset():
    envs = CartPoleVectorEnv(2)
    assert envs.state is None
    with pytest.raises(ResetNeededError, match="Call reset before"):
        envs.step(np.array([0, 1]))


def test_a_state_set_between_steps_leaves_the_episodes_as_they_are():
    envs = CartPoleVectorEnv(2, max_episode_steps=2)
    envs.reset(seed=0)
    envs.step([0, 1])
    envs.state = np.zeros((4, 2))
    assert envs.step([0, 1])[3].all()
    envs.state = np.full((4, 2), np.nan)
    # They restart, so what they were in does not matter.
    assert envs.step([0, 1])[1].tolist() == [0.0, 0.0]
    assert np.abs(envs.state).max() <= 0.05


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e11])
@pytest.mark.parametrize("place", range(4))
def test_an_environment_that_diverged_is_named(bad, place):
    envs = CartPoleVectorEnv(3)
    states = np.zeros((4, 3))
    states[place, 1] = bad
    envs.state = states
    with pytest.raises(SimulationError, match=r"cartpole \(environment 1 of 3\) diverged"):
        envs.step([0, 1, 0])
    envs.reset(seed=0)
    assert np.isfinite(envs.step([0, 1, 0])[0]).all()


@pytest.mark.parametrize("integrator", ["gym", "mujoco"])
def test_a_diverging_model_is_an_error_on_any_thread(integrator):
    massless = REFERENCE.replace('mass="1.0"', 'mass="1e-12"').replace('gear="10"', 'gear="1e14"')
    envs = CartPoleVectorEnv(64, model=massless, integrator=integrator, threads=4)
    envs.reset(seed=0)
    with pytest.raises(SimulationError, match=r"environment 0 of 64"):
        for _ in range(3):
            envs.step(np.ones(64, dtype=int))


@pytest.mark.parametrize("threads", [1, None])
@pytest.mark.parametrize("integrator", ["gym", "mujoco"])
def test_what_mujoco_gives_up_on_is_an_error_of_ours(integrator, threads):
    # Too little memory for the contacts with the stops.
    tight = changed_text(*TOUCHING, ("<option", '<size memory="7000"/><option'))
    # A document that asks for that is refused; a specification is the caller's own.
    model = mujoco.MjSpec.from_string(tight)
    envs = CartPoleVectorEnv(8, model=model, integrator=integrator, threads=threads)
    envs.state = np.tile([[2.3], [3.0], [0.0], [0.0]], 8)
    with pytest.raises(SimulationError, match="MuJoCo gave up on"):
        for _ in range(10):
            envs.step(np.ones(8, dtype=int))


def test_names_of_cartpole_v1_are_read_and_not_set_in_vain():
    envs = gymnasium.make_vec(ENV_ID, num_envs=2, edits=["pole.length=1.5"]).unwrapped
    assert (envs.length, envs.masspole, envs.gravity, envs.tau) == (0.75, 0.1, 9.8, 0.02)
    assert (envs.x_threshold, envs.theta_threshold_radians) == (2.4, 12 * 2 * np.pi / 360)
    for name in ("length", "gravity", "x_threshold", "lenght"):
        with pytest.raises(SettingError, match="many environments cannot be set; make them with"):
            setattr(envs, name, 5.0)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = envs.nothing
    envs.own_note = "kept"
    assert envs.own_note == "kept"


def test_edits_may_be_texts():
    envs = gymnasium.make_vec(ENV_ID, num_envs=2, edits=["pole.length=1.5"])
    assert envs.cartpole.name == "cartpole with pole.length=1.5"


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"model": "nothing"}, ModelNotFoundError, "no model is called 'nothing'"),
        ({"integrator": "rk4"}, ConfigError, "available: gym, mujoco"),
        ({"render_mode": "human"}, ConfigError, "available: None, 'rgb_array'"),
        ({"render_mode": "depth"}, ConfigError, 'vectorization_mode="sync"'),
        (
            {"edits": [{"pole.length": 1.0}, {}]},
            ConfigError,
            "one mapping.*not {'pole.length': 1.0}",
        ),
        ({"edits": 5}, ConfigError, "one mapping.*not 5"),
        ({"num_envs": 0}, ConfigError, "num_envs 0 makes no sense"),
        ({"num_envs": 2.0}, ConfigError, "num_envs 2.0 makes no sense"),
        ({"max_episode_steps": 0}, ConfigError, "max_episode_steps 0 makes no sense"),
        ({"threads": 0}, ConfigError, "threads 0 makes no sense; it is a whole number from 1"),
        ({"threads": -1}, ConfigError, "threads -1"),
        ({"threads": "all"}, ConfigError, "threads 'all'"),
        ({"camera": "moon"}, RenderError, r"moon.*side"),
        ({"width": 0}, RenderError, "no size of a picture"),
        ({"colour": "red"}, TypeError, "colour"),
    ],
)
def test_arguments_that_make_no_sense(arguments, error, message):
    with pytest.raises(error, match=message):
        CartPoleVectorEnv(**arguments)


def test_one_environment_is_a_vector_too():
    envs = gymnasium.make_vec(ENV_ID)
    observations, _ = envs.reset(seed=0)
    assert observations.shape == (1, 4)
    observations, rewards, *_ = envs.step(envs.action_space.sample())
    assert (observations.shape, rewards.shape) == ((1, 4), (1,))
