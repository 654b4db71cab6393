"""Many seeds side by side, each as if it were trained alone."""

import dataclasses
import doctest
import itertools
import json

import numpy as np
import pytest

from mjcartpole.cores import available_cores
from mjcartpole.errors import ConfigError, ModelError, RunError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.evaluation import evaluate
from mjcartpole.learning.policy import Policy
from mjcartpole.learning.training import train
from mjcartpole.physics.load import load_model
from mjcartpole.studies import multi_seed
from mjcartpole.studies.multi_seed import SeedJob, SeedRunner, train_many
from nightly import few

CONFIG = TrainConfig(episodes=15, backend="gym", seed=4)


def assert_as_alone(many, config):
    for found in many.seeds:
        alone = train(TrainConfig(**{**vars(config), "seed": found.seed}))
        assert found.error == ""
        assert found.result.config == alone.config
        assert found.result.q_table.tobytes() == alone.q_table.tobytes()
        assert list(found.result.episodes) == list(alone.episodes)
        played = evaluate(
            alone.policy, backend=config.backend, model=config.model, integrator=config.integrator
        )
        assert found.evaluation == played
        assert found.score == played.returns.mean()


@pytest.mark.parametrize("workers", few([1, 2, 5, None], 2, None))
@pytest.mark.parametrize(
    "config",
    [CONFIG, TrainConfig(episodes=15, integrator="mujoco", ties="random", td_lambda=None)],
    ids=["gym", "mujoco"],
)
def test_each_seed_is_as_if_it_was_trained_alone(config, workers):
    many = train_many(config, 4, workers=workers)
    assert many.config == config
    assert [found.seed for found in many.seeds] == list(range(config.seed, config.seed + 4))
    assert_as_alone(many, config)


@pytest.mark.long
@pytest.mark.parametrize("backend", few(["gym", "mujoco"], "mujoco"))
def test_the_python_engine_gives_the_same(backend):
    config = TrainConfig(episodes=3, backend=backend)
    many = train_many(config, [10, 8], workers=2, engine="python")
    assert [found.seed for found in many.seeds] == [10, 8]
    assert_as_alone(many, config)


def test_seeds_are_taken_as_they_are_given():
    assert [found.seed for found in train_many(CONFIG, [9, 0, 3]).seeds] == [9, 0, 3]
    assert [found.seed for found in train_many(CONFIG, range(2)).seeds] == [0, 1]


def test_the_figures_are_those_of_the_scores():
    many = train_many(CONFIG, 5)
    scores = [found.evaluation.mean for found in many.seeds]
    assert many.scores == scores
    assert many.failed == []
    figures = many.aggregate()
    assert (figures.count, figures.minimum, figures.solved_at) == (5, min(scores), 475)
    assert figures.mean == pytest.approx(np.mean(scores))
    assert figures.solved == np.mean([score >= 475 for score in scores])


@pytest.mark.parametrize("engine", few(["compiled", "python"], "compiled"))
def test_a_failing_seed_does_not_take_the_others_down(engine, tmp_path):
    text = load_model().xml.replace('ctrlrange="-1 1"', 'ctrlrange="-1 9e9"')
    (tmp_path / "wild.xml").write_text(text)
    # With one state and no exploration a seed pushes to one side for ever.
    config = TrainConfig(
        model=str(tmp_path / "wild.xml"),
        bins=(1, 1, 1, 1),
        epsilon=0.0,
        epsilon_final=0.0,
        q_init_low=0.0,
        q_init_high=1.0,
        episodes=8,
    )
    many = train_many(config, 6, workers=2, engine=engine)
    assert [found.seed for found in many.failed] == [1, 3, 4]
    for found in many.failed:
        assert "diverged" in found.error
        assert (found.result, found.evaluation, found.score) == (None, None, None)
    assert len(many.scores) == many.aggregate().count == 3


def test_where_all_fail_there_are_no_figures(tmp_path):
    text = load_model().xml.replace('gear="10"', 'gear="1e12"')
    (tmp_path / "wild.xml").write_text(text)
    many = train_many(TrainConfig(model=str(tmp_path / "wild.xml"), episodes=3), 2)
    assert len(many.failed) == 2
    assert (many.scores, many.aggregate()) == ([], None)


@pytest.mark.parametrize("engine", few(["compiled", "python"], "compiled"))
def test_a_crew_can_be_stopped(engine):
    runner = SeedRunner(SeedJob(TrainConfig(episodes=1_000_000, backend="gym"), engine, None), 3, 2)
    asked = itertools.count()
    for _ in runner.run(lambda: next(asked) > 3):
        pass
    assert [found.seed for found in runner.result().seeds] == [0, 1, 2]
    assert all(found.score is None and found.error == "" for found in runner.result().seeds)


@pytest.mark.parametrize("workers", [0, -3])
def test_workers_that_make_no_sense(workers):
    with pytest.raises(ConfigError, match="workers must be a whole number from 1 up"):
        train_many(CONFIG, 2, workers=workers)


def test_an_unknown_engine_or_model_is_refused_before_any_work():
    with pytest.raises(ConfigError, match="engine 'fast' is unknown"):
        train_many(CONFIG, 2, engine="fast")
    with pytest.raises(ModelError):
        train_many(TrainConfig(model="nothing"), 2)


def test_no_more_workers_than_seeds():
    job = SeedJob(CONFIG, "compiled", None)
    assert SeedRunner(job, 2, 9).workers == 2
    assert 1 <= SeedRunner(job, 999).workers == available_cores()


def test_a_folder_holds_a_run_for_each_seed_and_the_statistics(tmp_path):
    folder = tmp_path / "many"
    found = train_many(CONFIG, 3, workers=2, run_dir=folder)
    for one, seed in zip(found.seeds, (4, 5, 6), strict=True):
        alone = train(dataclasses.replace(CONFIG, seed=seed))
        stored = Policy.load(folder / f"seed-{seed}" / "policy.json")
        assert one.result.q_table.tobytes() == alone.q_table.tobytes() == stored.q_table.tobytes()
    written = json.loads((folder / "aggregate.json").read_text())
    assert written["greedy_return"] == found.aggregate().summary()
    with pytest.raises(RunError, match="exists"):
        train_many(CONFIG, 3, run_dir=folder)
    again = train_many(CONFIG, 2, run_dir=folder, overwrite=True)
    assert [one.seed for one in again.seeds] == [4, 5]
    assert sorted(path.name for path in folder.glob("seed-*")) == ["seed-4", "seed-5"]


def test_the_docstrings_hold():
    assert doctest.testmod(multi_seed).failed == 0
