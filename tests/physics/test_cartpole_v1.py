"""CartPole-v1's step, to the last bit: gymnasium's, ours, and ours compiled."""

import gymnasium
import numba
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from mjcartpole.learning import stepping
from mjcartpole.physics.cartpole_v1 import FORCE, cartpole_v1_step
from nightly import examples

GYM = gymnasium.make("CartPole-v1", disable_env_checker=True).unwrapped


def gyms_step(state, action):
    GYM.reset()
    GYM.state = np.array(state)
    with np.errstate(over="ignore"):  # of its float32 observation
        GYM.step(action)
    return np.array(GYM.state).tobytes()


def our_step(step, state, action):
    return np.array(step(*state, FORCE if action == 1 else -FORCE)).tobytes()


compiled_step = numba.njit(error_model="numpy")(stepping._cartpole_v1_step)


@numba.njit
def compiled_trigonometry(values, cos, sin):
    for index in range(len(values)):
        cos[index], sin[index] = np.cos(values[index]), np.sin(values[index])


# The square of larger ones overflows, which numpy's scalars warn of.
anything = st.floats(-1e100, 1e100)


@given(st.tuples(*[anything] * 4), st.integers(0, 1))
@examples(500)
@example((0.0, -0.0, -0.0, 0.0), 0)
@example((2.4, 1e-310, 0.2095, -5e-324), 1)
def test_any_state_moves_as_in_gymnasium(state, action):
    expected = gyms_step(state, action)
    assert our_step(cartpole_v1_step, state, action) == expected
    assert our_step(compiled_step, state, action) == expected


@pytest.mark.parametrize("scale", [1e-8, 0.01, 1.0, 100.0])
def test_thousands_of_states_move_as_in_gymnasium(scale):
    rng = np.random.default_rng(4)
    states = rng.uniform(-1, 1, size=(2_000, 4)) * scale * np.array([4.8, 4, 0.42, 4])
    for state, action in zip(states.tolist(), rng.integers(2, size=2_000).tolist(), strict=True):
        expected = gyms_step(state, action)
        assert our_step(cartpole_v1_step, state, action) == expected
        assert our_step(compiled_step, state, action) == expected


def test_whole_episodes_are_gymnasiums():
    env = gymnasium.make("CartPole-v1")
    rng = np.random.default_rng(1)
    for seed in range(10):
        env.reset(seed=seed)
        plain = compiled = tuple(env.unwrapped.state.tolist())
        for action in rng.integers(2, size=200).tolist():
            _, _, terminated, *_ = env.step(action)
            force = FORCE if action == 1 else -FORCE
            plain, compiled = (
                cartpole_v1_step(*plain, force),
                compiled_step(*compiled, force),
            )
            expected = env.unwrapped.state.tobytes()
            assert np.array(plain).tobytes() == np.array(compiled).tobytes() == expected
            if terminated:
                break
        assert terminated


@pytest.mark.parametrize("scale", [1e-3, 0.21, 1.0, 10.0, 1e6, 1e300])
def test_sine_and_cosine_are_numpys(scale):
    values = np.random.default_rng(2).uniform(-scale, scale, 20_000)
    cos, sin = np.empty_like(values), np.empty_like(values)
    compiled_trigonometry(values, cos, sin)
    assert cos.tobytes() == np.array([np.cos(value) for value in values]).tobytes()
    assert sin.tobytes() == np.array([np.sin(value) for value in values]).tobytes()
