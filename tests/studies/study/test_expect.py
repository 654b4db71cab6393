"""How long a study will take."""

import pytest

from mjcartpole.errors import SimulationError
from mjcartpole.learning.training import Training
from mjcartpole.studies.study.expect import expect
from mjcartpole.studies.study.plan import plan
from mjcartpole.studies.study.records import do_run
from mjcartpole.studies.study.study_file import study_of


def runs_of(**study):
    base = {"backend": "gym", "episodes": 30}
    factors = {"alpha": [0.1, 0.2, 0.3]}
    return plan(study_of({"study": study, "base": base, "factors": factors})).runs


def test_trainings_that_can_be_tried_whole_are_expected_as_they_are():
    runs = runs_of(seeds=1, measure=["area_under_curve"])
    steps = sum(do_run(run.key, run.job, None, lambda: False).steps_trained for run in runs)
    found = expect(runs, tried=3)
    assert found.steps == steps and found.seconds > 0


def test_greedy_episodes_and_more_seeds_count():
    once = expect(runs_of(seeds=1, measure=["area_under_curve"]), tried=3).steps
    assert expect(runs_of(seeds=1), tried=3).steps > 1.5 * once
    longer = expect(runs_of(seeds=10, measure=["area_under_curve"]), tried=3).steps
    assert longer == pytest.approx(10 * once, rel=0.5)


def test_a_long_training_is_tried_for_a_while_only():
    base = {"backend": "gym", "episodes": 100_000_000}
    study = study_of({"study": {"seeds": 1}, "base": base, "factors": {"alpha": [0.1]}})
    assert expect(plan(study).runs, seconds=0.05).steps > 1e9


def test_what_does_not_come_since_it_is_solved_before_does_not_count():
    base = {"backend": "gym", "episodes": 100_000, "until": 0, "evaluate_every": 5}
    study = {"seeds": 1, "measure": ["area_under_curve"]}
    solved = plan(study_of({"study": study, "base": base, "factors": {"alpha": [0.1]}})).runs
    assert expect(solved).steps < 1e6


def test_a_training_that_fails_does_not_end_it(monkeypatch):
    runs, whole = runs_of(seeds=1), Training.run

    def run(self):
        if self.config.alpha == 0.1:
            raise SimulationError("the physics diverged")
        return whole(self)

    monkeypatch.setattr(Training, "run", run)
    assert expect(runs[:1]).steps == 0 and expect(runs).steps > 0


def test_nothing_takes_no_time():
    assert expect([]).steps == 0
