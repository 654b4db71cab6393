"""What `transfer` prints and writes."""

import csv
import json
import subprocess
import sys
import time

import numpy as np
import pytest
from PIL import Image

from mjcartpole.commands.transfer import Transfer
from mjcartpole.errors import ConfigError, FileError, MjCartPoleError, RunError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.runs import begin_run, write_results
from mjcartpole.learning.training import train
from mjcartpole.physics.load import load_model
from mjcartpole.task import TASKS, Task, register
from nightly import at_night


@pytest.fixture(scope="module")
def trained():
    episodes = at_night(150, fast=30)
    return [train(TrainConfig.preset("tuned", episodes=episodes, seed=seed)) for seed in range(4)]


@pytest.fixture
def policies(trained, tmp_path, monkeypatch):
    """Four policy files where the program runs."""
    monkeypatch.chdir(tmp_path)
    paths = [tmp_path / f"policy-{seed}.json" for seed in range(4)]
    for path, result in zip(paths, trained, strict=True):
        result.policy.save(path)
    return paths


def read_csv(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_a_matrix_is_printed_and_written(policies, tmp_path, capsys):
    models = ["gym", "cartpole", "long"]
    assert Transfer(policies[:2], models=models, episodes=10, output=tmp_path / "out").run() == 0
    printed = capsys.readouterr().out.splitlines()
    assert printed[2].split() == ["policy-0", "policy-1"]
    assert [line.split()[0] for line in printed[3:6]] == models
    rows = read_csv(tmp_path / "out" / "transfer.csv")
    assert [(row["policy"], row["model"]) for row in rows] == [
        (f"policy-{seed}", model) for seed in (0, 1) for model in models
    ]
    document = json.loads((tmp_path / "out" / "transfer.json").read_text())
    for row, cell in zip(rows, document["cells"], strict=True):
        assert float(row["mean"]) == cell["mean"]
        assert f"{cell['mean']:.1f}" in "\n".join(printed)
    with Image.open(tmp_path / "out" / "transfer.png") as picture:
        assert np.asarray(picture).std() > 10
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "transfer.csv",
        "transfer.json",
        "transfer.png",
    ]


def test_the_same_seed_writes_the_same_bytes(policies, tmp_path):
    for name in ("a", "b"):
        Transfer(
            policies[:1], models=["cartpole", "gym"], episodes=10, output=tmp_path / name
        ).run()
    for path in (tmp_path / "a").iterdir():
        assert path.read_bytes() == (tmp_path / "b" / path.name).read_bytes()


def test_edits_are_in_the_names(policies, tmp_path, capsys):
    Transfer(
        policies[:1],
        models=["cartpole", "gym"],
        set=("pole.length=1.5",),
        episodes=2,
        output=tmp_path / "out",
    ).run()
    assert "cartpole with pole.length=1.5" in capsys.readouterr().out


def test_a_sweep_is_printed_and_written(policies, tmp_path, capsys):
    sweep = "joint:hinge.damping=0:1:0.5"
    assert Transfer(policies[:2], sweep=sweep, episodes=10, output=tmp_path).run() == 0
    printed = capsys.readouterr().out
    assert "policy-0: the mean return is" in printed
    rows = read_csv(tmp_path / "sweep-joint-hinge.damping.csv")
    assert [row["value"] for row in rows] == ["0.0", "0.5", "1.0"] * 2
    document = json.loads((tmp_path / "sweep-joint-hinge.damping.json").read_text())
    assert document["parameter"] == "joint:hinge.damping"
    assert document["model"] == "cartpole"
    assert (tmp_path / "sweep-joint-hinge.damping.png").is_file()


