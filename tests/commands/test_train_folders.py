"""`train` and its folder: one training at a time, and nothing of somebody else's is taken."""

import json
import os
from pathlib import Path

import pytest

from command_line import call
from mjcartpole.learning import runs
from mjcartpole.learning.checkpoints import LATEST
from trainings import FILM, NINE, SHORT, SLOW, assert_equal_runs, names, wait_until


@pytest.mark.long
def test_one_run_folder_has_one_training_while_it_lives(here, fork, slow_reference, capsys):
    child = fork([*SLOW, "--run-dir", "run", "--checkpoint-every", "0.05"])
    wait_until((here / "run" / LATEST).exists, child)
    for arguments in (
        [*SLOW, "--run-dir", "run", "--overwrite"],
        ["train", "--no-curve", "--resume", "run"],
        ["train", "--resume", f"run/{LATEST}"],
    ):
        code, out, err = call(arguments, capsys)
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert "is in use by another training" in err
    assert child.lives()
    child.kill()
    child.wait()
    assert call(["train", "--no-curve", "--resume", "run"], capsys)[0] == 0
    assert_equal_runs("run", slow_reference)


def test_a_resumed_training_holds_its_folder_too(killed, fork, capsys):
    child = fork(["train", "--engine", "python", "--resume", killed])
    wait_until(lambda: "goes on after" in child.out, child)
    code, _, err = call(["train", "--resume", killed], capsys)
    assert (code, err.count("\n")) == (2, 1)
    assert "is in use by another training" in err


@pytest.mark.long
def test_a_folder_of_seeds_has_one_training_while_it_lives(here, fork, capsys):
    seeds = ["train", "--backend", "gym", "--episodes", "400000", "--no-curve", "--seeds", "2"]
    child = fork([*seeds, "--preset", "article-terminal", "--run-dir", "many"])
    wait_until((here / "many/seed-1/config.json").exists, child)
    for arguments in (
        [*seeds, "--run-dir", "many", "--overwrite"],
        ["train", "--resume", "many"],
        ["train", "--resume", "many/seed-1"],
    ):
        code, _, err = call(arguments, capsys)
        assert (code, err.count("\n")) == (2, 1)
        assert "is in use by another training" in err
    child.kill()
    child.wait()
    short = [
        "train",
        "--backend",
        "gym",
        "--episodes",
        "4",
        "--no-curve",
        "--seeds",
        "2",
        "--run-dir",
        "many",
    ]
    code, _, err = call([*short, "--overwrite"], capsys)
    assert (code, err) == (0, "")
    assert names("many/seed-0") == sorted(runs.FILES)


def test_a_folder_with_a_model_and_other_work_is_never_taken(here, capsys):
    (here / "mine").mkdir()
    (here / "mine/model.xml").write_text("my own model")
    (here / "mine/thesis.tex").write_text("years of work")
    for more in ([], ["--overwrite"], ["--seeds", "2"], ["--seeds", "2", "--overwrite"]):
        code, _, err = call([*SHORT, "--run-dir", "mine", *more], capsys)
        assert (code, err.count("\n")) == (2, 1)
        assert names("mine") == ["model.xml", "thesis.tex"]
        assert Path("mine/model.xml").read_text() == "my own model"


def test_a_model_of_ones_own_is_never_replaced(here, capsys):
    (here / "mine").mkdir()
    (here / "mine/model.xml").write_text("my own model")
    for more in ([], ["--seeds", "2"]):
        assert call([*SHORT, "--run-dir", "mine", *more], capsys)[0] == 2
        assert Path("mine/model.xml").read_text() == "my own model"


@pytest.mark.long
def test_one_seed_and_many_do_not_share_a_folder(here, capsys):
    assert call([*SHORT, "--run-dir", "one"], capsys)[0] == 0
    assert (
        call([*SHORT, "--seeds", "2", "--engine", "compiled", "--run-dir", "many"], capsys)[0] == 0
    )
    before = {path: path.read_bytes() for path in here.rglob("*") if path.is_file()}
    for more in ([], ["--overwrite"]):
        for arguments in (["--run-dir", "many"], ["--run-dir", "one", "--seeds", "2"]):
            code, _, err = call([*SHORT, *arguments, *more], capsys)
            assert (code, err.count("\n")) == (2, 1)
    assert {path: path.read_bytes() for path in here.rglob("*") if path.is_file()} == before


@pytest.mark.slow
def test_a_film_of_another_run_stays(here, capsys):
    Path("videos").mkdir()
    for name, film in (("a/run", "run"), ("b/run", "run-2"), ("c/run", "run-3")):
        assert f"video  videos/{film}.mp4" in call([*FILM, name], capsys)[1]
        assert json.loads(Path(name, "summary.json").read_text())["video"] == f"videos/{film}.mp4"
    before = {path: path.read_bytes() for path in Path("videos").iterdir()}
    out = call([*FILM, "b/run", "--overwrite", "--seed", "3"], capsys)[1]
    assert "video  videos/run-2.mp4" in out
    after = {path: path.read_bytes() for path in Path("videos").iterdir()}
    changed = [path.name for path in before if before[path] != after[path]]
    assert (changed, before.keys()) == (["run-2.mp4"], after.keys())


@pytest.mark.parametrize("film", ["thesis.mp4", "videos/other.mp4", "../videos/run.mp4"])
def test_only_a_film_of_its_own_goes_with_a_run(film, here, capsys):
    (here / "work/videos").mkdir(parents=True)
    os.chdir("work")
    assert call([*NINE, "--run-dir", "run"], capsys)[0] == 0
    Path(film).parent.mkdir(exist_ok=True)
    Path(film).write_text("years of work")
    summary = json.loads(Path("run/summary.json").read_text())
    Path("run/summary.json").write_text(json.dumps({**summary, "video": film}))
    assert call([*NINE, "--run-dir", "run", "--overwrite"], capsys)[0] == 0
    assert Path(film).read_text() == "years of work"
