"""From a training in progress to its results."""

import json

import pytest

from mjcartpole.learning import runs
from mjcartpole.learning.checkpoints import LATEST, load_checkpoint
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.evaluation import evaluate
from mjcartpole.learning.session import Session
from mjcartpole.learning.training import Training, train
from mjcartpole.physics.load import load_model
from mjcartpole.studies.finish_training import evaluate_where_trained, finish_training
from nightly import few

CONFIG = TrainConfig(episodes=20, seed=1, mirror=False)
CARTPOLE = load_model()


def conduct(folder, *, stop_after=None, resume=False, engine="python", config=CONFIG):
    """Train in a folder, to the end or to an episode."""
    folder.mkdir(exist_ok=True)
    training = Training(config, engine=engine, cartpole=CARTPOLE)
    session = Session(folder, training, CARTPOLE, every=1e9)
    if resume:
        session.resume(load_checkpoint(folder / LATEST, config, CARTPOLE.xml))
    for _ in session.run(lambda: len(training.log) == stop_after):
        pass
    return finish_training(session, folder, CARTPOLE, preset="tuned")


def contents(folder):
    names = (runs.EPISODES, runs.POLICY, runs.SUMMARY)
    return {name: (folder / name).read_bytes() for name in names}


@pytest.mark.parametrize("engine", ["python", "compiled"])
def test_a_training_that_is_over_is_written_and_evaluated(engine, tmp_path):
    result, summary, evaluation = conduct(tmp_path, engine=engine)
    alone = train(CONFIG)
    assert result.q_table.tobytes() == alone.q_table.tobytes()
    assert evaluation.summary() == evaluate(alone.policy).summary()
    assert json.loads((tmp_path / runs.SUMMARY).read_text()) == summary
    assert summary == {
        "preset": "tuned",
        "backend": "mujoco",
        "model": "cartpole",
        "seed": 1,
        "episodes": 20,
        "interrupted": False,
        "steps": alone.steps,
        "mean_return_last_100": alone.returns.mean(),
        "evaluation": evaluation.summary(),
    }


def test_a_training_that_was_stopped_is_written_and_not_evaluated(tmp_path):
    result, summary, evaluation = conduct(tmp_path, stop_after=7)
    assert evaluation is None
    assert (summary["interrupted"], summary["episodes"]) == (True, 7)
    assert "evaluation" not in summary
    assert result.returns.tolist() == train(CONFIG).returns[:7].tolist()
    assert len((tmp_path / runs.EPISODES).read_text().splitlines()) == 8


@pytest.mark.parametrize("stops", few([[1], [7], [3, 11, 19], [20]], [3, 11, 19]))
def test_a_training_that_was_stopped_ends_like_one_that_was_not(stops, tmp_path):
    conduct(tmp_path / "whole", engine="compiled")
    for number, stop in enumerate(stops):
        conduct(tmp_path / "stopped", stop_after=stop, resume=number > 0)
    conduct(tmp_path / "stopped", resume=True)
    assert contents(tmp_path / "stopped") == contents(tmp_path / "whole")


@pytest.mark.parametrize("stop", few([3, 10, 14], 10))
def test_evaluations_of_a_stopped_training_are_those_of_one_that_was_not(stop, tmp_path):
    config = TrainConfig(episodes=20, seed=1, mirror=False, backend="gym", evaluate_every=10)
    conduct(tmp_path / "whole", engine="compiled", config=config)
    conduct(tmp_path / "stopped", stop_after=stop, config=config)
    said = (tmp_path / "stopped" / runs.EVALUATIONS).read_text()
    assert said.count("\n") == 1 + stop // 10
    conduct(tmp_path / "stopped", resume=True, config=config)
    whole = (tmp_path / "whole" / runs.EVALUATIONS).read_text()
    assert (tmp_path / "stopped" / runs.EVALUATIONS).read_text() == whole
    assert whole.startswith(said)
    assert contents(tmp_path / "stopped") == contents(tmp_path / "whole")


def test_a_training_that_was_solved_is_over_and_says_so(tmp_path):
    config = TrainConfig(episodes=200, seed=6, backend="gym", until=60, evaluate_every=3)
    result, summary, evaluation = conduct(tmp_path, engine="compiled", config=config)
    point = result.solved
    assert len(result.returns) == point.episodes < 200
    assert evaluation is not None
    assert summary["interrupted"] is False
    assert summary["solved"] == {
        "at": 60,
        "episodes": point.episodes,
        "steps": result.steps,
        "mean": point.mean,
    }
    assert summary["stopped"] == f"the mean greedy return, {point.mean:.2f}, reached 60"
    timing = json.loads((tmp_path / runs.TIMING).read_text())
    assert timing["seconds_to_solve"] == pytest.approx(point.seconds, abs=1e-3)


@pytest.mark.slow
def test_results_that_a_kill_left_half_written_are_written_again(tmp_path):
    conduct(tmp_path)
    whole = contents(tmp_path)
    names = (runs.EPISODES, runs.POLICY, runs.TIMING, runs.SUMMARY)
    for count in range(len(names) + 1):
        for name in names[count:]:
            (tmp_path / name).unlink(missing_ok=True)
        conduct(tmp_path, resume=True)
        assert contents(tmp_path) == whole


@pytest.mark.parametrize(
    "config",
    [
        TrainConfig(episodes=3, backend="gym"),
        TrainConfig(episodes=3, integrator="mujoco"),
        TrainConfig(episodes=3),
    ],
)
@pytest.mark.parametrize("engine", ["python", "compiled"])
def test_a_policy_is_evaluated_where_it_was_trained(config, engine):
    result = train(config)
    found = evaluate_where_trained(result.policy, result.config, CARTPOLE, engine)
    again = evaluate(result.policy, backend=config.backend, integrator=config.integrator)
    assert found == again
