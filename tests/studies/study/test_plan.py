"""The plan of a study: each training with a key that is the same anywhere."""

import shutil

import pytest

from mjcartpole.errors import ConfigError
from mjcartpole.physics.load import models_folder
from mjcartpole.studies.study.plan import plan
from mjcartpole.studies.study.study_file import study_of


def planned(factors, base=None, **study):
    return plan(study_of({"study": study, "base": base or {}, "factors": factors}))


def keys(*arguments, **study):
    return [run.key for run in planned(*arguments, **study).runs]


def test_runs_are_points_by_seeds():
    found = planned({"alpha": [0.1, 0.2], "pole.length": [0.5, 1]}, seeds=[4, 9])
    assert (found.points, len(found.runs)) == (4, 8)
    assert [run.job.config.seed for run in found.runs] == [4, 9] * 4
    assert [run.point for run in found.runs] == [1, 1, 2, 2, 3, 3, 4, 4]
    assert found.runs[-1].factors == {"alpha": 0.2, "pole.length": 1}
    assert found.runs[-1].job.config.set == ("pole.length=1",)
    assert len({run.key for run in found.runs}) == 8


def test_a_key_is_of_what_is_trained_and_not_of_its_names(tmp_path):
    copy = shutil.copy(models_folder() / "cartpole.xml", tmp_path / "other.xml")
    names = keys({"model": ["cartpole", str(copy)], "alpha": [0.1]}, seeds=1)
    assert names[0] == names[1]
    # An edit that changes nothing is none, and one of another kind may say the same.
    assert keys({"gravity": [9.8], "alpha": [0.1]}, seeds=1) == names[:1]
    assert keys({"alpha": [0.1]}, {"preset": "tuned", "gamma": 0.98}, seeds=1) == names[:1]


def test_a_key_says_what_differs():
    found = keys(
        {"alpha": [0.1, 0.2], "pole.length": [0.5, 1.0], "backend": ["mujoco"]}, seeds=2
    ) + keys({"alpha": [0.1], "backend": ["gym"]}, seeds=2)
    assert len(set(found)) == len(found)


def test_seeds_and_levels_that_are_added_leave_the_others_as_they_are():
    before = keys({"alpha": [0.1, 0.2]}, seeds=2)
    after = keys({"alpha": [0.05, 0.1, 0.2]}, seeds=3)
    assert set(before) < set(after)


@pytest.mark.parametrize(
    ("factors", "base", "said"),
    [
        ({"gamma": [0.9, 2.0]}, {}, "gamma=2.0: gamma must be a number from 0 to 1"),
        ({"model": ["nothing"]}, {}, "model=nothing: no model is called 'nothing'"),
        ({"gravity": [1, 2]}, {"backend": "gym"}, "gravity=1: "),
        ({"bins": [[1, 3]]}, {}, "bins=1,3: bins needs 4 values"),
        ({"gamma": [0.9]}, {"method": "planning", "alpha": 0.1}, "no method of this study has it"),
        ({"method": ["planning"], "alpha": [0.1]}, {}, "method 'planning' has no alpha"),
    ],
)
def test_a_point_that_makes_no_sense_is_told(factors, base, said):
    with pytest.raises(ConfigError, match=said):
        planned(factors, base)


def test_a_mistake_of_many_points_is_told_once():
    with pytest.raises(ConfigError) as refused:
        planned({"gamma": [0.9, 2.0], "alpha": [0.1, 0.2, 0.3]})
    (line,) = str(refused.value).split("\n")
    assert line.startswith("gamma=2.0 alpha=0.1 (and 2 more points): gamma must be")


def test_to_say_when_it_was_solved_a_training_is_evaluated():
    found = planned({"alpha": [0.1]}, {"episodes": 60}, measure=["episodes_to_solve"])
    assert found.runs[0].job.config.evaluate_every == 3
    assert not found.runs[0].job.evaluated
    said = planned({"alpha": [0.1]}, {"evaluate_every": 7}, measure=["episodes_to_solve"])
    assert said.runs[0].job.config.evaluate_every == 7
    assert planned({"alpha": [0.1]}).runs[0].job.config.evaluate_every is None
    assert planned({"alpha": [0.1]}).runs[0].job.evaluated


def test_too_many_runs_are_refused():
    with pytest.raises(ConfigError, match="2,000 points with 1,000 seeds"):
        planned({"alpha": {"low": 0, "high": 1}}, design="random", samples=2000, seeds=1000)


def test_under_what_policies_are_tested_is_part_of_a_key():
    def tested(**disturbances):
        about = {"seeds": 1, "measure": ["robust_mean"]}
        values = {"study": about, "robustness": disturbances, "factors": {"alpha": [0.1]}}
        return plan(study_of(values)).runs[0]

    assert (
        len({tested(noise=0.1).key, tested(noise=0.2).key, *keys({"alpha": [0.1]}, seeds=1)}) == 3
    )
    assert tested(noise=0.1).tested.noise == (0.1,)
    assert tested(noise=0.1).key == tested(noise=[0.1]).key
