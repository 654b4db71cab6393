"""Controllers on the command line: evaluated, filmed and carried to other models."""

import json

import pytest

from mjcartpole.cli import main


def run(*words: str) -> int:
    with pytest.raises(SystemExit) as ended:
        main(words)
    return ended.value.code


@pytest.fixture(autouse=True)
def in_a_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_a_regulator_is_made_for_the_model_that_it_plays(capsys):
    words = ["evaluate", "--policy", "lqr", "--model", "damped", "--episodes", "3", "--json"]
    assert run(*words) == 0
    printed = json.loads(capsys.readouterr().out)
    assert (printed["policy"], printed["model"], printed["minimum"]) == ("lqr", "damped", 500.0)


def test_a_controller_is_filmed(tmp_path, capsys):
    words = ["render", "--policy", "energy", "--task", "SwingUp-v0", "--max-episode-steps", "12"]
    assert run(*words, "--overlay", "--sheet", "-o", "film.png") == 0
    assert "12 steps, time limit" in capsys.readouterr().out
    assert (tmp_path / "film.png").stat().st_size > 1_000


@pytest.mark.long
def test_controllers_are_carried_to_other_models(tmp_path, capsys):
    words = ["transfer", "--policy", "lqr", "random", "--models", "cartpole", "long", "gym"]
    assert run(*words, "--episodes", "5", "-o", "out") == 0
    means = {line.split()[0]: line.split()[1] for line in capsys.readouterr().out.splitlines()[3:6]}
    assert means["cartpole"] == means["long"] == means["gym"] == "500.0"


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (["evaluate"], "evaluate needs a RUN-OR-POLICY, or --policy"),
        (["evaluate", "runs/x", "--policy", "lqr"], "evaluate needs a RUN-OR-POLICY, or --policy"),
        (["evaluate", "--policy", "lqrr"], "policy 'lqrr' is unknown; available: lqr, energy"),
        (["render"], "render needs a RUN-OR-POLICY, or several, or --policy"),
        (["transfer"], "transfer needs a RUN-OR-POLICY, or several, or --policy"),
        (["evaluate", "--policy", "energy", "--model", "twopoles"], "2 poles"),
        (["evaluate", "--policy", "lqr", "--allow-assets", "."], "a controller has none"),
    ],
)
def test_a_slip_is_one_line(words, error, capsys):
    assert run(*words) == 2
    captured = capsys.readouterr()
    assert error in captured.err
    assert captured.err.count("\n") == 1
    assert not captured.out
