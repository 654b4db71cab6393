"""`train --resume`: what goes on, and what is refused."""

from pathlib import Path

import pytest

from command_line import call
from mjcartpole.learning.checkpoints import LATEST
from nightly import few
from trainings import SHORT, contents

REFUSED = [
    (["--seed", "4"], ["--seed"]),
    (["--episodes", "9", "--gamma", "0.5"], ["--episodes", "--gamma"]),
    (["--bins", "1", "1", "2", "3"], ["--bins"]),
    (["--td-lambda", "None"], ["--td-lambda"]),
    (["--no-learn-last-step"], ["--learn-last-step"]),
    (["--preset", "article"], ["--preset"]),
    (["--backend", "gym"], ["--backend"]),
    (["--model", "cartpole.xml"], ["--model"]),
    (["--run-dir", "other"], ["--run-dir"]),
    (["--overwrite"], ["--overwrite"]),
    (["--seeds", "3"], ["--seeds"]),
    (["--seeds", "3", "--overwrite", "--alpha", "0.2"], ["--alpha", "--overwrite", "--seeds"]),
    (["--workers", "2"], ["--workers"]),
]


@pytest.mark.parametrize(("flags", "named"), few(REFUSED, *REFUSED[::4]), ids=" ".join)
def test_flags_that_a_resumed_run_would_ignore_are_refused(flags, named, killed, capsys):
    code, out, err = call(["train", "--resume", killed, *flags], capsys)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert all(flag in err for flag in named)
    assert (killed / LATEST).exists()


def test_a_complete_run_says_so(here, capsys):
    assert call([*SHORT, "--run-dir", "run"], capsys)[0] == 0
    before = contents("run")
    code, out, err = call(["train", "--resume", "run"], capsys)
    assert (code, out, err) == (0, "run is complete: nothing is left to do\n", "")
    assert contents("run") == before


def test_what_cannot_be_resumed(here, capsys):
    (here / "empty").mkdir()
    (here / "other").mkdir()
    (here / "other/notes.txt").write_text("notes")
    for path, message in (
        ("nowhere", "no run folder or checkpoint 'nowhere'"),
        ("empty", "'empty' holds no training that could be continued"),
        ("other", "'other' holds no training that could be continued"),
        ("other/notes.txt", "'other' holds no training that could be continued"),
    ):
        code, out, err = call(["train", "--resume", path], capsys)
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert message in err
    assert sorted(path.name for path in here.rglob("*")) == ["empty", "notes.txt", "other"]


def test_files_of_a_run_that_are_no_checkpoints(killed, capsys):
    (killed / "policy.json").write_text((killed / "config.json").read_text())
    for name in ("policy.json", "config.json", "model.xml"):
        code, out, err = call(["train", "--resume", killed / name], capsys)
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert f"{name}' is no checkpoint" in err
    assert (killed / LATEST).exists()


@pytest.mark.parametrize("every", ["-1", "nan", "often"])
def test_an_interval_that_makes_no_sense_is_refused(every, here, capsys):
    code, out, err = call(["train", "--checkpoint-every", every, "--run-dir", "run"], capsys)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert not Path("run").exists()
