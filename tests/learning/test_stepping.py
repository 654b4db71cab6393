"""One control step as compiled code, against the functions that it must equal bit for bit."""

import math
import struct
import subprocess
import sys
import sysconfig
from pathlib import Path

import mujoco
import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mjcartpole import task
from mjcartpole.errors import SimulationError
from mjcartpole.learning import compiled, stepping
from mjcartpole.physics.library import libmujoco
from mjcartpole.physics.load import load_model
from mjcartpole.physics.simulation import LARGEST_SANE, Simulation, check_sane

quick = settings(max_examples=200)
state_values = st.floats() | st.sampled_from(
    [
        *(sign * limit for sign in (1, -1) for limit in (task.X_LIMIT, task.THETA_LIMIT)),
        *(math.nextafter(limit, 9) for limit in (task.X_LIMIT, task.THETA_LIMIT)),
        *(LARGEST_SANE, -LARGEST_SANE, math.nextafter(LARGEST_SANE, 0), 1e308, -1e308, 0.0, -0.0),
    ]
)
states = st.tuples(*[state_values] * 4)
GYM = stepping.GymPhysics(-10.0, 10.0)
TWO = Simulation(load_model("twopoles"))
POLES = compiled._physics(TWO)


def bits(*values):
    return struct.pack(f"{len(values)}d", *values)


# What Numba chooses by the kind of physics can only be called from compiled code.


@numba.njit
def draw_start(physics, rng):
    return stepping.draw_start(physics, rng)


@numba.njit
def observe(physics, state):
    return stepping.observe(physics, state)


@numba.njit
def is_over(physics, state):
    return stepping.is_over(physics, state)


def test_libmujoco_is_found_and_linked():
    library = libmujoco()
    assert library.is_file()
    assert library.parent == Path(mujoco.__file__).parent
    assert stepping.link(library) == ""
    assert stepping.link(library) == "", "a second time as well"


def test_no_library_is_a_reason():
    assert stepping.link(None) == "libmujoco was not found in the mujoco package"


def test_what_is_no_library_is_a_reason(tmp_path):
    (tmp_path / "libmujoco.so.1").write_text("words")
    for path in (tmp_path / "libmujoco.so.1", tmp_path / "nothing.so"):
        assert stepping.link(path).startswith("libmujoco cannot be linked: ")
        assert path.name in stepping.link(path)


def test_a_library_without_mj_step_is_a_reason():
    """In a process where nothing else has brought mj_step along."""
    extensions = sysconfig.get_config_var("EXT_SUFFIX")
    library = next(Path(np.__file__).parent.rglob(f"*{extensions}"))
    script = "import sys, pathlib; from mjcartpole.learning import stepping; print(stepping.link("
    done = subprocess.run(
        [sys.executable, "-c", f"{script}pathlib.Path(sys.argv[1])))", str(library)],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == f"'{library}' has no mj_step\n"


@given(st.integers(0, 2**63))
@quick
def test_starting_states_are_those_of_uniform(seed):
    ours, numpys = np.random.default_rng(seed), np.random.default_rng(seed)
    for _ in range(3):
        expected = numpys.uniform(task.RESET_LOW, task.RESET_HIGH, size=(4,))
        assert bits(*draw_start(GYM, ours)) == expected.tobytes()
    assert ours.bit_generator.state == numpys.bit_generator.state


def test_the_starting_state_of_seed_0_is_gymnasiums():
    start = draw_start(GYM, np.random.default_rng(0))
    known = [0.01369617, -0.02302133, -0.04590265, -0.04834723]
    assert start == pytest.approx(known, abs=1e-8)


@given(states)
@quick
def test_observations_are_rounded_to_float32(state):
    with np.errstate(over="ignore"):
        expected = np.array(state).astype(np.float32).astype(np.float64)
    np.testing.assert_array_equal(observe(GYM, state), expected)


@given(states)
@quick
def test_an_episode_is_over_where_the_environment_ends_it(state):
    x, x_dot, theta, theta_dot = state
    inside = abs(x) <= task.X_LIMIT and abs(theta) <= task.THETA_LIMIT
    finite = math.isfinite(x_dot) and math.isfinite(theta_dot)
    over = is_over(GYM, state)
    # Two finite velocities of 1e308 may have no finite difference: diverged all the same.
    assert over is not (inside and finite) or (over and stepping.has_diverged(state))
    assert stepping._has_terminated(x, theta) is task.has_terminated(x, theta)


@given(states)
@quick
def test_a_state_has_diverged_where_check_sane_says_so(state):
    try:
        check_sane(state, "it")
    except SimulationError:
        assert stepping.has_diverged(state)
    else:
        assert not stepping.has_diverged(state)


@given(st.integers(0, 2**63))
@quick
def test_starting_states_of_several_poles_are_those_of_uniform(seed):
    ours, numpys = np.random.default_rng(seed), np.random.default_rng(seed)
    expected = numpys.uniform(task.RESET_LOW, task.RESET_HIGH, size=6)
    assert draw_start(POLES, ours).tobytes() == expected.tobytes()


@given(st.lists(state_values | st.floats(-0.2, 0.2), min_size=6, max_size=6))
@quick
def test_several_poles_are_observed_and_judged_as_one_is(state):
    """An episode is over where it would be with one of the poles alone, or has diverged."""
    values = np.array(state)
    with np.errstate(over="ignore"):
        expected = values.astype(np.float32).astype(np.float64)
    np.testing.assert_array_equal(observe(POLES, values), expected)
    alone = [is_over(GYM, (*state[:2], *state[at : at + 2])) for at in (2, 4)]
    # Two velocities of 1e308 may have no finite sum: diverged all the same.
    diverged = stepping.has_diverged(values)
    assert is_over(POLES, values) is any(alone) or diverged
    assert diverged is not all(-LARGEST_SANE < value < LARGEST_SANE for value in state)


@pytest.mark.parametrize("values", [[], [0.0], [-3.0, 2.0], [2.0, -3.0], [1e-320, -1e308]])
def test_the_farthest_value(values):
    expected = max(map(abs, values), default=0.0)
    assert task.max_abs(values) == expected
    assert stepping._farthest(np.array(values)) == expected


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", [0, 1, 2])
def test_the_farthest_value_loses_no_nan(bad, place):
    values = [0.1, -0.2, 0.3]
    values[place] = bad
    assert math.isnan(task.max_abs(values))
    assert math.isnan(stepping._farthest(np.array(values)))
