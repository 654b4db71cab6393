"""Changed rules in configs and on the command line: trained by, kept, played by."""

import dataclasses
import json
import math

import numpy as np
import pytest

from command_line import QUICK, call, done
from mjcartpole.errors import ConfigError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.documents import read_config
from mjcartpole.learning.evaluation import evaluate
from mjcartpole.learning.training import train
from mjcartpole.rule_changes import RuleChanges
from mjcartpole.studies.eval_target import EvalTarget
from mjcartpole.studies.policy_setup import controller_setup, find_setup
from mjcartpole.task import CARTPOLE_V1, SWING_UP, Task
from nightly import few

CHANGES = {
    "x_limit": 0.6,
    "theta_limit": 0.5,
    "start_low": -0.2,
    "start_high": 0.1,
    "start_angle": 0.05,
    "reward": "upright",
    "max_episode_steps": 60,
}
RULES = CARTPOLE_V1.with_changes(**CHANGES)
FLAGS = [
    word for name, value in CHANGES.items() for word in (f"--{name.replace('_', '-')}", str(value))
]


@pytest.fixture(scope="module")
def changed(tmp_path_factory):
    """The folder of a quick training by changed rules."""
    folder = tmp_path_factory.mktemp("changed") / "other"
    done(["train", *QUICK, *FLAGS, "--run-dir", folder])
    return folder


def test_nothing_changed_is_the_task_itself():
    assert RuleChanges().applied_to(SWING_UP) is SWING_UP
    assert RuleChanges(task="SwingUp-v0").applied_to(CARTPOLE_V1) is SWING_UP
    assert TrainConfig().rules is CARTPOLE_V1


@pytest.mark.parametrize("backend", few(["mujoco", "gym"], "gym", long=("mujoco",)))
def test_both_engines_learn_and_play_by_them_alike(backend):
    config = TrainConfig(backend=backend, episodes=60, **CHANGES)
    assert config.rules == RULES
    compiled, plain = (train(config, engine=engine) for engine in ("compiled", "python"))
    np.testing.assert_array_equal(compiled.q_table, plain.q_table)
    assert list(compiled.episodes) == list(plain.episodes)
    assert max(episode.steps for episode in plain.episodes) <= 60
    assert any(episode.total % 1 for episode in plain.episodes)
    usual = train(dataclasses.replace(config, x_limit=None))
    assert (usual.q_table != plain.q_table).any()
    where = {"backend": backend, "task": RULES, "episodes": 5}
    played = [evaluate(plain.policy, engine=each, **where) for each in ("compiled", "python")]
    assert played[0] == played[1]


def test_a_task_that_was_changed_is_its_name_and_what_was_changed():
    config = TrainConfig(task=RULES, seed=3)
    assert config == TrainConfig(seed=3, **CHANGES)
    assert TrainConfig(task=RULES, x_limit=1).rules == RULES.with_changes(x_limit=1)
    assert TrainConfig(**config.values()) == config


def test_a_function_is_no_value_of_a_config():
    assert TrainConfig(reward=RULES.reward).reward == "upright"
    with pytest.raises(ConfigError, match=r"the name of a reward \(.*upright\), not a function"):
        TrainConfig(reward=lambda *state: 1.0)


def test_a_run_remembers_them(changed):
    assert read_config(changed)[2] == TrainConfig(episodes=3, **CHANGES)
    assert find_setup(changed).task == RULES
    assert find_setup(changed, EvalTarget(backend="gym")).task == RULES
    again = find_setup(changed, EvalTarget(x_limit=1.5)).task
    assert again == RULES.with_changes(x_limit=1.5)
    assert find_setup(changed, EvalTarget(task="SwingUp-v0")).task is SWING_UP


def test_infinity_is_kept(here, capsys):
    done(["train", *QUICK, "--x-limit", "inf", "--max-episode-steps", "20", "--run-dir", "wide"])
    text = (here / "wide" / "config.json").read_text()
    assert json.loads(text)["x_limit"] == "inf"
    assert read_config(here / "wide")[2].rules.x_limit == math.inf
    (here / "wide" / "config.json").write_text(text.replace('"inf"', '"wide"'))
    code, _, err = call(["evaluate", "wide"], capsys)
    assert code == 2 and "x_limit cannot be 'wide'" in err


def test_policies_are_played_by_what_is_asked_for(changed, here, capsys):
    policy = changed / "policy.json"
    here_and_there = [
        call(["evaluate", *words, "--json", "--episodes", "5"], capsys)[1]
        for words in ([changed], [policy, *FLAGS], [policy], ["--policy", "lqr", *FLAGS])
    ]
    run, same, usual, controlled = (json.loads(text) for text in here_and_there)
    assert run["mean"] == same["mean"] != usual["mean"]
    assert controlled["mean"] <= 60
    assert controller_setup("lqr", EvalTarget(**CHANGES)).task == RULES
    words = ["transfer", policy, *FLAGS, "--models", "cartpole", "--episodes", "5", "-o", "out"]
    assert call(words, capsys)[0] == 0
    (cell,) = json.loads((here / "out" / "transfer.json").read_text())["cells"]
    assert cell["mean"] == run["mean"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["train", "--x-limit", "-1"], "x_limit must be a number (m) more than 0"),
        (["train", "--start-angle", "3"], "all beyond theta_limit"),
        (["train", "--reward", "uprigt"], "did you mean 'upright'?"),
        (["evaluate", "--policy", "lqr", "--start-low", "1"], "start_low (1) is above start_high"),
        (["train", "--task", ""], "task '' is unknown; available: CartPole-v1"),
        (["evaluate", "--policy", "lqr", "--task", ""], "task '' is unknown"),
        (["evaluate", "--policy", "lqr", "--model", ""], "no model is called ''"),
        (["transfer", "--policy", "lqr", "--theta-limit", "nan"], "theta_limit must be"),
    ],
)
def test_what_makes_no_sense_is_one_line(words, message, capsys):
    code, out, err = call(words, capsys)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert message in err


def test_policies_of_different_rules_are_told_apart(changed, trained, here, capsys):
    code, _, err = call(["transfer", changed, trained], capsys)
    assert code == 2
    assert f"{RULES.summary} and CartPole-v1 (500 steps)" in err
    assert "(60 steps, x_limit 0.6, theta_limit 0.5, start_low -0.2, " in err
    assert Task("own").summary == "own (500 steps)"


def test_a_warning_is_of_the_rules_that_are_trained_by(here, capsys):
    narrow = ["--theta-limit", "0.01", "--start-low", "0", "--start-high", "0"]
    assert "hard to balance: " in call(["train", *QUICK, *narrow], capsys)[2]
