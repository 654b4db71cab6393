"""How far a parameter may move."""

import dataclasses
import doctest
import json

import numpy as np
import pytest

from mjcartpole.disturbances.disturbances import Disturbances, WorldDisturbances
from mjcartpole.errors import ConfigError, ModelError
from mjcartpole.learning.controllers import controller
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.evaluation import evaluate
from mjcartpole.learning.naming import added_flags
from mjcartpole.learning.policy import Policy
from mjcartpole.physics.edit.edits import edit_document
from mjcartpole.physics.load import load_model
from mjcartpole.studies import sweep as module
from mjcartpole.studies.sweep import DISTURBANCES, Stretch, SweepResult, parse_sweep, sweep
from mjcartpole.studies.transfer import Cell, TransferResult


def a_policy():
    """Pushes to where the pole is falling to; holds for some lengths only."""
    grid = Discretizer((1, 3, 6, 8), (-2.4, -0.75, -0.2095, -1.5), (2.4, 0.75, 0.2095, 1.5))
    parts = (w * np.linspace(-1, 1, n) for w, n in zip((0, 1, 4, 4), grid.bins, strict=True))
    lean = sum(np.ix_(*parts))
    return Policy(grid, np.stack([-lean, lean], axis=-1))


POLICY = {"p": a_policy()}


@pytest.mark.parametrize(
    ("text", "key", "values"),
    [
        ("pole.length=0.5:3:0.25", "pole.length", tuple(0.5 + 0.25 * n for n in range(11))),
        ("gravity=1:2:0.4", "gravity", (1.0, 1.4, 1.8)),
        ("joint:hinge.damping=0:0.3:0.1", "joint:hinge.damping", (0.0, 0.1, 0.2, 0.3)),
        ("x = 1 : 1 : 5", "x", (1.0,)),
        ("x=-1:1:1", "x", (-1.0, 0.0, 1.0)),
        ("x=1e-3:2e-3:1e-3", "x", (0.001, 0.002)),
    ],
)
def test_parsed(text, key, values):
    assert parse_sweep(text) == (key, values)


@pytest.mark.parametrize(
    "text",
    [
        "pole.length",
        "pole.length=1",
        "pole.length=1:2",
        "pole.length=1:2:3:4",
        "pole.length=a:b:c",
        "pole.length=1:2:0",
        "pole.length=1:2:-1",
        "pole.length=2:1:0.5",
        "pole.length=nan:1:1",
        "pole.length=0:inf:1",
        "=1:2:1",
        "",
    ],
)
def test_refused(text):
    with pytest.raises(ConfigError, match="is no sweep"):
        parse_sweep(text)


def test_too_many_values_are_refused():
    with pytest.raises(ConfigError, match="at most 1,000"):
        parse_sweep("pole.length=0:1e9:1e-9")


def test_each_value_is_the_edited_model_alone():
    found = sweep(POLICY, "cartpole", "pole.length", (0.3, 1.0), episodes=10, seed=3)
    assert (found.key, found.values, found.model) == ("pole.length", (0.3, 1.0), "cartpole")
    for value, cell in found.points():
        document = edit_document(load_model("cartpole").xml, {"pole.length": value})
        alone = evaluate(POLICY["p"], model=load_model(document), episodes=10, seed=3)
        assert cell.evaluation == alone
    again = sweep(POLICY, "cartpole", "pole.length", (0.3, 1.0), episodes=10, seed=3, workers=1)
    assert again.summary() == found.summary()
    summary = json.loads(json.dumps(found.summary(), allow_nan=False))
    assert [point["value"] for point in summary["points"]] == [0.3, 1.0]
    assert {point["model"] for point in summary["points"]} == {"cartpole"}


def test_other_edits_hold_for_all_values():
    heavy = sweep(POLICY, "cartpole", "pole.length", (0.3,), edits={"gravity": 3.0}, episodes=5)
    document = edit_document(load_model("cartpole").xml, {"pole.length": 0.3, "gravity": 3.0})
    alone = evaluate(POLICY["p"], model=load_model(document), episodes=5)
    assert heavy.played.cells[0].evaluation == alone


@pytest.mark.parametrize(
    ("key", "values", "others", "first", "second"),
    [
        ("delay", (0.0, 2.0), {"noise": 0.1}, {"noise": 0.1}, {"noise": 0.1, "delay": 2}),
        ("force-noise", (1.0, 2.5), {}, {"force_noise": 1.0}, {"force_noise": 2.5}),
        ("push@0.1s", (0.0, 1.5), {}, {}, {"push": "1.5@0.1s"}),
        (
            "push@~0.2s",
            (0.25, 1.0),
            {"push": "1@0.1s"},
            {"push": ["1@0.1s", "0.25@~0.2s"]},
            {"push": ["1@0.1s", "1@~0.2s"]},
        ),
        ("quantize", (0.0, 0.05), {"lag": 0.1}, {"lag": 0.1}, {"lag": 0.1, "quantize": 0.05}),
    ],
)
def test_each_size_of_a_disturbance_is_the_evaluation_alone(key, values, others, first, second):
    for model in ("cartpole", "gym"):
        found = sweep(
            POLICY, model, key, values, disturbances=Disturbances(**others), episodes=5, seed=3
        )
        assert (found.key, found.model) == (key.replace("-", "_"), model)
        where = {"backend": "gym"} if model == "gym" else {}
        for cell, given in zip(found.played.cells, (first, second), strict=True):
            alone = evaluate(
                POLICY["p"], disturbances=Disturbances(**given), episodes=5, seed=3, **where
            )
            assert cell.evaluation == alone
        assert found.summary().get("disturbances", "") == added_flags(Disturbances(**others))


