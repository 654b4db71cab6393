"""The reference passes the ladder; a small error fails on the right rung for the right cause."""

import functools
import re

import pytest

from mjcartpole.errors import ConfigError
from mjcartpole.physics.load import load_model
from mjcartpole.studies.parity import RUNGS, Subject, learning, run_ladder
from mjcartpole.studies.parity.dynamics import accelerations
from nightly import at_night, few
from parity_cases import POLE, REFERENCE, WRONG, changed, climb, failures


@pytest.mark.long
@pytest.mark.parametrize("against", ["cartpole-v1", pytest.param("itself", marks=pytest.mark.slow)])
def test_the_reference_passes_every_rung(against, monkeypatch):
    monkeypatch.setattr(learning, "SEEDS", at_night(learning.SEEDS, fast=4))
    subject, results = climb(REFERENCE, against, tuple(RUNGS))
    if results[10].verdict == "skipped":
        assert results.pop(10).skipped.startswith(("dm-control ", "dm_control is not"))
    assert {result.verdict for result in results.values()} == {"holds"}
    assert subject.causes == []
    for result in results.values():
        assert any(figure.bound is not None for figure in result.figures)
        assert result.reason


@pytest.mark.slow
def test_the_reference_passes_the_full_ladder():
    results = list(run_ladder(Subject(load_model("cartpole"))))
    assert [result.verdict for result in results] == ["holds"] * len(RUNGS)


@functools.cache
def steps_of_wrong(name):
    """The subject and its results on the rungs about single steps."""
    changes, _, _ = WRONG[name]
    return climb(changed(*changes), rungs=(2, 3, 4))


@pytest.mark.parametrize("name", few(WRONG, "pole mass", long=("integrator",)))
def test_a_small_error_fails_on_the_right_rung_for_the_right_cause(name):
    _, first_rung, cause = WRONG[name]
    subject, results = steps_of_wrong(name)
    assert min(failures(results)) == first_rung
    assert any(cause in found for found in subject.causes)


@pytest.mark.parametrize("name", few(sorted(set(WRONG) - {"geom mass", "integrator"}), "pole mass"))
def test_a_failing_step_tells_its_story(name):
    _, _, cause = WRONG[name]
    _, results = steps_of_wrong(name)
    worst, answers, likely = results[3].story
    assert re.match(r"worst state \(.*\), action [01]$", worst)
    assert re.match(r"MuJoCo \(.*\), equations \(.*\)$", answers)
    assert likely.startswith("likely cause: ")
    assert cause in likely
    assert "alone it explains 100.0%" in likely


@pytest.mark.long
def test_several_wrong_parameters_are_not_blamed_on_one():
    text = changed((POLE, POLE.replace("0.1", "0.3")), ("-9.8", "-1.62"))
    _, results = climb(text, rungs=(3,))
    assert "more than one: " in results[3].story[-1]
    assert "pole mass 0.3 instead of 0.1" in results[3].story[-1]


def test_a_rung_gives_the_same_alone_as_among_others():
    subject = Subject(load_model("cartpole"), quick=True)
    alone = accelerations(subject)
    among = next(r for r in run_ladder(subject, (1, 2, 5)) if r.rung == 2)
    assert alone == among


def test_a_rung_that_is_not_there():
    with pytest.raises(ConfigError, match="no rung 11; available: 1, 2"):
        list(run_ladder(Subject(load_model("cartpole")), (1, 11)))
