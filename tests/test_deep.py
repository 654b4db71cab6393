"""benchmarks/deep.py: what it says and keeps; deep learners on our environments."""

import json
import runpy
import sys
import warnings
from pathlib import Path

import gymnasium
import pytest

import mjcartpole  # noqa: F401 - it registers the environments

ROOT = Path(__file__).resolve().parents[1]
DEEP = runpy.run_path(str(ROOT / "benchmarks" / "deep.py"))
NEEDS = "Stable-Baselines3 and PyTorch are missing: pip install 'mjcartpole[deep]'"
ENVS = [
    ("CartPole-v1", {}),
    ("CartPole-v1", {"delay": 1, "noise": 0.01, "vary": {"pole.length": (0.5, 1.5)}}),
    ("CartPole-v1", {"push": "0.5@~2s", "observe_actions": 2, "hold": 0.1}),
    ("CartPole-v1", {"vary": {"force": [8, 10]}, "observe_context": True}),
    ("Continuous-v0", {}),
    ("Continuous-v0", {"delay": 1, "noise": 0.01, "vary": {"pole.length": (0.5, 1.5)}}),
    ("SwingUp-v0", {"observation": "trig"}),
]


@pytest.fixture
def call(monkeypatch, capsys):
    """Run the script with some words, and return what it prints."""

    def run(*words):
        monkeypatch.setattr(sys, "argv", ["deep.py", *map(str, words)])
        DEEP["main"]()
        return capsys.readouterr().out

    return run


def record(seed, **figures):
    """A line as the script keeps it."""
    plain = {"solved": True, "episodes": 9, "steps": 100, "seconds": 1.0, "greedy": 500.0}
    return {
        "learner": "tuned",
        "backend": "gym",
        "seed": seed,
        "carried": 480.0,
        **plain,
        **figures,
    }


def test_a_table_of_known_figures():
    records = [record(0), record(1, steps=300), record(2, steps=200, solved=False)]
    slow = [record(seed, learner="PPO", seconds=40.0, greedy=470.0 + seed) for seed in range(4)]
    *_, deep, ours = DEEP["table"]([*records, *slow])
    assert ours == "| `tuned` | gym | 2 of 3 | 9 | 200 (100 to 300) | 1 | 500 | 480 |"
    assert deep == "| PPO | gym | 4 of 4 | 9 | 100 | 40 | 472 (470 to 473) | 480 |"


@pytest.mark.long
def test_the_table_on_the_page_is_that_of_the_file_beside_it(call):
    printed = call("table", ROOT / "docs" / "deep.jsonl")
    assert len(printed.splitlines()) > 10
    assert printed in (ROOT / "docs" / "deep.md").read_text(encoding="utf-8")


def test_what_is_there_already_is_not_trained_again(call, tmp_path):
    file = tmp_path / "found" / "deep.jsonl"
    words = ("train", file, "--learners", "quick", "--backends", "gym")
    first = call(*words, "--seeds", 1)
    assert call(*words, "--seeds", 1) == ""
    second = call(*words, "--seeds", 2)
    assert file.read_text(encoding="utf-8") == first + second
    found = [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]
    assert [one["seed"] for one in found] == [0, 1]
    assert all(one["solved"] and one["greedy"] > 450 and one["carried"] > 450 for one in found)


def test_what_is_missing_is_said_in_a_line(call, monkeypatch, tmp_path, capsys):
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(SystemExit) as end:
        call("train", tmp_path / "deep.jsonl", "--learners", "PPO")
    assert end.value.code == 2
    assert capsys.readouterr() == ("", "error: torch is missing: pip install 'mjcartpole[deep]'\n")


@pytest.mark.parametrize(("name", "settings"), ENVS)
def test_the_checker_of_stable_baselines_has_nothing_to_say(name, settings):
    checker = pytest.importorskip("stable_baselines3.common.env_checker", reason=NEEDS)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checker.check_env(gymnasium.make(f"mjcartpole/{name}", **settings))


@pytest.mark.parametrize("name", [name for name in DEEP["LEARNERS"] if name.isupper()])
def test_a_deep_learner_is_measured(name, monkeypatch):
    pytest.importorskip("stable_baselines3", reason=NEEDS)
    learner = DEEP["LEARNERS"][name]
    assert learner.steps >= 15_000
    monkeypatch.setitem(DEEP["LEARNERS"], name, DEEP["replace"](learner, steps=300))
    found = DEEP["measure"](name, "mujoco", 0)
    assert not found["solved"] and 300 <= found["steps"] < 600 and found["episodes"] > 3
    assert found["seconds"] > 0
    assert 5 < found["greedy"] < 475 and 5 < found["carried"] < 475
