"""`train`, killed at any moment: it goes on, and ends as if it had not been."""

import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from command_line import call
from mjcartpole.learning import runs
from mjcartpole.learning.checkpoints import LATEST
from mjcartpole.learning.run_model import MODEL
from nightly import few
from trainings import EACH, FILM, SHORT, SLOW, assert_equal_runs, dies_at, names, wait_until


@pytest.mark.parametrize("seed", few(range(3), 0))
def test_a_run_that_is_killed_again_and_again_ends_as_if_it_was_not(
    seed, here, fork, slow_reference, capsys
):
    rng = random.Random(seed)
    command = [*SLOW, "--run-dir", "run"]
    if seed == 2:
        call(["train", "--episodes", "3", "--no-video", "--no-curve", "--run-dir", "run"], capsys)
        command.append("--overwrite")
    resume = ["train", "--engine", "python", "--resume", "run", "--no-video", "--no-curve"]
    for _ in range(3):
        child = fork([*command, "--checkpoint-every", rng.choice(["0", "0.02", "0.1"])])
        wait_until((here / "run" / LATEST).exists, child)
        time.sleep(rng.uniform(0, 0.2))
        child.kill()
        assert child.wait() == -signal.SIGKILL
        command = resume
    code, out, err = call(["train", "--no-curve", "--resume", "run"], capsys)
    assert (code, err) == (0, "")
    assert re.search(r"goes on after [\d,]+ of 3,000 episodes, seed 0", out)
    assert_equal_runs("run", slow_reference)


@pytest.mark.long
def test_a_training_that_is_killed_goes_on_in_the_same_dream(here, fork, capsys):
    command = [*SLOW, "--method", "identify", "--fit-steps", "20", "--noise", "0.001"]
    child = fork([*command, "--run-dir", "run", "--checkpoint-every", "0"])
    wait_until((here / "run" / LATEST).exists, child)
    child.kill()
    assert child.wait() == -signal.SIGKILL
    assert " of 3,000 dreamt episodes" in call(["train", "--resume", "run"], capsys)[1]
    assert call([*command, "--engine", "compiled", "--run-dir", "whole"], capsys)[0] == 0
    assert_equal_runs("run", "whole")


BEGINNINGS = {
    "one": SHORT,
    "evaluated": [*SHORT, "--evaluate-every", "1"],
    "many": [*SHORT, "--engine", "compiled", "--seeds", "2", "--workers", "1"],
}


def tree(folder):
    """What lies in a folder: all but the times that trainings took."""
    return {
        str(path.relative_to(folder)): path.read_bytes() if path.is_file() else None
        for path in Path(folder).rglob("*")
        if path.name != runs.TIMING
    }


