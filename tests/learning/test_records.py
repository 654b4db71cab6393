"""What a training has come to, read back from its folder."""

import os
import shutil

import numpy as np
import pytest

from mjcartpole.errors import RunError
from mjcartpole.learning import runs
from mjcartpole.learning.checkpoints import LATEST
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.records import read_record, read_visits
from mjcartpole.learning.session import Session
from mjcartpole.learning.training import Training
from mjcartpole.physics.load import load_model
from mjcartpole.studies.finish_training import finish_training

CONFIG = TrainConfig(episodes=12, backend="gym", evaluate_every=4)


@pytest.fixture(scope="module")
def begun(tmp_path_factory):
    """A run that was left after its last episode, before its results were written, and those."""
    folder, cartpole = tmp_path_factory.mktemp("runs") / "run", load_model()
    training = Training(CONFIG)
    with runs.claimed_folder(folder):
        runs.begin_run(folder, CONFIG, cartpole, preset="tuned")
        session = Session(folder, training, cartpole, every=0)
        for _ in session.run(lambda: False):
            pass
        left = shutil.copytree(folder, folder.with_name("left"))
        result, _, _ = finish_training(session, folder, cartpole, preset="tuned")
        runs.finish_run(folder)
    return left, folder, result


@pytest.fixture
def run(begun, tmp_path):
    return shutil.copytree(begun[1], tmp_path / "run")


@pytest.mark.parametrize("which", [0, 1])
def test_a_record_is_what_the_training_was(begun, which):
    record, result = read_record(begun[which]), begun[2]
    assert (LATEST in runs.content_of(begun[which])) == (which == 0)
    for ours, theirs in zip(record.columns, result.episodes.columns, strict=True):
        assert ours.tolist() == theirs.tolist()
    assert record.greedy == tuple((point.episodes, point.mean) for point in result.evaluations)
    assert record.config == CONFIG


def test_visits_come_back(begun):
    _, folder, result = begun
    visits = read_visits(folder, result.policy.discretizer)
    assert (visits == result.visits).all()
    assert visits.sum() == result.steps


def test_a_run_of_before_has_neither_sides_nor_visits(run, begun):
    text = (run / runs.EPISODES).read_text()
    (run / runs.EPISODES).write_text(
        "\n".join(line.rpartition(",")[0] for line in text.split("\n"))
    )
    (run / runs.VISITS).unlink()
    columns = read_record(run).columns
    assert not columns.sides.any()
    assert columns.totals.tolist() == begun[2].returns.tolist()
    assert read_visits(run, begun[2].policy.discretizer) is None


def test_what_is_no_run_or_has_no_episode_is_one_line(run, tmp_path):
    with pytest.raises(RunError, match="no run folder"):
        read_record(tmp_path / "nothing")
    (run / runs.EPISODES).unlink()
    with pytest.raises(RunError, match=r"no episode of the run .* is finished; go on with"):
        read_record(run)


HEAD = "episode,return,steps,ending,side\n"
DAMAGED = {
    "another head": "a,b\n1,2\n",
    "nothing": "",
    "letters": HEAD + "1,x,3,pole fell,left\n",
    "too few columns": HEAD + "1,2.0,3\n",
    "an ending": HEAD + "1,2.0,3,it flew away,left\n",
    "a side": HEAD + "1,2.0,3,pole fell,up\n",
    "no steps": HEAD + "1,2.0,0,pole fell,left\n",
    "not finite": HEAD + "1,nan,3,pole fell,left\n",
    "too many": HEAD + "1,2.0,3,pole fell,left\n" * 13,
    "bytes": HEAD + "\x00\xff\n",
    "far too large": HEAD + "1,2.0,99999999999999999999,pole fell,left\n",
}


@pytest.mark.parametrize("name", DAMAGED)
def test_damaged_episodes_are_one_line(name, run):
    (run / runs.EPISODES).write_text(DAMAGED[name])
    with pytest.raises(RunError) as refused:
        read_record(run)
    assert "episodes.csv' is damaged" in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_link_and_damaged_evaluations_are_refused(run):
    (run / runs.EVALUATIONS).write_text("episode,steps,mean,minimum\n4,9,inf,1\n")
    with pytest.raises(RunError, match="not finite"):
        read_record(run)
    (run / runs.EPISODES).rename(run / "other")
    os.symlink(run / "other", run / runs.EPISODES)
    with pytest.raises(RunError, match="a link"):
        read_record(run)


@pytest.mark.parametrize("text", ["left,right\n1,2\n", "left,right\n" + "-1,0\n" * 144])
def test_visits_of_another_table_are_refused(text, run):
    (run / runs.VISITS).write_text(text)
    with pytest.raises(RunError, match="not of the run's table"):
        read_visits(run, CONFIG.discretizer(1))


def test_visits_are_counted_on_every_grid_by_every_engine():
    for changes in ({"tilings": 4, "bins": (1, 2, 3, 2)}, {"method": "planning", "sweeps": 2}):
        config = TrainConfig(episodes=2, backend="gym", mirror=True, **changes)
        python = Training(config, engine="python")
        for _ in python.run():
            pass
        result = python.result()
        assert result.visits.shape == (*config.bins, 2)
        assert result.visits.sum() == result.steps
    assert isinstance(config.discretizer(1), Discretizer)
    assert result.visits.dtype == np.int64
