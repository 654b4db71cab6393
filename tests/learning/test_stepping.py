"""One control step as compiled code, against the functions that it must equal bit for bit."""

import math
import struct

import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjcartpole import task
from mjcartpole.disturbances.disturbances import NONE
from mjcartpole.errors import SimulationError
from mjcartpole.learning import compiled, kernels, kinds, stepping
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.linking import link
from mjcartpole.learning.worlds import Worlds
from mjcartpole.physics.library import libmujoco
from mjcartpole.physics.load import load_model
from mjcartpole.physics.simulation import LARGEST_SANE, check_sane
from nightly import examples

quick = examples(200)
state_values = st.floats() | st.sampled_from(
    [
        *(sign * limit for sign in (1, -1) for limit in (2.4, task.CARTPOLE_V1.theta_limit)),
        *(math.nextafter(limit, 9) for limit in (2.4, task.CARTPOLE_V1.theta_limit)),
        *(LARGEST_SANE, -LARGEST_SANE, math.nextafter(LARGEST_SANE, 0), 1e308, -1e308, 0.0, -0.0),
    ]
)
states = st.tuples(*[state_values] * 4)
GYM = kinds.GymPhysics(-10.0, 10.0, 0.0)
WORLD = Worlds(load_model("twopoles"), "gym", task.CARTPOLE_V1, NONE)
POLES = WORLD.physics(None, 0)
TWO = WORLD._first.simulation
assert TWO is not None
assert link(libmujoco()) == ""


def bits(*values):
    return struct.pack(f"{len(values)}d", *values)


# What Numba chooses by the kind of physics can only be called from compiled code.


@numba.njit
def begin(physics, rules, rng):
    return stepping.begin(physics, rules, rng)


@numba.njit
def row(physics, rules, state, grid):
    return kernels._row_of(stepping.observe(physics, rules, state), grid)


RULES = compiled._rules(task.CARTPOLE_V1)
has_diverged, as_one_pole = numba.njit(stepping.has_diverged), numba.njit(stepping._as_one_pole)
is_over = numba.njit(stepping.is_over)


@given(st.integers(0, 2**63), st.sampled_from([(-0.05, 0.05), (0.0, 0.0), (-2.0, 1.0)]))
@quick
def test_starting_states_are_those_of_uniform(seed, bounds):
    rules = compiled._rules(task.Task("it", start_low=bounds[0], start_high=bounds[1]))
    ours, numpys = np.random.default_rng(seed), np.random.default_rng(seed)
    for _ in range(3):
        expected = numpys.uniform(*bounds, size=(4,))
        assert bits(*begin(GYM, rules, ours)) == expected.tobytes()
    assert ours.bit_generator.state == numpys.bit_generator.state


def test_the_starting_state_of_seed_0_is_gymnasiums():
    start = begin(GYM, RULES, np.random.default_rng(0))
    known = [0.01369617, -0.02302133, -0.04590265, -0.04834723]
    assert start == pytest.approx(known, abs=1e-8)


GRID = Discretizer((3, 3, 3, 3), (-2.0,) * 4, (2.0,) * 4)


@given(states)
@quick
def test_rows_are_those_of_the_float32_observation(state):
    with np.errstate(over="ignore"):
        seen = np.array(state).astype(np.float32).astype(np.float64)
    if np.isfinite(seen).all():
        assert row(GYM, RULES, state, compiled._arrays(GRID.grid)) == GRID(seen.tolist())


@given(states)
@quick
def test_an_episode_is_over_where_the_environment_ends_it(state):
    x, x_dot, theta, theta_dot = state
    inside = not task.CARTPOLE_V1.has_ended(x, theta)
    finite = math.isfinite(x_dot) and math.isfinite(theta_dot)
    finite = finite and math.isfinite(x) and math.isfinite(theta)
    over = is_over(RULES, state)
    # Two finite velocities of 1e308 may have no finite difference: diverged all the same.
    assert over is not (inside and finite) or (over and has_diverged(state))


@given(states)
@quick
def test_a_state_has_diverged_where_check_sane_says_so(state):
    try:
        check_sane(state, "it")
    except SimulationError:
        assert has_diverged(state)
    else:
        assert not has_diverged(state)


@pytest.mark.long
@given(st.integers(0, 2**63))
@quick
def test_starting_states_of_several_poles_are_those_of_uniform(seed):
    ours, numpys = np.random.default_rng(seed), np.random.default_rng(seed)
    expected = numpys.uniform(-0.05, 0.05, size=6)
    start = begin(POLES, RULES, ours)
    assert TWO.state.tobytes() == expected.tobytes()
    assert start == (*expected[:2], np.abs(expected[2::2]).max(), np.abs(expected[3::2]).max())


@pytest.mark.long
@given(st.lists(st.floats(-3.0, 3.0), min_size=6, max_size=6))
@quick
def test_several_poles_are_observed_as_they_are(state):
    grid = Discretizer((3,) * 6, (-2.0,) * 6, (2.0,) * 6)
    TWO.state = state
    seen = np.array(state).astype(np.float32).astype(np.float64)
    assert row(POLES, RULES, (0.0,) * 4, compiled._arrays(grid.grid)) == grid(seen.tolist())


def farthest(*angles):
    """The angle of one pole in the place of two, as compiled code reads them."""
    TWO.data.qpos[list(TWO.cartpole.joints[1:])] = angles
    return as_one_pole(POLES, RULES)[2]


@pytest.mark.parametrize("values", [(0.0, 0.0), (-3.0, 2.0), (2.0, -3.0), (1e-320, -1e308)])
def test_the_farthest_value(values):
    assert task.max_abs([]) == 0.0
    assert farthest(*values) == task.max_abs(values) == max(map(abs, values))


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", [0, 1])
def test_the_farthest_value_loses_no_nan(bad, place):
    values = [0.1, -0.2]
    values[place] = bad
    assert math.isnan(task.max_abs(values))
    assert math.isnan(farthest(*values))
