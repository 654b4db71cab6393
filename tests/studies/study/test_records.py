"""What runs have come to: whole, cut short, and by somebody else."""

import dataclasses

import pytest

from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.errors import FileError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.evaluation import evaluate
from mjcartpole.learning.training import train
from mjcartpole.studies.multi_seed import SeedJob
from mjcartpole.studies.study.records import LOG, PACKAGES, Record, RecordLog, do_run

CONFIG = TrainConfig(backend="gym", episodes=120, evaluate_every=40)


@pytest.fixture(scope="module")
def record():
    return do_run("k1", SeedJob(CONFIG, "compiled", None), None, lambda: False)


def test_a_record_says_what_the_training_says(record):
    alone = train(CONFIG)
    played = evaluate(alone.policy, backend="gym")
    assert record.figures == {
        "greedy_mean": played.mean,
        "greedy_minimum": played.minimum,
        "episodes_to_solve": alone.solved and alone.solved.episodes,
        "steps_to_solve": alone.solved and alone.solved.steps,
        "robust_mean": None,
        "robust_minimum": None,
        "area_under_curve": pytest.approx(alone.returns.mean()),
        "table_bytes": 1 * 3 * 6 * 8 * 2 * 8,
    }
    assert (record.episodes_trained, record.steps_trained) == (120, alone.steps)
    assert set(record.versions) == set(PACKAGES) and record.host
    seconds = record.times["seconds"]
    assert record.times["steps_per_second"] == pytest.approx(alone.steps / seconds, rel=0.01)
    assert [point[0] for point in record.greedy] == [40, 80, 120]
    assert record.curve[-1][0] == 120 and len(record.curve) == 50
    ends = [0, *(int(end) for end, _ in record.curve)]
    for (_, mean), start, end in zip(record.curve, ends, ends[1:], strict=False):
        assert mean == pytest.approx(alone.returns[start:end].mean())


def test_what_is_not_asked_is_not_played():
    quick = SeedJob(
        dataclasses.replace(CONFIG, evaluate_every=None), "compiled", None, evaluated=False
    )
    found = do_run("k1", quick, None, lambda: False)
    assert found.figures["greedy_mean"] is None
    assert not found.has(["greedy_mean"]) and found.has(["area_under_curve"])


def test_a_run_that_is_to_stop_leaves_nothing():
    assert do_run("k1", SeedJob(CONFIG, "compiled", None), None, lambda: True) is None


def test_a_run_that_fails_says_why():
    found = do_run("k1", SeedJob(CONFIG, "compiled", "<mujoco/>"), None, lambda: False)
    job = SeedJob(dataclasses.replace(CONFIG, backend="mujoco"), "compiled", "<mujoco/>")
    found = do_run("k1", job, None, lambda: False)
    assert "cartpole" in found.error and found.has(["greedy_mean"])
    assert Record.read(found.line()).error == found.error


def test_the_log_has_what_was_added(record, tmp_path):
    log = RecordLog(tmp_path)
    with log.writing() as add:
        add(record)
        add(dataclasses.replace(record, key="k2"))
        # Before the end: it outlives a process that is killed here.
        assert set(RecordLog(tmp_path).found) == {"k1", "k2"}
    again = RecordLog(tmp_path)
    assert again.found["k1"].line() == record.line()
    assert again.damaged == 0


@pytest.mark.parametrize("cut", [1, 40, 400])
def test_a_line_that_is_cut_short_costs_that_run_only(record, tmp_path, cut):
    path = tmp_path / LOG
    path.write_bytes(record.line() + dataclasses.replace(record, key="k2").line()[:-cut])
    log = RecordLog(tmp_path)
    assert set(log.found) == ({"k1", "k2"} if cut == 1 else {"k1"})
    with log.writing() as add:
        add(dataclasses.replace(record, key="k3"))
    assert set(RecordLog(tmp_path).found) == {*log.found, "k3"}


@pytest.mark.parametrize(
    "line",
    [b"null\n", b"{}\n", b'{"key": 3}\n', b"\xff\n", b"[" * 5000 + b"\n", b"x" * 2**21],
    ids=["null", "empty", "number", "bytes", "deep", "long"],
)
def test_lines_of_somebody_else_are_left_out(record, tmp_path, line):
    (tmp_path / LOG).write_bytes(line + record.line())
    log = RecordLog(tmp_path)
    assert log.damaged
    assert set(log.found) <= {"k1"}


@pytest.mark.parametrize("points", [{"curve": [[]]}, {"curve": [[1, 2, 3]]}, {"greedy": [[1, 2]]}])
def test_a_line_whose_curves_are_no_points_is_left_out(record, tmp_path, points):
    (tmp_path / LOG).write_bytes(dataclasses.replace(record, **points).line())
    assert RecordLog(tmp_path).damaged == 1


def test_a_log_that_is_none_is_refused(tmp_path):
    (tmp_path / LOG).mkdir()
    with pytest.raises(FileError, match="a folder where a plain file is needed"):
        RecordLog(tmp_path)


def test_policies_are_tested_under_other_disturbances(record):
    tested = Disturbances(noise=0.3, delay=3)
    found = do_run("k1", SeedJob(CONFIG, "compiled", None), tested, lambda: False)
    played = evaluate(train(CONFIG).policy, backend="gym", disturbances=tested)
    assert found.figures["robust_mean"] == played.mean < record.figures["greedy_mean"]
    assert found.figures["robust_minimum"] == played.minimum
    assert record.figures["robust_mean"] is None
    assert found.figures["greedy_mean"] == record.figures["greedy_mean"]
