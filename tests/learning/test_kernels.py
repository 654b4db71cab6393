"""The pieces of the compiled loop, one by one, against what they stand for."""

import hashlib
import inspect
import math
import os
import shutil
import struct
import subprocess
import sys
import sysconfig
import textwrap
from pathlib import Path

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba.core.registry import cpu_target

from mjcartpole import task
from mjcartpole.errors import SimulationError
from mjcartpole.learning import discretizer, episodes, kernels, qlearning, schedules
from mjcartpole.learning.compiled import _arrays
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.physics import cartpole_v1
from mjcartpole.physics.library import libmujoco
from mjcartpole.physics.simulation import LARGEST_SANE, check_sane

quick = settings(deadline=None, max_examples=200)
state_values = st.floats() | st.sampled_from(
    [
        *(sign * limit for sign in (1, -1) for limit in (task.X_LIMIT, task.THETA_LIMIT)),
        *(math.nextafter(limit, 9) for limit in (task.X_LIMIT, task.THETA_LIMIT)),
        *(LARGEST_SANE, -LARGEST_SANE, math.nextafter(LARGEST_SANE, 0), 1e308, -1e308, 0.0, -0.0),
    ]
)
states = st.tuples(*[state_values] * 4)


def bits(*values):
    return struct.pack(f"{len(values)}d", *values)


def test_libmujoco_is_found_and_linked():
    library = libmujoco()
    assert library.is_file()
    assert library.parent == Path(mujoco.__file__).parent
    assert kernels.link(library) == ""
    assert kernels.link(library) == "", "a second time as well"


def test_no_library_is_a_reason():
    assert kernels.link(None) == "libmujoco was not found in the mujoco package"


def test_what_is_no_library_is_a_reason(tmp_path):
    (tmp_path / "libmujoco.so.1").write_text("words")
    for path in (tmp_path / "libmujoco.so.1", tmp_path / "nothing.so"):
        assert kernels.link(path).startswith("libmujoco cannot be linked: ")
        assert path.name in kernels.link(path)


def test_a_library_without_mj_step_is_a_reason():
    """In a process where nothing else has brought mj_step along."""
    extensions = sysconfig.get_config_var("EXT_SUFFIX")
    library = next(Path(np.__file__).parent.rglob(f"*{extensions}"))
    script = "import sys, pathlib; from mjcartpole.learning import kernels; print(kernels.link("
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
        assert bits(*kernels._draw_start(ours)) == expected.tobytes()
    assert ours.bit_generator.state == numpys.bit_generator.state


def test_the_starting_state_of_seed_0_is_gymnasiums():
    start = kernels._draw_start(np.random.default_rng(0))
    known = [0.01369617, -0.02302133, -0.04590265, -0.04834723]
    assert start == pytest.approx(known, abs=1e-8)


@given(states)
@quick
def test_observations_are_rounded_to_float32(state):
    with np.errstate(over="ignore"):
        expected = np.array(state).astype(np.float32).astype(np.float64)
    np.testing.assert_array_equal(kernels._observe(state), expected)


@given(states)
@quick
def test_an_episode_is_over_where_the_environment_ends_it(state):
    x, x_dot, theta, theta_dot = state
    inside = abs(x) <= task.X_LIMIT and abs(theta) <= task.THETA_LIMIT
    finite = math.isfinite(x_dot) and math.isfinite(theta_dot)
    over = kernels._is_over(state)
    # Two finite velocities of 1e308 may have no finite difference: diverged all the same.
    assert over is not (inside and finite) or (over and kernels._has_diverged(state))
    assert kernels._has_terminated(x, theta) is task.has_terminated(x, theta)


@given(states)
@quick
def test_a_state_has_diverged_where_check_sane_says_so(state):
    try:
        check_sane(state, "it")
    except SimulationError:
        assert kernels._has_diverged(state)
    else:
        assert not kernels._has_diverged(state)


@pytest.mark.parametrize("terminated", [True, False])
@pytest.mark.parametrize("x", [0.0, 2.4, -2.4, 2.5, -2.5, math.nan])
def test_endings_and_rewards_are_those_of_the_rules(terminated, x):
    assert kernels._ending_index(terminated, x) == episodes.ending_index(terminated, x)
    for late in (True, False):
        for sutton_barto in (True, False):
            arguments = (terminated, late, sutton_barto)
            assert kernels._reward(*arguments) == task.reward(*arguments)


@given(
    st.tuples(*[st.integers(1, 30)] * 4),
    st.tuples(*[st.floats(-5, 0)] * 4),
    st.tuples(*[st.floats(1e-9, 10)] * 4),
    st.lists(st.floats(allow_nan=False) | st.floats(-6, 6), min_size=4, max_size=4),
)
@quick
def test_rows_are_the_discretizers(bins, low, width, values):
    high = tuple(a + b for a, b in zip(low, width, strict=True))
    grid = Discretizer(bins, low, high)
    arrays = _arrays(grid.grid)
    edges = [(low[axis], high[axis], math.nextafter(high[axis], -9)) for axis in range(4)]
    for point in (values, *zip(*edges, strict=True)):
        expected = discretizer.row_of(point, grid.grid)
        assert kernels._row_of(tuple(point), arrays) == expected < grid.n_states


