"""The pieces of the compiled loop, one by one, against what they stand for."""

import hashlib
import inspect
import math
import os
import shutil
import struct
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba.core.registry import cpu_target

from mjcartpole import task
from mjcartpole.learning import discretizer, episodes, kernels, qlearning, schedules, stepping
from mjcartpole.learning.compiled import _arrays
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.physics import cartpole_v1
from mjcartpole.physics.simulation import LARGEST_SANE

quick = settings(max_examples=200)


def bits(*values):
    return struct.pack(f"{len(values)}d", *values)


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
    expected = schedules.linear(start, end, length, number)
    assert bits(kernels._linear(start, end, length, number)) == bits(expected)


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
    functions = [value.py_func for value in vars(stepping).values() if hasattr(value, "py_func")]
    elsewhere |= {function.__module__ for function in functions}
    covered = (cartpole_v1, discretizer, episodes, qlearning, schedules, stepping, task)
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