@pytest.mark.long
@EACH
@pytest.mark.parametrize("overwrite", [False, pytest.param(True, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", few(BEGINNINGS, "one"))
def test_a_kill_at_each_change_of_the_file_system(kind, overwrite, stride, here, fork, capsys):
    rng = random.Random(stride)
    assert call([*BEGINNINGS[kind], "--run-dir", "reference"], capsys)[0] == 0
    older = [*BEGINNINGS[kind], "--seed", "1", "--run-dir", "older"]
    assert call(older, capsys)[0] == 0
    again = ["--overwrite"] if overwrite else []
    begin = [*BEGINNINGS[kind], "--run-dir", "run", *again]
    for count in range(1 + stride // 2, 1000, stride):
        shutil.rmtree("run", ignore_errors=True)
        if overwrite:
            shutil.copytree("older", "run")
        child = fork(begin, prepare=lambda count=count: dies_at(count))
        if child.wait() == 0:
            break
        assert child.wait() == -signal.SIGKILL
        for _ in range(2):
            # Killed once more, anywhere, and then left in peace.
            resume = ["train", "--no-curve", "--resume", "run", "--checkpoint-every", "0"]
            child = fork(resume, prepare=lambda: dies_at(rng.randrange(1, 60)))
            assert child.wait() in {0, 2, -signal.SIGKILL}
        code, _, err = call(["train", "--no-curve", "--resume", "run"], capsys)
        if code:
            assert re.search("holds no training that could be|no run folder", err), count
            code, _, err = call(begin, capsys)
        assert code == 0, (count, err)
        if not (overwrite and tree("run") == tree("older")):  # Killed before it was touched.
            assert tree("run") == tree("reference"), count
    assert count > 50
    assert tree("run") == tree("reference")
    assert names(".") == ["child.err", "child.out", "older", "reference", "run"]


KILLED = [
    ["--episodes", "4000", "--seed", "5"],
    ["--preset", "article-terminal", "--backend", "gym", "--episodes", "400000", "--seed", "2"],
    ["--engine", "python", "--episodes", "700", "--seed", "9", "--ties", "random"],
]


@pytest.mark.slow
@pytest.mark.parametrize("config", KILLED, ids=["mujoco", "gym", "python"])
def test_thirty_runs_killed_at_any_moment_of_their_lives(config, here):
    command = [sys.executable, "-m", "mjcartpole", "train", "--no-video", "--no-curve"]
    started = time.monotonic()
    subprocess.run([*command, *config, "--run-dir", "ref"], check=True, capture_output=True)
    lasts, rng = time.monotonic() - started, random.Random(1)
    for number in range(10):
        folder = here / f"run-{number}"
        arguments, kills = [*config, "--run-dir", folder], 0
        while True:
            every = ["--checkpoint-every", rng.choice(["0", "0.05", "0.3"])]
            process = subprocess.Popen(
                [*command, *arguments, *every],
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
            )
            try:
                out, _ = process.communicate(
                    timeout=None if kills == 4 else rng.uniform(0.1, 1.1 * lasts)
                )
            except subprocess.TimeoutExpired:
                process.kill()
                out, _ = process.communicate()
                kills += 1
                arguments = ["--resume", folder]
                continue
            if process.returncode == 0:
                break
            assert re.search("holds no training that could be continued|no run folder", out)
            arguments = [*config, "--run-dir", folder]
        assert_equal_runs(folder, "ref")


DAMAGES = {
    "header": lambda content: b"M" + content[1:],
    "digest": lambda content: content[:30] + b"x" + content[31:],
    "archive": lambda content: content[:2000] + bytes([content[2000] ^ 1]) + content[2001:],
    "cut": lambda content: content[:-1],
    "half": lambda content: content[: len(content) // 2],
    "longer": lambda content: content + b"\0",
    "empty": lambda content: b"",
    "noise": lambda content: random.Random(0).randbytes(len(content)),
}


@pytest.mark.parametrize("damage", few(DAMAGES, "cut"))
def test_a_damaged_checkpoint_is_one_line_and_a_copy_of_it_goes_on(
    damage, killed, slow_reference, capsys
):
    latest, copy = killed / LATEST, killed / "copy.bin"
    shutil.copy(latest, copy)
    latest.write_bytes(DAMAGES[damage](latest.read_bytes()))
    before = {path.name: path.read_bytes() for path in killed.iterdir()}
    code, out, err = call(["train", "--resume", killed], capsys)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert f"'{latest}'" in err
    assert "start again with --overwrite" in err
    after = {path.name: path.read_bytes() for path in killed.iterdir()}
    assert after == {name: text for name, text in before.items() if not name.startswith(".")}
    code, _, err = call(["train", "--resume", copy], capsys)
    assert (code, err) == (0, "")
    copy.unlink()
    assert_equal_runs(killed, slow_reference)


@pytest.mark.parametrize("name", [MODEL, runs.CONFIG])
def test_what_lies_beside_a_checkpoint_counts_as_well(name, killed, capsys):
    path = killed / name
    path.write_text(path.read_text().replace("0.98", "0.97").replace('mass="0.1"', 'mass="0.2"'))
    code, out, err = call(["train", "--resume", killed], capsys)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert {MODEL: "another model", runs.CONFIG: "gamma 0.98, not 0.97"}[name] in err
    path.write_text("<")
    code, _, err = call(["train", "--resume", killed], capsys)
    assert (code, err.count("\n")) == (2, 1)


@pytest.mark.slow
def test_a_film_that_a_kill_cut_short_keeps_its_name(here, fork, capsys):
    Path("videos").mkdir()
    Path("videos/run.mp4").write_text("another's")
    child = fork([*FILM, "run"], prepare=_dies_when_it_has_filmed)
    assert child.wait() == -signal.SIGKILL
    assert call(["train", "--no-curve", "--resume", "run"], capsys)[0] == 0
    assert names("videos") == ["run-2.mp4", "run.mp4"]
    assert call([*FILM, "other/run", "--no-video", "--no-curve"], capsys)[0] == 0
    summaries = [
        json.loads(Path(name, "summary.json").read_text()) for name in ("run", "other/run")
    ]
    assert list(summaries[0].items()) == [*summaries[1].items(), ("video", "videos/run-2.mp4")]


def _dies_when_it_has_filmed():
    runs.finish_run = lambda folder: os.kill(os.getpid(), signal.SIGKILL)
