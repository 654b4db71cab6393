"""The pieces of the compiled loop, one by one, against what they stand for."""

import functools
import math
import os
import shutil
import struct
import subprocess
import sys
import textwrap
from pathlib import Path
from types import FunctionType

import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba.core.registry import cpu_target

from mjcartpole import task
from mjcartpole.learning import ahead, discretizer, episodes, kernels, schedules, sines, stepping
from mjcartpole.learning import compiled as compiled_engine
from mjcartpole.learning.compiled import _arrays
from mjcartpole.learning.config import TrainConfig, config_class
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.learner import Learner
from mjcartpole.learning.linking import compiled
from mjcartpole.learning.methods import METHODS, action_values, method_named, n_step_sarsa, sarsa
from mjcartpole.learning.methods.experience import Trajectory, Transition
from mjcartpole.rewards import minus_one_at_the_end, one_per_step
from nightly import examples, few

quick = examples(200)


def bits(*values):
    return struct.pack(f"{len(values)}d", *values)


ending_index, row_of = numba.njit(kernels._ending_index), numba.njit(kernels._row_of)


@pytest.mark.parametrize("terminated", [True, False])
@pytest.mark.parametrize("x", [0.0, 2.4, -2.4, 2.5, -2.5, math.nan])
def test_endings_are_those_of_the_rules(terminated, x):
    for limit in (2.4, 1.0, math.inf):
        expected = episodes.ending_index(terminated, x, limit)
        assert ending_index(terminated, x, limit) == expected


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
        assert row_of(tuple(point), arrays) == expected < grid.n_states


rates = st.sampled_from([0.0, 0.1, 1.0]) | st.floats(0, 1)
tables = st.lists(st.sampled_from([0.0, -0.0, 1.0]) | st.floats(-1e3, 1e3), min_size=8, max_size=8)
rows = st.lists(st.integers(0, 3), min_size=1, max_size=30)


CALLED = ("begin_episode", "act", "after_step", "after_episode")


def learning(act, after_step, after_episode):
    """Return a loop without physics: it visits the rows that it is given."""

    def learn(p, memory, rates, visited, terminated, rng):
        steps = len(visited) - 1
        actions, rewards = np.zeros(steps, np.int64), np.linspace(1.0, 2.0, steps)
        for t in range(steps):
            s, s_next, over = visited[t], visited[t + 1], t == steps - 1
            actions[t] = act(p, memory, rates, s, rng)
            step = Transition(s, actions[t], rewards[t], s_next, terminated and over, over)
            after_step(p, memory, rates, step, rng)
        episode = Trajectory(visited, actions, rewards, steps, terminated)
        after_episode(p, memory, rates, episode, rng)

    return learn


FOUR_STATES = discretizer.Discretizer((4,), (-1.0,), (1.0,))


@functools.cache
def both(name):
    """Return the loop of a method in Python, and compiled."""
    method = method_named(name)
    kernels.learn_chunk(method, one_per_step)
    loop = learning(*(getattr(method, each) for each in CALLED[1:]))
    return loop, numba.njit(error_model="numpy")(loop)


# Others are compared as a whole in test_equal_bits.py.
FEW = ("n-step-sarsa", "actor-critic")


@pytest.mark.long
@pytest.mark.parametrize("name", few(METHODS, *FEW))
@given(tables, rates, rates, rates, rates, rows, st.booleans(), st.booleans(), st.booleans())
@quick
def test_every_method_learns_the_same_compiled(
    name, table, alpha, epsilon, gamma, lam, visited, terminated, last, ties
):
    values = {"alpha": alpha, "epsilon": epsilon, "gamma": gamma, "learn_last_step": last}
    values |= {"td_lambda": lam if lam != 0.1 else None, "ties": "random" if ties else "first"}
    values |= {"trace_lambda": lam, "alpha_values": lam}
    known = config_class(name).fields()
    values = {each: values[each] for each in values if each in known}
    found = []
    for function in both(name):
        learner = Learner(TrainConfig(method=name, **values), FOUR_STATES)
        for array in learner.memory:
            if array.dtype == float and array.size == len(table):
                array[:] = np.resize(table, array.shape)
        rates = learner.method.begin_episode(learner.p, learner.memory, 3, 10)
        places = np.array(visited)
        function(learner.p, learner.memory, rates, places, terminated, learner.rng)
        memory = [array.tobytes() for array in learner.memory]
        found.append((memory, learner.rng.bit_generator.state))
    assert found[0] == found[1]