@pytest.mark.parametrize("name", DISTURBANCES)
def test_what_can_be_swept_is_what_can_be_added(name):
    assert name in {field.name for field in dataclasses.fields(WorldDisturbances)}


@pytest.mark.parametrize(
    ("key", "values", "others", "match"),
    [
        ("delay", (0.0, 0.5), {}, "delay must be a whole number"),
        ("delay", (1.0, 500.0), {}, "no shorter than an episode"),
        ("delay", (0.0, 1.0), {"delay": 1}, "given and swept; give it once"),
        ("drop", (0.0, 1.5), {}, "drop must be from 0 to 1"),
        ("push", (0.0, 1.5), {}, "says when, such as push@2s=0:5:0.5"),
        ("push@99s", (0.0, 1.5), {}, "comes after the end of every episode"),
        ("pole.length", (1.0, 1.5), {"vary": "pole.length=1:2"}, "given and swept"),
        ("lag", (0.0, 1.0), {"vary": "pole.length=-1:2"}, "cannot be"),
    ],
)
def test_a_disturbance_that_makes_no_sense_is_refused_before_anything_is_played(
    key, values, others, match
):
    with pytest.raises(ConfigError, match=match):
        sweep(POLICY, "cartpole", key, values, disturbances=Disturbances(**others))


def test_nothing_of_gymnasiums_own_is_edited_while_a_disturbance_is_swept():
    with pytest.raises(ConfigError, match="cannot be swept or edited"):
        sweep(POLICY, "gym", "delay", (0.0,), edits={"gravity": 3.0})


def result_with(*means, values=None):
    """A sweep with known means, by hand."""

    class Known(Cell):
        mean = property(lambda self: float(self.error))

    cells = tuple(Known("p", str(n), error=str(mean)) for n, mean in enumerate(means))
    played = TransferResult(("p",), tuple(str(n) for n in range(len(means))), cells, 0)
    return SweepResult("k", tuple(values or map(float, range(len(means)))), "m", played)


@pytest.mark.parametrize(
    ("means", "stretches"),
    [
        ((500, 475, 474.9), [Stretch(0, 1, True, False)]),
        ((0, 500, 0), [Stretch(1, 1, False, False)]),
        ((500, 0, 500, 500), [Stretch(0, 0, True, False), Stretch(2, 3, False, True)]),
        ((500, 500), [Stretch(0, 1, True, True)]),
        ((0, float("nan"), 1), []),
        ((500, float("nan"), 500), [Stretch(0, 0, True, False), Stretch(2, 2, False, True)]),
    ],
)
def test_stretches(means, stretches):
    assert result_with(*means).stretches("p") == stretches


def test_the_longest_stretch_is_the_widest():
    found = result_with(500, 500, 0, 500, 500, values=(1, 2, 3, 4, 9)).longest("p")
    assert (found.low, found.high) == (4, 9)
    assert str(found) == "4 to 9 (where it ends)"
    assert result_with(0, 0).longest("p") is None


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        (("gym", "pole.length", (1.0,)), "cannot be swept"),
        (("cartpole", "pole.length", ()), "rising values"),
        (("cartpole", "pole.length", (2.0, 1.0)), "rising values"),
        (("cartpole", "pole.lenght", (1.0,)), "pole.length"),
        (("cartpole", "pole.length", (-1.0, 1.0)), "pole.length"),
    ],
)
def test_refused_sweeps(arguments, match):
    with pytest.raises((ConfigError, ModelError), match=match):
        sweep(POLICY, *arguments, episodes=1)


def test_one_thing_is_not_set_and_swept():
    with pytest.raises(ConfigError, match="give it once"):
        sweep(POLICY, "cartpole", "gravity", (1.0,), edits=["gravity=2"], episodes=1)


def test_doctests():
    assert doctest.testmod(module).failed == 0


def test_what_a_notebook_shows_is_short():
    swept = sweep(POLICY, "cartpole", "gravity", [9.0, 9.5, 10.0], episodes=1, seed=4)
    played = "TransferResult(policies: 1, models: 3, seed 4)"
    assert repr(swept) == f"SweepResult(gravity from 9 to 10 on cartpole, values: 3, {played})"


@pytest.mark.parametrize(
    ("key", "meant"), [("dealy", "delay"), ("pusch@2s", "push"), ("pole.lenght", "pole.length")]
)
def test_a_slip_is_told_by_what_is_nearest(key, meant):
    with pytest.raises(ConfigError, match=f"did you mean '{meant}'"):
        sweep({"constant": controller("constant")}, "cartpole", key, (1, 2), episodes=1)
