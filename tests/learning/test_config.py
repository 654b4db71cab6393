"""Configs that make sense, and those that do not."""

import copy
import dataclasses
import math
import subprocess
import sys

import numpy as np
import pytest

from mjcartpole.errors import ConfigError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.methods import METHODS
from mjcartpole.learning.presets import PRESETS


def test_the_default_is_tuned():
    assert TrainConfig.preset("tuned") == TrainConfig()
    assert TrainConfig().episodes <= 2_000


def test_the_article_as_printed():
    config = TrainConfig.preset("article")
    assert config.bins == (1, 1, 25, 25)
    assert config.high[2] == float(np.float32(24 * 2 * math.pi / 360))
    assert config.high[3] == 3.5
    assert tuple(-value for value in config.low) == config.high
    assert (config.gamma, config.alpha, config.alpha_final) == (0.95, 0.1, 0.1)
    assert (config.epsilon, config.epsilon_final, config.decay) == (0.1, 0.0, 0.5)
    assert (config.q_init_low, config.q_init_high) == (0.0, 1.0)
    assert (config.episodes, config.log_every) == (12_000, 2_000)
    assert config.learn_last_step is False
    assert config.td_lambda is None
    terminal = TrainConfig.preset("article-terminal")
    assert dataclasses.replace(terminal, learn_last_step=False) == config


def test_any_field_can_be_given():
    config = TrainConfig.preset("article", backend="gym", seed=3, gamma=0.5)
    assert (config.backend, config.seed, config.gamma) == ("gym", 3, 0.5)
    with pytest.raises(dataclasses.FrozenInstanceError):
        config.seed = 4


@pytest.mark.parametrize("name", list(PRESETS))
def test_presets_name_fields_only(name):
    assert set(PRESETS[name]) <= set(TrainConfig.preset(name).fields())


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"backend": "bullet"}, "backend 'bullet' is unknown; available: mujoco, gym"),
        ({"integrator": "rk4"}, "integrator 'rk4' is unknown"),
        ({"backend": "gym", "own_timestep": True}, "asked for .*own-timestep"),
        ({"backend": "gym", "model": "long"}, "takes no model, integrator, timestep or edits"),
        ({"episodes": 0}, "episodes must be a whole number from 1 up, not 0"),
        ({"episodes": -5}, "not -5"),
        ({"episodes": 2.5}, "whole number"),
        ({"episodes": True}, "whole number"),
        ({"log_every": 0}, "log_every"),
        ({"evaluate_every": 0}, "evaluate_every must be a whole number from 1 up, not 0"),
        ({"evaluate_every": 2.0}, "evaluate_every must be a whole number"),
        (
            {"until": 500.5},
            "at most 500, the most that an episode of CartPole-v1 returns, not 500.5",
        ),
        ({"max_episode_steps": 0}, "max_episode_steps must be a whole number from 1"),
        ({"max_episode_steps": 99, "until": 100}, "at most 99, the most that an episode"),
        ({"until": math.nan}, "until must be a number .* not nan"),
        ({"until": -math.inf}, "until must be a number .* not -inf"),
        ({"until": "475"}, "until must be a number"),
        ({"seed": -1}, "seed must be a whole number from 0 up"),
        ({"bins": (3, 3)}, "4 values"),
        ({"bins": (1, 3, 6, 0)}, "from 1 up"),
        ({"bins": (1, 3, 6, 8.5)}, "whole numbers"),
        ({"low": (0.0, 0.0, 0.0)}, "low needs 4 values .*, and two more for each further pole"),
        ({"bins": (1, 3, 6, 8, 6)}, "bins needs 4 values"),
        ({"bins": (1, 3, 6, 8, 6, 8), "low": (-1.0,) * 8}, "bins has 6 values, .* 3 poles"),
        ({"low": (9.0, -1.0, -1.0, -1.0)}, "low < high"),
        ({"high": (math.inf, 1.0, 1.0, 1.0)}, "finite"),
        ({"high": ("a", 1.0, 1.0, 1.0)}, "finite numbers"),
        ({"gamma": 1.5}, "gamma must be a number from 0 to 1"),
        ({"gamma": math.nan}, "gamma"),
        ({"alpha": -0.1}, "alpha"),
        ({"epsilon": "much"}, "epsilon"),
        ({"decay": 2}, "decay"),
        ({"td_lambda": 1.1}, "td_lambda must be a number from 0 to 1"),
        ({"q_init_low": 2.0, "q_init_high": 1.0}, "in order"),
        ({"q_init_high": math.inf}, "finite"),
        ({"ties": "last"}, "ties must be"),
    ],
)
def test_values_that_make_no_sense(changes, message):
    with pytest.raises(ConfigError, match=message):
        TrainConfig(**changes)