def test_a_run_is_swept_on_its_own_model(policies, tmp_path, trained):
    folder = tmp_path / "runs" / "mine"
    folder.mkdir(parents=True)
    config = TrainConfig.preset("tuned", model="long", episodes=5)
    begin_run(folder, config, load_model("long"), preset="tuned")
    write_results(folder, train(config), {})
    Transfer([folder], sweep="gravity=9:10:1", episodes=2, output=tmp_path).run()
    document = json.loads((tmp_path / "sweep-gravity.json").read_text())
    assert document["model"] == str(folder / "model.xml")
    assert document["points"][0]["policy"] == "mine"


@pytest.mark.long
def test_disturbances_are_taken_and_swept(policies, tmp_path, capsys):
    models = ["cartpole", "gym"]
    Transfer(policies[:1], models=models, delay=2, noise=(0.01,), episodes=2, output=tmp_path).run()
    assert "seed 1000000, with --delay 2 --noise 0.01\n" in capsys.readouterr().out
    document = json.loads((tmp_path / "transfer.json").read_text())
    assert document["disturbances"] == "--delay 2 --noise 0.01"
    Transfer(policies[:1], sweep="push@0.1s=0:2:1", lag=0.1, episodes=2, output=tmp_path).run()
    out = capsys.readouterr().out
    assert out.splitlines()[0].endswith("seed 1000000, with --lag 0.1")
    assert [line.split()[0] for line in out.splitlines()[2:6]] == ["push@0.1s", "0", "1", "2"]
    document = json.loads((tmp_path / "sweep-push-0.1s.json").read_text())
    assert (document["parameter"], document["disturbances"]) == ("push@0.1s", "--lag 0.1")


def test_policies_of_one_name_are_told_apart(policies, tmp_path):
    other = tmp_path / "other" / "policy-0.json"
    other.parent.mkdir()
    other.write_bytes(policies[1].read_bytes())
    Transfer([policies[0], other], models=["cartpole"], episodes=2, output=tmp_path).run()
    document = json.loads((tmp_path / "transfer.json").read_text())
    assert document["policies"] == [str(policies[0]), str(other)]


@pytest.mark.slow
def test_four_policies_on_six_models_take_less_than_a_minute(policies, tmp_path):
    # Untrained policies would end their episodes early; these 24 cells are the slowest there are.
    started = time.perf_counter()
    models = ["gym", "cartpole", "long", "short", "heavy", "damped"]
    Transfer(policies, models=models, output=tmp_path).run()
    assert time.perf_counter() - started < 60
    assert len(read_csv(tmp_path / "transfer.csv")) == 24


@pytest.mark.parametrize(
    ("settings", "error", "match"),
    [
        ({"models": ["cartpole", "nothing.xml"]}, MjCartPoleError, "nothing.xml"),
        ({"set": ("pole.lenght=1",)}, ConfigError, "pole.length"),
        ({"models": ["a", "b"], "sweep": "gravity=1:2:1"}, ConfigError, "one model"),
        ({"models": ["gym"], "sweep": "gravity=1:2:1"}, ConfigError, "cannot be swept"),
        ({"sweep": "gravity"}, ConfigError, "no sweep"),
        ({"models": ["gym"], "vary": ("force=8:12",)}, ConfigError, "change nothing there"),
        ({"models": ["gym"], "integrator": "mujoco"}, ConfigError, "change nothing there"),
        ({"sweep": "delay=0:1:0.5"}, ConfigError, "whole number"),
        ({"models": ["cartpole"], "hold": 2.0}, ConfigError, "hold must be from 0 to 1"),
        ({"episodes": 0, "models": ["cartpole"]}, ConfigError, "episodes"),
    ],
)
def test_mistakes_leave_nothing_behind(policies, tmp_path, settings, error, match):
    with pytest.raises(error, match=match) as caught:
        Transfer(policies[:1], output=tmp_path / "out", **settings).run()
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.glob("out/*"))


def test_mistakes_in_the_sources(tmp_path, policies):
    with pytest.raises(ConfigError, match="RUN-OR-POLICY"):
        Transfer([]).run()
    with pytest.raises(RunError, match="no run folder or policy file"):
        Transfer([tmp_path / "nowhere"]).run()
    (tmp_path / "taken").write_text("")
    with pytest.raises(FileError, match="taken"):
        Transfer(policies[:1], models=["cartpole"], output=tmp_path / "taken").run()


