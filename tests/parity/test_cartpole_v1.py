"""The environment against gymnasium's CartPole-v1, the real one."""

import math
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_match import check_environments_match

from mjcartpole.physics.load import load_model
from mjcartpole.task import CARTPOLE_V1
from nightly import at_night, few

KINEMATICS = {"gym": "euler", "mujoco": "semi-implicit"}


def pair(integrator="gym", **arguments):
    """Our env and gymnasium's, as `make` makes them."""
    ours = gymnasium.make("mjcartpole/CartPole-v1", integrator=integrator, **arguments)
    reference = gymnasium.make("CartPole-v1", **arguments)
    reference.unwrapped.kinematics_integrator = KINEMATICS[integrator]
    return ours, reference


def set_state(env, state):
    """Put either env into a state, in the middle of an episode."""
    env.reset()
    env.unwrapped.state = np.array(state)


def test_spaces_and_metadata():
    ours, reference = pair()
    assert ours.observation_space == reference.observation_space
    assert ours.observation_space.dtype == np.float32
    assert ours.action_space == reference.action_space
    assert ours.metadata == reference.metadata


def test_first_observations_for_many_seeds():
    ours, reference = pair()
    for seed in range(200):
        first, info = ours.reset(seed=seed)
        expected, expected_info = reference.reset(seed=seed)
        assert first.dtype == expected.dtype
        np.testing.assert_array_equal(first, expected)
        assert info == expected_info
        np.testing.assert_array_equal(ours.reset()[0], reference.reset()[0])


def test_known_first_state():
    ours, _ = pair()
    ours.reset(seed=0)
    known = [0.01369617, -0.02302133, -0.04590265, -0.04834723]
    np.testing.assert_allclose(ours.unwrapped.state, known, atol=5e-9)


@pytest.mark.parametrize(
    "options",
    [{"low": -0.2, "high": 0.2}, {"low": -0.01}, {"high": 1}, {}, {"low": "0", "high": 0}],
)
def test_first_observations_for_other_bounds(options):
    ours, reference = pair()
    for seed in range(20):
        np.testing.assert_array_equal(
            ours.reset(seed=seed, options=options)[0],
            reference.reset(seed=seed, options=options)[0],
        )


@pytest.mark.parametrize(
    "options", [{"low": 1, "high": -1}, {"low": "a"}, {"high": None}, {"low": [0, 0]}]
)
def test_bounds_are_refused_alike(options):
    messages = []
    for env in pair():
        with pytest.raises(ValueError) as caught:
            env.reset(seed=0, options=options)
        messages.append(str(caught.value))
    assert messages[0] == messages[1]


@pytest.mark.parametrize("integrator", ["gym", "mujoco"])
@pytest.mark.parametrize("sutton_barto", few([False, True], False))
def test_teacher_forced_transitions(integrator, sutton_barto):
    ours, reference = (env.unwrapped for env in pair(integrator, sutton_barto_reward=sutton_barto))
    rng = np.random.default_rng(12)
    box = np.array([2.5, 4.0, 0.22, 4.0])
    for _ in range(at_night(5_000, fast=1_000)):
        state, action = rng.uniform(-box, box), int(rng.integers(2))
        set_state(ours, state)
        set_state(reference, state)
        got, expected = ours.step(action), reference.step(action)
        np.testing.assert_allclose(ours.state, reference.state, rtol=0, atol=1e-12)
        np.testing.assert_array_equal(got[0], expected[0])
        assert got[1:] == expected[1:]
        assert [type(value) for value in got] == [type(value) for value in expected]


@pytest.mark.parametrize("integrator", ["gym", "mujoco"])
def test_whole_episodes_over_the_meaningful_horizon(integrator):
    """Rounding grows by about e^(3.8 t): 1e-16 is 1e-9 after 200 steps, far below float32."""
    for seed in range(at_night(20, fast=6)):
        ours, reference = pair(integrator)
        check_environments_match(ours, reference, num_steps=100, seed=seed, skip_render=True)


UP = math.inf
LIMITS = [
    (place, sign * limit)
    for place, limit in ((0, CARTPOLE_V1.x_limit), (2, CARTPOLE_V1.theta_limit))
    for sign in (1, -1)
]


