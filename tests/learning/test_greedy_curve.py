"""Evaluations in the midst of a training: they change nothing, and may end it."""

import dataclasses
import itertools
import time

import gymnasium
import pytest

from engines import DIVERGING, ENGINES, outcome
from mjcartpole.errors import ConfigError, SimulationError
from mjcartpole.learning import compiled, training
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.evaluation import evaluate
from mjcartpole.learning.greedy_curve import CURVE_SEED, GreedyPoint, as_csv, first_reached
from mjcartpole.learning.methods import METHODS
from mjcartpole.learning.training import Training, train
from mjcartpole.physics.load import load_model
from nightly import few

CURVE = (GreedyPoint(5, 60, 0.1, 20.5, 9.0), GreedyPoint(10, 130, 0.2, 30.0, 9.0))


def test_the_first_point_that_reaches_a_threshold():
    assert first_reached(CURVE, 20.5) == CURVE[0]
    assert first_reached(CURVE, 20.6) == CURVE[1]
    assert first_reached(CURVE, 30.5) is first_reached(CURVE, None) is None


def test_a_line_for_each_point():
    assert as_csv(CURVE) == "episode,steps,mean,minimum\n5,60,20.5,9.0\n10,130,30.0,9.0\n"
    assert as_csv(()) == "episode,steps,mean,minimum\n"


EACH = list(itertools.product(METHODS, ["gym", "mujoco"], ENGINES))


@pytest.mark.parametrize(
    ("method", "backend", "engine"),
    few(
        EACH,
        ("q-learning", "mujoco", "compiled"),
        long=[("q-learning", "gym", "python")],
    ),
)
def test_evaluations_change_no_bit_of_what_is_learned(method, backend, engine, monkeypatch):
    monkeypatch.setattr(compiled, "CHUNK_STEPS", 100)
    config = TrainConfig(method=method, backend=backend, episodes=30, seed=4)
    evaluated = dataclasses.replace(config, evaluate_every=12)
    assert outcome(evaluated, engine) == outcome(config, engine)


@pytest.mark.long
@pytest.mark.parametrize("backend", few(["gym", "mujoco"], "gym"))
def test_each_point_is_the_policy_of_that_moment_played_from_starts_of_its_own(backend):
    config = TrainConfig(backend=backend, episodes=20, evaluate_every=6)
    curves = [train(config, engine=engine).evaluations for engine in ENGINES]
    untimed = [[point._replace(seconds=0.0) for point in curve] for curve in curves]
    assert untimed[0] == untimed[1]
    plain, points = Training(dataclasses.replace(config, evaluate_every=None), engine="python"), []
    for finished in plain.run():
        if finished % 6 == 0:
            result = plain.result()
            found = evaluate(result.policy, backend=backend, seed=CURVE_SEED)
            points.append(GreedyPoint(finished, result.steps, 0.0, found.mean, found.minimum))
    assert points == untimed[0]
    assert [point.episodes for point in points] == [6, 12, 18]


@pytest.mark.parametrize("engine", ENGINES)
def test_a_training_ends_where_it_is_solved(engine):
    config = TrainConfig(backend="gym", episodes=400, seed=6, until=60, evaluate_every=3)
    ours = Training(config, engine=engine)
    last = list(ours.run())[-1]
    result = ours.result()
    assert ours.is_over
    assert list(ours.run()) == []
    assert result.solved == result.evaluations[-1]
    assert result.solved.episodes == last == len(result.returns) < 400
    assert result.solved.steps == result.steps
    assert 0 < result.solved.seconds <= result.seconds
    assert all(point.mean < 60 <= result.solved.mean for point in result.evaluations[:-1])
    again = Training(config, engine=engine)
    again.restore(ours.snapshot())
    assert again.is_over


def test_without_until_a_training_goes_on_and_the_task_says_what_is_solved():
    result = train(TrainConfig(backend="gym", episodes=400, evaluate_every=100))
    assert len(result.returns) == 400
    assert result.solved == next(point for point in result.evaluations if point.mean >= 475)
    assert train(TrainConfig(backend="gym", episodes=9)).solved is None


def test_the_clock_stands_while_greedy_episodes_are_played(monkeypatch):
    play = training.evaluate_where_trained

    def slowly(*arguments):
        time.sleep(0.3)
        return play(*arguments)

    monkeypatch.setattr(training, "evaluate_where_trained", slowly)
    result = train(TrainConfig(backend="gym", episodes=6, evaluate_every=3))
    assert result.seconds < 0.3


def interrupted_before_its_evaluation(config, model, right):
    """A training whose first evaluation was cut off, where this is the value of action 1."""
    cut = Training(config, engine="python", cartpole=model)
    next(cut.run())
    cut.evaluations = ()
    cut.learner.memory.q_table[1::2] = right
    return cut


def test_an_evaluation_that_was_cut_off_is_made_first():
    config = TrainConfig(episodes=3, evaluate_every=1)
    cut = interrupted_before_its_evaluation(config, load_model(), right=0.0)
    assert list(cut.run()) == [2, 3]
    assert [point.episodes for point in cut.evaluations] == [1, 2, 3]


def test_a_greedy_episode_that_diverges_says_which():
    config = TrainConfig(
        episodes=3, evaluate_every=1, bins=(1, 1, 1, 1), q_init_low=0, q_init_high=0
    )
    cut = interrupted_before_its_evaluation(config, load_model(), right=1.0)
    cut._cartpole = load_model(DIVERGING["wild"])
    with pytest.raises(SimulationError, match="evaluation after 1 episodes: episode 1, step 1: "):
        next(cut.run())


def test_an_environment_of_ones_own_is_not_evaluated():
    with pytest.raises(ConfigError, match="the config's own environment"):
        Training(TrainConfig(evaluate_every=5), gymnasium.make("CartPole-v1"))