@given(
    st.tuples(*[st.sampled_from([0.0, -0.0, 1.0]) | st.floats(-9, 9)] * 4),
    st.sampled_from([0.0, 0.3, 1.0]),
    st.booleans(),
)
@quick
def test_choices_draw_the_same_numbers(values, epsilon, draw_ties):
    table = np.array(values)
    ours, reference = np.random.default_rng(3), np.random.default_rng(3)
    for s in (0, 1, 0, 1):
        expected = qlearning.choose(table, s, epsilon, draw_ties, reference)
        assert kernels._choose(table, s, epsilon, draw_ties, ours) == expected
    assert ours.bit_generator.state == reference.bit_generator.state


rates = st.sampled_from([0.0, 0.1, 1.0]) | st.floats(0, 1)
tables = st.lists(st.floats(-1e3, 1e3), min_size=8, max_size=8)


@given(tables, rates, rates, st.integers(0, 3), st.integers(0, 1), st.integers(0, 3), st.booleans())
@quick
def test_a_step_teaches_the_same(table, alpha, gamma, s, a, s_next, terminated):
    ours, reference = np.array(table), np.array(table)
    for step, q in ((kernels._learn_step, ours), (qlearning.learn_step, reference)):
        step(q, s, a, 1.0, s_next, terminated, alpha, gamma)
    assert ours.tobytes() == reference.tobytes()


@given(
    tables, rates, rates, rates, st.lists(st.integers(0, 3), min_size=1, max_size=30), st.booleans()
)
@quick
def test_an_episode_teaches_the_same(table, alpha, gamma, lam, visited, over):
    visited = np.array(visited)
    steps = len(visited) - 1
    actions, rewards = visited[::-1] % 2, np.linspace(1, 2, steps + 1)
    ours, reference = np.array(table), np.array(table)
    for learn, q in ((kernels._learn_episode, ours), (qlearning.learn_episode, reference)):
        learn(q, visited, actions, rewards, steps, over, alpha, gamma, lam)
    assert ours.tobytes() == reference.tobytes()


@given(rates, rates, st.floats(0, 2000), st.integers(0, 3000))
@quick
def test_schedules_are_the_same_line(start, end, length, number):
    expected = schedules.on_line(start, end, length, number)
    assert bits(kernels._on_line(start, end, length, number)) == bits(expected)


def key_of(entry):
    """What numba looks for in its cache."""
    return entry._cache._index_key((), cpu_target.target_context.codegen())


@pytest.mark.parametrize("make", [kernels._make_learn_chunk, kernels._make_play_chunk])
def test_other_sources_are_another_entry_of_the_cache(make):
    first, again, other = (kernels._entry(make(sources)) for sources in ("a", "a", "b"))
    assert key_of(first) == key_of(again) != key_of(other)


def test_the_checksum_covers_all_that_is_compiled_from_elsewhere():
    for entry in (kernels.learn_chunk, kernels.play_chunk):
        assert [cell.cell_contents for cell in entry.py_func.__closure__] == [kernels._sources()]
    functions = [value.py_func for value in vars(kernels).values() if hasattr(value, "py_func")]
    elsewhere = {function.__module__ for function in functions} - {kernels.__name__}
    covered = (cartpole_v1, discretizer, episodes, qlearning, schedules, task)
    assert elsewhere == {module.__name__ for module in covered}
    texts = "".join(inspect.getsource(module) for module in covered) + repr(LARGEST_SANE)
    assert hashlib.sha256(texts.encode()).hexdigest() == kernels._sources()


REWARDS = """
    import mjcartpole
    from mjcartpole.learning import kernels
    from mjcartpole.learning.config import TrainConfig
    from mjcartpole.learning.training import train
    result = train(TrainConfig(backend="gym", episodes=9))
    print(mjcartpole.__file__, result.returns.sum() / result.steps)
    print(sum(kernels.learn_chunk.stats.cache_hits.values()))
"""


@pytest.mark.slow
def test_an_edit_of_the_rules_reaches_what_is_compiled(tmp_path):
    """Numba itself looks at kernels.py alone, which is not touched here."""
    package = tmp_path / "source" / "mjcartpole"
    shutil.copytree(
        Path(task.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__")
    )

    environment = {
        "PYTHONPATH": str(package.parent),
        "NUMBA_CACHE_DIR": str(tmp_path / "cache"),
    }

    def run():
        done = subprocess.run(
            [sys.executable, "-c", textwrap.dedent(REWARDS)],
            env={**os.environ, **environment},
            capture_output=True,
            text=True,
            check=True,
        )
        return done.stdout.split()

    init = str(package / "__init__.py")
    assert run() == [init, "1.0", "0"]
    assert run() == [init, "1.0", "1"]
    rules = (package / "task.py").read_text()
    assert "else 1.0" in rules
    (package / "task.py").write_text(rules.replace("else 1.0", "else 3.0"))
    assert run() == [init, "3.0", "0"]
