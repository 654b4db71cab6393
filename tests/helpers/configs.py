"""Trainings drawn at random: any method, with any values of its parameters."""

import dataclasses
from typing import Literal, get_args, get_origin

from hypothesis import strategies as st

from mjcartpole import task
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.methods import METHODS, method_named
from mjcartpole.rewards import minus_one_at_the_end
from mjcartpole.task import Task
from nightly import at_night

TASKS = {
    "usual": task.CARTPOLE_V1,
    # Whose episodes are mostly truncated, and one whose values are below 0.
    "short": Task("Short-v0", x_limit=0.3, start_low=-0.1, start_high=0.15, time_limit=17),
    "costly": Task("Costly-v0", reward=minus_one_at_the_end, time_limit=40),
}

SHARES = st.floats(0, 1)
RATES = st.sampled_from([0.0, 0.01, 0.1, 1.0]) | SHARES
SMALL = st.sampled_from([1e-9, 1e-3, 0.5])
VALUES = {
    "gamma": st.sampled_from([0.0, 0.95, 1.0]) | SHARES,
    "decay": st.sampled_from([0.0, 0.5, 1.0, 0, 1]) | SHARES,
    "td_lambda": st.sampled_from([None, None, 0.0, 1.0, 0, 1]) | SHARES,
    # For each number of axes tiles are compiled anew.
    "tilings": st.sampled_from(at_night([1, 1, 1, 2, 8], fast=[1])),
    "v_init": st.floats(-99, 99),
    "n_steps": st.integers(1, 12),
    "replay_size": st.sampled_from([1, 2, 5]) | st.integers(1, 500),
    "replays": st.integers(1, 5),
    "floor": SMALL | st.just(5e-324),
    "successors": st.integers(1, 5),
    "sweeps": st.integers(1, 9),
    "tolerance": SMALL,
    "planning": st.integers(1, 6),
    "threshold": SMALL,
    "predecessors": st.integers(1, 6),
    "fit_steps": st.none() | st.integers(20, 60),
}
"""Of parameters that are no rates, choices or switches."""


@st.composite
def configs(draw, methods=tuple(METHODS)):
    """Draw a training."""
    method = draw(st.sampled_from(methods))
    parameters = draw(_parameters(method))
    backend, integrator = draw(
        st.sampled_from([("gym", "gym"), ("mujoco", "gym"), ("mujoco",) * 2])
    )
    grid = draw(_grids(tiled=method == "planning" or parameters.get("tilings", 1) > 1))
    edits = [(), (), ("pole.length=0.8", "hinge.damping=0.1"), ("gravity=2",)]
    return TrainConfig(
        method=method,
        backend=backend,
        integrator=integrator,
        set=draw(st.sampled_from(edits)) if backend == "mujoco" else (),
        task=TASKS[
            draw(st.sampled_from(at_night(["usual", "short", "costly"], fast=["usual", "short"])))
        ].name,
        episodes=draw(st.integers(1, 40)),
        seed=draw(st.integers(0, 9) | st.integers(0, 2**70)),
        **grid,
        **parameters,
        **draw(_disturbances(method, backend, grid["mirror"])),
    )


@st.composite
def _disturbances(draw, method, backend, mirror):
    """Draw what is added; for each method that is compiled anew."""
    if method not in at_night(METHODS, fast=["q-learning"]) or draw(st.booleans()):
        return {}
    some = {
        "delay": st.integers(0, 5),
        "hold": RATES,
        "drop": RATES,
        "lag": st.sampled_from([0.001, 0.02, 0.3]),
        "force_noise": st.sampled_from([0.1, 5.0]),
        "push": st.sampled_from([("0.3@~0.2s",), ("0.1@~0.1s", "0.2@~1s")]),
        "sensor_delay": st.integers(0, 5),
        "noise": st.sampled_from([0.001, (0.0, 0.1, 0.02, 0.3)]),
        "quantize": st.sampled_from([0.01, (0.5, 0.0, 0.1, 1.0)]),
    }
    if not mirror:
        some |= {"bias": st.sampled_from([0.1, (0, 0, -0.05, 0)])}
    if method not in ("planning", "identify"):
        some |= {"observe_actions": st.integers(1, 3)}
    chosen = draw(st.lists(st.sampled_from(sorted(some)), min_size=1, max_size=4, unique=True))
    varied = {"vary": ("force=8:12",), "pool": 2, "widen": 5}
    more = varied if backend == "mujoco" and draw(st.booleans()) else {}
    return {name: draw(some[name]) for name in chosen} | more


@st.composite
def _parameters(draw, method):
    fields = dataclasses.fields(method_named(method).Parameters)
    values = {each.name: draw(_values(each.name, each.type)) for each in fields}
    if "q_init_low" in values:
        ends = draw(st.tuples(*[st.sampled_from([0.0, 1.0, 60.0]) | st.floats(-99, 99)] * 2))
        values["q_init_low"], values["q_init_high"] = sorted(ends)
    return values


def _values(name, kind):
    if name in VALUES:
        return VALUES[name]
    if get_origin(kind) is Literal:
        return st.sampled_from(get_args(kind))
    return {bool: st.booleans(), float: RATES}[kind]


@st.composite
def _grids(draw, *, tiled):
    low = draw(st.tuples(*[st.floats(-3, 0)] * 4))
    width = draw(st.tuples(*[st.floats(1e-3, 5)] * 4))
    mirror = draw(st.booleans())
    high = tuple(a + b for a, b in zip(low, width, strict=True))
    few, some = st.integers(2, 4), st.sampled_from([1, 1, 2, 3, 8]) | st.integers(1, 14)
    return {
        "bins": draw(st.tuples(st.just(1), few, few, few) if tiled else st.tuples(*[some] * 4)),
        "low": tuple(-each for each in width) if mirror else low,
        "high": width if mirror else high,
        "mirror": mirror,
    }
