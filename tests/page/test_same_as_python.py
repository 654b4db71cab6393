"""The page's TypeScript against Python: policies and motion to the bit, edits to 1e-12."""

import json
import math

import numpy as np
import pytest

from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.policy import Policy
from mjcartpole.page.run_data import run_data
from mjcartpole.page.told import Told
from mjcartpole.physics.load import load_model, model_names, models_folder
from mjcartpole.studies.policy_setup import PolicySetup
from mjcartpole.task import SWING_UP
from pages import answers

LOW, HIGH = (-2.4, -0.75, -0.2095, -1.5), (2.4, 0.75, 0.2095, 1.5)
GRIDS = {
    "one grid": Discretizer((1, 3, 6, 8), LOW, HIGH),
    "tilings": Discretizer((3, 4, 6, 4), LOW, HIGH, tilings=8),
    "mirrored tilings": Discretizer((3, 4, 6, 4), LOW, HIGH, mirror=True, tilings=16),
    "nodes": Discretizer((5, 3, 7, 6), LOW, HIGH, interpolated=True),
    "mirrored nodes": Discretizer((1, 3, 7, 5), LOW, HIGH, mirror=True, interpolated=True),
    "two poles": Discretizer((2, 2, 3, 3, 3, 3), LOW + LOW[2:], HIGH + HIGH[2:], tilings=4),
}
EDITS = {
    "cartpole": [
        {"pole.length": 1.5}, {"pole.length": 0.3, "pole.mass": 0.07}, {"pole.mass": 0.31},
        {"gravity": 1.62}, {"force": 7.5, "cart.mass": 2.2}, {"hinge.damping": 0.123456789},
        {"pole.length": 1 / 3, "rail.damping": 0.7, "gravity": 12.1},
    ],
    "bob": [{"pole.length": 0.9}, {"pole.mass": 0.2}, {"pole.length": 1.7, "pole.mass": 1.0}],
    "stops": [{"pole.length": 2.0, "force": 3.0}],
    "wind": [{"gravity": 3.7, "hinge.damping": 0.2}],
    "twopoles": [
        {"pole1.length": 2.2}, {"pole2.length": 0.8, "pole2.mass": 0.2, "hinge1.damping": 0.1},
    ],
}  # fmt: skip
NUMBERS = (
    "body_mass",
    "body_ipos",
    "body_inertia",
    "body_iquat",
    "dof_damping",
    "geom_size",
    "geom_pos",
)


def policy_of(grid, seed=0):
    table = np.random.default_rng(seed).normal(size=(*grid.shape, 2))
    table.reshape(-1, 2)[::7] = 1.0  # Ties: the first action wins.
    return Policy(grid, table)


def in_json(policy):
    grid = policy.discretizer
    names = ("bins", "low", "high", "tilings", "mirror", "interpolated")
    return {name: getattr(grid, name) for name in names}


def text_of(name):
    return (models_folder() / f"{name}.xml").read_text(encoding="utf-8")


def states_of(grid):
    """States inside and outside of a grid, and on its edges."""
    size = len(grid.bins)
    inside = np.random.default_rng(1).uniform(-1.2, 1.2, (400, size)) * np.array(grid.high)
    return np.concatenate([inside, np.zeros((1, size)), [grid.low], [grid.high]])


def setups():
    """A table on every model, by both integrators."""
    for number, name in enumerate([*model_names(), "hanging"]):
        hangs = text_of("cartpole").replace('pos="0 0 0.5" mass', 'pos="0 0 -0.5" mass')
        model = load_model(hangs if name == "hanging" else name)
        grid = GRIDS["two poles" if model.poles == 2 else ("tilings", "nodes")[number % 2]]
        integrator = ("gym", "mujoco")[number % 2]
        yield PolicySetup(name, policy_of(grid, 4), model=model, integrator=integrator)


def swing_ups():
    """A table on poles that turn right round, by both integrators."""
    task = SWING_UP.with_changes(max_episode_steps=120)
    for model, integrator in (("cartpole", "gym"), ("twopoles", "mujoco")):
        poles = load_model(model).poles
        high = (2.4, 3.0) + (math.pi, 9.0) * poles
        grid = Discretizer((1, 2) + (8, 5) * poles, tuple(-value for value in high), high)
        yield PolicySetup(f"up-{model}", policy_of(grid, 2), "mujoco", model, integrator, task=task)


WANTED = [(name, edits) for name, all_edits in EDITS.items() for edits in all_edits]
TURNED = text_of("cartpole").replace('"0 0 0.5" mass', '"0 0 0.5" quat="1 0 1 0" mass')


@pytest.fixture(scope="module")
def asked():
    """All that is asked of the page's code, and what it answers; it is started once."""
    policies = [
        {"grid": in_json(policy), "table": policy.q_table.ravel().tolist(), "states": states}
        for policy, states in ((policy_of(g), states_of(g).tolist()) for g in GRIDS.values())
    ]
    edits = [{"xml": text_of(name), "edits": edits} for name, edits in WANTED]
    edits.append({"xml": TURNED, "edits": {"pole.length": 2.0}})
    runs = [run_data(setup, Told(), "mujoco") for setup in (*setups(), *swing_ups())]
    return runs, answers(policies=policies, edits=edits, runs=runs)


@pytest.mark.parametrize("name", GRIDS)
def test_a_policy_plays_and_values_alike_to_the_bit(asked, name):
    policy = policy_of(GRIDS[name])
    found = asked[1]["policies"][list(GRIDS).index(name)]
    for state, look in zip(states_of(GRIDS[name]), found, strict=True):
        observation = state.astype(np.float32)
        assert tuple(look["values"]) == policy.values(observation)
        assert look["action"] == policy(observation)


@pytest.mark.parametrize("number", range(len(WANTED)))
def test_edits_by_meaning_give_the_same_numbers(asked, number):
    name, edits = WANTED[number]
    here, there = (load_model(*of).model for of in ((name, edits), (_document(asked, number),)))
    for what in NUMBERS:
        np.testing.assert_allclose(getattr(there, what), getattr(here, what), 1e-12, 1e-15, what)
    assert here.opt.gravity.tolist() == there.opt.gravity.tolist()
    assert here.actuator_gear.tolist() == there.actuator_gear.tolist()


def _document(asked, number):
    return asked[1]["edits"][number]["xml"]


def test_an_edit_leaves_all_else_as_it_was_written(asked):
    assert WANTED[0] == ("cartpole", {"pole.length": 1.5})
    lines = zip(text_of("cartpole").splitlines(), _document(asked, 0).splitlines(), strict=True)
    assert [b.strip() for a, b in lines if a != b] == [
        '<inertial pos="0 0 0.75" mass="0.1"',
        'diaginertia="0.01875 0.01875 0.00001"/>',
        '<geom name="pole" type="capsule" fromto="0 0 0 0 0 1.5" size="0.03" material="amber"/>',
    ]


def test_what_cannot_be_stretched_is_refused(asked):
    assert "turned" in asked[1]["edits"][-1]["error"]


@pytest.mark.parametrize("number", range(len(model_names()) + 3))
def test_an_episode_is_the_same(asked, number):
    run, (told, alone) = asked[0][number], asked[1]["runs"][number]
    assert told["steps"] > 5 and told["early"] <= 1e-12
    assert alone["early"] <= 1e-12
    understood, parts = alone["understood"], run["parts"]
    assert understood.pop("upright") == pytest.approx(parts["upright"], abs=1e-15)
    assert understood == json.loads(json.dumps({name: parts[name] for name in understood}))
