"""Trainings repeat exactly, and learn."""

import doctest

import numpy as np
import pytest

from mjcartpole.errors import ModelNotFoundError
from mjcartpole.learning import training
from mjcartpole.learning.config import PRESETS, TrainConfig
from mjcartpole.learning.training import Training, train
from mjcartpole.studies.evaluation import evaluate


def test_the_docstrings_hold():
    assert doctest.testmod(training).failed == 0


@pytest.mark.parametrize("backend", ["mujoco", "gym"])
@pytest.mark.parametrize("preset", list(PRESETS))
def test_one_seed_gives_one_table_and_two_seeds_give_two(preset, backend):
    def run(seed):
        return train(TrainConfig.preset(preset, backend=backend, episodes=40, seed=seed))

    first, again, other = run(7), run(7), run(8)
    assert first.q_table.tobytes() == again.q_table.tobytes()
    np.testing.assert_array_equal(first.returns, again.returns)
    assert first.steps == again.steps == first.returns.sum()
    assert first.q_table.tobytes() != other.q_table.tobytes()
    assert len(first.returns) == 40


def test_the_backends_start_alike():
    """The same generators and, to rounding, the same physics: the first episodes are equal."""
    ours, gyms = (
        train(TrainConfig(backend=backend, episodes=20, seed=1)) for backend in ("mujoco", "gym")
    )
    np.testing.assert_array_equal(ours.returns, gyms.returns)
    assert ours.q_table.tobytes() == gyms.q_table.tobytes()


def test_what_a_dimension_without_bins_ignores():
    config = TrainConfig(bins=(1, 1, 1, 1), episodes=5)
    assert train(config).q_table.shape == (1, 1, 1, 1, 2)


def test_a_training_can_be_left_at_any_episode():
    unfinished = Training(TrainConfig(episodes=100, seed=2))
    for episode in unfinished.run():
        if episode.number == 9:
            break
    result = unfinished.result()
    assert len(result.returns) == 10
    assert result.policy([0.0, 0.0, 0.1, 0.0]) in (0, 1)
    assert Training(TrainConfig()).result().steps == 0


def test_a_result_is_not_changed_by_later_episodes():
    unfinished = Training(TrainConfig(episodes=30))
    episodes = unfinished.run()
    next(episodes)
    result = unfinished.result()
    before = result.q_table.copy()
    list(episodes)
    np.testing.assert_array_equal(result.q_table, before)


def test_an_unknown_model_is_refused_before_any_work():
    with pytest.raises(ModelNotFoundError, match="'nothing'"):
        train(TrainConfig(model="nothing"))


@pytest.mark.slow
@pytest.mark.parametrize("backend", ["mujoco", "gym"])
def test_tuned_balances_the_pole_on_every_seed(backend):
    for seed in range(500, 505):
        result = train(TrainConfig.preset("tuned", backend=backend, seed=seed))
        evaluation = evaluate(result.policy, backend=backend)
        assert evaluation.returns.mean() >= 490, f"seed {seed}"


@pytest.mark.slow
def test_the_article_with_its_terminal_step_learns_more_than_without():
    means = {
        preset: np.mean(
            [
                train(TrainConfig.preset(preset, seed=seed, episodes=4_000)).returns[-500:].mean()
                for seed in range(3)
            ]
        )
        for preset in ("article", "article-terminal")
    }
    assert means["article-terminal"] > means["article"] > 50