@pytest.mark.parametrize(("place", "limit"), LIMITS)
@pytest.mark.parametrize("sutton_barto", [False, True])
def test_both_sides_of_every_limit(place, limit, sutton_barto):
    """With zero velocity, explicit Euler leaves the positions where they are, to the last bit."""
    outcomes = []
    for value in (math.nextafter(limit, 0), limit, math.nextafter(limit, limit * UP)):
        state = [0.0] * 4
        state[place] = value
        ours, reference = pair(sutton_barto_reward=sutton_barto)
        set_state(ours, state)
        set_state(reference, state)
        got, expected = ours.step(1), reference.step(1)
        assert got[1:] == expected[1:]
        np.testing.assert_array_equal(got[0], expected[0])
        outcomes.append(got[2])
    assert outcomes == [False, False, True]


def fall(env, steps):
    """Push right until the end and `steps` beyond it; returns what `step` gave, and warnings."""
    env.reset(seed=4)
    results, terminated = [], False
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        while not terminated:
            results.append(env.step(1))
            terminated = results[-1][2]
        results += [env.step(1) for _ in range(steps)]
    return results, [str(warning.message) for warning in caught]


@pytest.mark.parametrize("sutton_barto", [False, True])
def test_at_and_beyond_the_end(sutton_barto):
    (ours, our_warnings), (reference, its_warnings) = (
        fall(env.unwrapped, 5) for env in pair(sutton_barto_reward=sutton_barto)
    )
    assert [step[1:] for step in ours] == [step[1:] for step in reference]
    for got, expected in zip(ours, reference, strict=True):
        np.testing.assert_array_equal(got[0], expected[0])
    assert our_warnings == its_warnings
    assert len(our_warnings) == 1
    assert [step[1] for step in ours][-6:] == ([-1.0] * 6 if sutton_barto else [1.0] + [0.0] * 5)


def test_a_state_that_comes_back_into_play_is_paid_again():
    ours, reference = (env.unwrapped for env in pair())
    results = []
    for env in (ours, reference):
        set_state(env, [3.0, 0.0, 0.0, 0.0])
        first = env.step(1)
        env.state = np.array([0.0, 0.0, 0.0, 0.0])
        second = env.step(1)
        env.state = np.array([3.0, 0.0, 0.0, 0.0])
        with pytest.warns(UserWarning, match="already returned terminated"):
            third = env.step(1)
        results.append([step[1:3] for step in (first, second, third)])
    assert results[0] == results[1] == [(1.0, True), (1.0, False), (0.0, True)]


def test_the_time_limit():
    def balance(env):
        observation, _ = env.reset(seed=0)
        steps, over = 0, False
        while not over:
            x, x_dot, theta, theta_dot = observation
            lean = theta + 0.5 * theta_dot + 0.02 * x + 0.05 * x_dot
            observation, _, terminated, truncated, _ = env.step(int(lean > 0))
            steps, over = steps + 1, terminated or truncated
        return steps, terminated, truncated

    ours, reference = pair()
    assert balance(ours) == balance(reference) == (500, False, True)


@pytest.mark.parametrize("action", [2, -1, 1.0, "1", None, np.array([0, 1])])
def test_actions_are_refused_alike(action):
    for env in pair():
        env.reset(seed=0)
        with pytest.raises(AssertionError, match="invalid"):
            env.unwrapped.step(action)


def test_steps_before_reset_are_refused_alike():
    for env in pair():
        with pytest.raises(AssertionError, match="Call reset before using step method"):
            env.unwrapped.step(0)


def test_dm_control_steps_the_same_document_to_the_same_bits():
    cartpole = load_model("cartpole")
    dm_control = pytest.importorskip("mjcartpole.physics.dm_control", exc_type=ImportError)
    physics = dm_control.mujoco.Physics.from_xml_string(cartpole.xml)
    ours = gymnasium.make("mjcartpole/CartPole-v1", integrator="mujoco").unwrapped
    ours.reset(seed=0)
    state = ours.state
    physics.data.qpos[:] = state[[0, 2]]
    physics.data.qvel[:] = state[[1, 3]]
    rng = np.random.default_rng(0)
    for _ in range(200):
        action = int(rng.integers(2))
        physics.set_control([cartpole.controls[action]])
        physics.legacy_step = False
        physics.step()
        ours.simulation.step(cartpole.controls[action])
        expected = [*physics.data.qpos, *physics.data.qvel]
        assert ours.state[[0, 2, 1, 3]].tolist() == expected
