"""What each preset promises."""

import pytest

from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.evaluation import evaluate
from mjcartpole.learning.presets import PRESETS
from mjcartpole.learning.training import train
from mjcartpole.studies.finish_training import evaluate_where_trained


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_is_a_config_that_says_what_it_changes(name):
    config = TrainConfig.preset(name)
    assert PRESETS[name].items() <= config.values().items()
    assert {key for key, value in PRESETS[name].items() if key not in config.fields()} == set()


@pytest.mark.slow
@pytest.mark.parametrize("backend", ["mujoco", "gym"])
def test_what_is_learned_from_episodes_of_ten_seconds_holds_for_half_an_hour(backend):
    config = TrainConfig.preset("endless", backend=backend, seed=3)
    endless = config.rules.with_changes(max_episode_steps=100_000)
    played = evaluate(train(config).policy, backend=backend, task=endless, episodes=20)
    assert (played.returns == 100_000).sum() >= 19


@pytest.mark.slow
@pytest.mark.parametrize(("name", "seed"), [("damped", 3), ("damped", 4), ("two-poles", 5)])
def test_tile_coding_balances_what_one_grid_does_not(name, seed):
    config = TrainConfig.preset(name, seed=seed)
    policy = train(config).policy
    model = config.load_model()
    assert evaluate_where_trained(policy, config, model, "compiled").mean >= 475