@pytest.mark.parametrize(
    ("changes", "period", "solved_at"),
    [
        ({}, None, 475),
        ({"until": 300}, 10, 300),
        ({"until": 300, "episodes": 60}, 1, 300),
        ({"until": 500, "evaluate_every": 7}, 7, 500),
        ({"evaluate_every": 200}, 200, 475),
        ({"max_episode_steps": 1_000}, None, 950),
    ],
)
def test_when_a_training_is_evaluated_and_what_counts_as_solved(changes, period, solved_at):
    config = TrainConfig(**changes)
    assert (config.evaluation_period, config.solved_at) == (period, solved_at)


def test_unknown_names_are_answered_with_those_that_are_there():
    with pytest.raises(ConfigError, match=r"'best' is unknown; available: tuned, article"):
        TrainConfig.preset("best")
    with pytest.raises(ConfigError, match=r"method 'q-learning' has no gama; available: .*gamma"):
        TrainConfig.preset("tuned", gama=0.9)


def test_lists_are_taken_as_tuples():
    config = TrainConfig(bins=[1, 3, 6, 8])
    assert config == TrainConfig()
    assert hash(config) == hash(TrainConfig())


def test_a_method_has_parameters_of_its_own():
    with pytest.raises(ConfigError, match=r"method 'sarsa' has no td_lambda; available: .*epsilon"):
        TrainConfig(method="sarsa", td_lambda=0.5)
    with pytest.raises(ConfigError, match="method 'best' is unknown; available: q-learning, sarsa"):
        TrainConfig(method="best")
    with pytest.raises(ConfigError, match="task 'Best-v0' is unknown"):
        TrainConfig(task="Best-v0")


@pytest.mark.parametrize("method", METHODS)
def test_a_config_is_made_again_from_its_words_its_values_and_a_copy(method):
    config = TrainConfig(method=method, gamma=0.25, bins=(1, 1, 3, 3))
    assert config.method == method
    assert eval(repr(config)) == config
    assert TrainConfig(**config.values()) == copy.deepcopy(config) == config
    assert dataclasses.replace(config, gamma=0.5).gamma == 0.5


@pytest.mark.parametrize("preset", PRESETS)
def test_another_method_takes_what_it_has_of_a_preset(preset):
    config = TrainConfig.preset(preset, method="sarsa", seed=3)
    others = {"method", "td_lambda", "plan_after"}
    ours = {name: value for name, value in PRESETS[preset].items() if name not in others}
    assert {name: getattr(config, name) for name in ours} == ours
    assert (config.method, config.seed) == ("sarsa", 3)


def test_a_number_is_set_or_varies():
    with pytest.raises(ConfigError, match=r"'pole.length' is set, and varies; give it once"):
        TrainConfig(set=("pole.length=2",), vary=("pole.length=1:3",))
    assert TrainConfig(set=("pole.mass=2",), vary=("pole.length=1:3",)).disturbances.pool == 100


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"vary": {"force": (8, 12)}, "backend": "gym"}, "it takes no model"),
        ({"method": "planning", "observe_actions": 1}, "no action before is seen"),
        ({"method": "identify", "observe_actions": 1}, "no action before is seen"),
        ({"vary": {"force": (8, 12)}, "observe_context": True}, "has no bins for what varies"),
        ({"delay": 30, "max_episode_steps": 30}, "no shorter than an episode"),
    ],
)
def test_disturbances_that_no_training_has_are_refused(values, said):
    with pytest.raises(ConfigError, match=said):
        TrainConfig(**values)


def test_a_training_imports_no_method_but_its_own():
    code = (
        "import sys; from mjcartpole.learning.config import METHODS, TrainConfig\n"
        "TrainConfig(method='double-q'); prefix = 'mjcartpole.learning.methods.'\n"
        "imported = {name.replace('_', '-').removeprefix(prefix) for name in sys.modules}\n"
        "print(*imported.intersection(METHODS))"
    )
    assert subprocess.check_output([sys.executable, "-c", code], text=True) == "double-q\n"