@pytest.mark.long
@given(rates, rates, st.floats(0, 2000), st.integers(0, 3000))
@quick
def test_schedules_are_the_same_line(start, end, length, number):
    expected = schedules.linear(start, end, length, number)
    assert bits(compiled(schedules.linear)(start, end, length, number)) == bits(expected)


def modules():
    return map(method_named, METHODS)


def key_of(entry):
    """What numba looks for in its cache."""
    return entry._cache._index_key((), cpu_target.target_context.codegen())


def test_the_same_method_and_reward_are_the_same_entry_of_the_cache():
    def keys():
        kernels.learn_chunk.cache_clear()
        return [key_of(kernels.learn_chunk(each, one_per_step)) for each in modules()]

    assert keys() == keys()
    # What is made of the very functions of another is told apart by its types.
    own = {tuple(getattr(method, each) for each in CALLED) for method in modules()}
    assert len(set(keys())) == len(own) == len(METHODS) - 1


def test_the_checksum_covers_all_that_is_compiled_from_elsewhere():
    for method in modules():
        kernels.learn_chunk(method, one_per_step)
    known = {function.__module__ for function in kernels._known}
    elsewhere = {module for module in known if module.startswith("mjcartpole.")}
    for module in (kernels, ahead, sines, stepping):
        functions = [value for value in vars(module).values() if isinstance(value, FunctionType)]
        elsewhere |= {
            each.__module__ for each in functions if each.__module__.startswith("mjcartpole.")
        }
    reached = kernels._reached(*(getattr(m, each) for m in modules() for each in CALLED))
    covered = {module.__name__ for module in (*kernels._SHARED, kernels)}
    assert elsewhere <= covered | {function.__module__ for function in reached}
    assert kernels._sources(one_per_step) != kernels._sources(minus_one_at_the_end)


def test_the_checksum_covers_what_a_method_borrows_from_another():
    functions = (n_step_sarsa.after_step, n_step_sarsa.act, action_values.act)
    texts = {kernels._sources(one_per_step, *functions[:n]) for n in range(4)}
    assert n_step_sarsa.act is sarsa.act
    assert len(texts) == 3  # those of action values come with the first


SCALE = 2.0
NAMES = {"a": 1.0}


def scaled(x, x_dot, theta, theta_dot, terminated):
    return SCALE * math.cos(theta)


def called(x, x_dot, theta, theta_dot, terminated):
    return scaled(x, x_dot, theta, theta_dot, terminated)


def looked_up(x, x_dot, theta, theta_dot, terminated):
    return NAMES.get(str(theta), 0.5)


def silent(x, x_dot, theta, theta_dot, terminated):
    pass


def typed_at_a_prompt():
    names = {}
    exec("def reward(x, x_dot, theta, theta_dot, terminated):\n    return -abs(theta)", names)
    return names["reward"]


def test_rewards_that_compile_and_whether_their_code_is_kept(monkeypatch):
    for reward in (scaled, called, typed_at_a_prompt()):
        assert kernels.why_not_compilable(reward) == ""
    before = kernels._sources(scaled)
    assert before
    # What they call, and what has no source, may change unseen: it is compiled anew each time.
    assert kernels._sources(called) == kernels._sources(typed_at_a_prompt()) == ""
    monkeypatch.setitem(globals(), "SCALE", 3.0)
    assert kernels._sources(scaled) != before


@pytest.mark.parametrize(
    ("reward", "why"),
    [
        (looked_up, "cannot be compiled: Failed in nopython mode"),
        (silent, "does not always return a number"),
        (functools.partial(scaled), "is no plain function"),
    ],
)
def test_rewards_that_do_not_compile(reward, why):
    assert kernels.why_not_compilable(reward).startswith(why)
    rules = task.Task("odd", reward=reward)
    assert f"the reward of odd {why}" in compiled_engine.unavailable("gym", task=rules)


REWARDS = """
    import mjcartpole
    from mjcartpole.learning import kernels
    from mjcartpole.learning.config import TrainConfig, config_class
    from mjcartpole.learning.methods import q_learning
    from mjcartpole.rewards import one_per_step
    from mjcartpole.learning.training import train
    result = train(TrainConfig(backend="gym", episodes=9))
    print(mjcartpole.__file__, result.returns.sum() / result.steps)
    entry = kernels.learn_chunk(q_learning, one_per_step)
    print(sum(entry.stats.cache_hits.values()))
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
    rules = (package / "rewards.py").read_text()
    assert "    return 1.0\n" in rules
    (package / "rewards.py").write_text(rules.replace("    return 1.0\n", "    return 3.0\n"))
    assert run() == [init, "3.0", "0"]