@pytest.mark.long
def test_a_table_is_never_replaced_unasked(policies, tmp_path, capsys):
    for _ in range(2):
        Transfer(policies[:1], models=["gym"], episodes=2).run()
        Transfer(policies[:1], sweep="gravity=9:10:1", episodes=2).run()
    out = capsys.readouterr().out
    names = ["sweep-gravity", "sweep-gravity-2", "transfer", "transfer-2"]
    assert sorted({path.stem for path in (tmp_path / "transfer").iterdir()}) == names
    for name in names:
        assert f"written transfer/{name}.csv, .json and .png" in out
    mine = tmp_path / "mine"
    Transfer(policies[:1], models=["gym"], episodes=2, output=mine).run()
    (mine / "transfer.csv").unlink()
    before = {path: path.read_bytes() for path in mine.iterdir()}
    with pytest.raises(FileError, match=r"transfer\.json' exists.*--overwrite"):
        Transfer(policies[:1], models=["gym"], episodes=3, output=mine).run()
    assert {path: path.read_bytes() for path in mine.iterdir()} == before
    Transfer(policies[:1], models=["gym"], episodes=3, output=mine, overwrite=True).run()
    assert (mine / "transfer.csv").is_file()


def test_without_matplotlib_the_tables_are_written_and_a_line_says_how_to_get_the_plot(
    policies, tmp_path, capsys, monkeypatch
):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert Transfer(policies[:1], models=["gym"], episodes=2).run() == 0
    out, err = capsys.readouterr()
    assert out.splitlines()[-1] == "written transfer/transfer.csv and .json"
    assert sorted(path.suffix for path in (tmp_path / "transfer").iterdir()) == [".csv", ".json"]
    assert err.splitlines()[-1] == (
        "mjcartpole: no .png: a plot needs the package matplotlib: pip install 'mjcartpole[plot]'"
    )


@pytest.mark.slow
def test_a_transfer_touches_no_opengl(policies):
    code = (
        "import sys; from pathlib import Path\n"
        "from mjcartpole.commands.transfer import Transfer\n"
        f"Transfer([Path({str(policies[0])!r})], models=['gym'], episodes=2).run()\n"
        "print([name for name in ('dm_control', 'OpenGL') if name in sys.modules])"
    )
    assert subprocess.check_output([sys.executable, "-c", code], text=True).endswith("\n[]\n")


@pytest.fixture
def narrow():
    task = Task("Narrow-test-v0", x_limit=0.5, time_limit=40)
    yield register(task)
    del TASKS[task.name]


@pytest.mark.long
def test_the_rules_are_the_policies_own_unless_others_are_asked_for(policies, tmp_path, narrow):
    def returns(sources, **options):
        Transfer(
            sources, models=["cartpole"], episodes=4, output=tmp_path, overwrite=True, **options
        ).run()
        return json.loads((tmp_path / "transfer.json").read_text())["cells"][0]["mean"]

    folder = tmp_path / "runs" / "narrow"
    folder.mkdir(parents=True)
    config = TrainConfig.preset("tuned", task=narrow.name, episodes=5)
    begin_run(folder, config, load_model(), preset="tuned")
    write_results(folder, train(config), {})
    assert returns([folder]) <= 40
    assert returns(policies[:1]) > 40
    assert returns(policies[:1], task=narrow.name) <= 40
    said = r"Narrow-test-v0 \(40 steps\) and CartPole-v1 \(500 steps\); say by --task"
    with pytest.raises(ConfigError, match=said):
        returns([folder, policies[0]])
    assert returns(policies[:1], max_episode_steps=12) <= 12
    assert returns([folder, policies[0]], task="CartPole-v1") > 0
    with pytest.raises(ConfigError, match="task 'nothing'"):
        returns(policies[:1], task="nothing")
