"""`train`, stopped: what was learned is kept, and it is said how to go on."""

import json
import os
import re
import signal
import time
from pathlib import Path

import pytest

from command_line import call
from mjcartpole.learning import runs
from mjcartpole.learning.checkpoints import LATEST
from nightly import few
from trainings import SAME, SLOW, assert_equal_runs, contents, names, wait_until


@pytest.mark.long
@pytest.mark.parametrize("engine", few(["compiled", "python"], "compiled"))
@pytest.mark.parametrize(
    ("number", "code"),
    few([(signal.SIGINT, 130), (signal.SIGTERM, 143)], (signal.SIGINT, 130)),
    ids=["INT", "TERM"],
)
def test_a_stopped_run_keeps_what_it_learned_and_says_how_to_go_on(
    engine, number, code, here, fork, slow_reference, capsys
):
    command, reference = SLOW, slow_reference
    if engine == "compiled":
        config = ["--preset", "article-terminal", "--backend", "gym", "--episodes", "20000"]
        command, reference = ["train", *config, "--no-video", "--no-curve"], "reference"
        assert call([*command, "--run-dir", reference], capsys)[0] == 0
    child = fork([*command, "--run-dir", "run", "--checkpoint-every", "0"])
    wait_until((here / "run" / LATEST).exists, child)
    child.kill(number)
    assert child.wait() == code
    assert child.err.count("\n") == 1
    resume = re.search(r"go on with: mjcartpole (.*)$", child.err.strip())[1]
    summary = json.loads(Path("run/summary.json").read_text())
    done = int(re.search(r"interrupted after ([\d,]+) of", child.err)[1].replace(",", ""))
    assert (summary["interrupted"], summary["episodes"]) == (True, done)
    assert len(Path("run/episodes.csv").read_text().splitlines()) == done + 1
    assert call(["evaluate", "run", "--episodes", "1"], capsys)[0] == 0
    before = {name: Path("run", name).read_bytes() for name in SAME}
    code, _, err = call([*command, "--run-dir", "run"], capsys)
    assert code == 2
    assert "go on with --resume run" in err
    assert before == contents("run")
    assert call(resume.split(), capsys)[0] == 0
    assert_equal_runs("run", reference)


def test_a_second_ctrl_c_ends_at_once_and_nothing_is_broken(here, fork, slow_reference, capsys):
    child = fork([*SLOW, "--run-dir", "run", "--checkpoint-every", "0"])
    wait_until((here / "run" / LATEST).exists, child)
    child.kill(signal.SIGINT)
    child.kill(signal.SIGINT)
    time.sleep(0.001)
    if child.lives():
        child.kill(signal.SIGINT)
    assert child.wait() == 130
    assert child.err.count("\n") == 1
    # What was being written at that moment goes with the next command.
    assert call(["train", "--no-curve", "--resume", "run"], capsys)[0] == 0
    assert not [name for name in names("run") if name.startswith(".")]
    assert_equal_runs("run", slow_reference)


@pytest.mark.slow
def test_a_signal_while_evaluating_leaves_a_run_that_goes_on(here, fork, capsys):
    command = ["train", "--engine", "python", "--episodes", "200", "--no-video", "--no-curve"]
    child = fork([*command, "--run-dir", "run"])
    wait_until((here / "run" / "summary.json").exists, child)
    child.kill(signal.SIGTERM)
    assert child.wait() == 143
    assert "interrupted after 200 of 200 episodes" in child.err
    assert "train --resume run" in child.err
    assert call(["train", "--no-curve", "--resume", "run"], capsys)[0] == 0
    assert call([*command, "--run-dir", "reference", "--engine", "compiled"], capsys)[0] == 0
    assert_equal_runs("run", "reference")


@pytest.mark.slow
def test_a_signal_while_filming_leaves_a_run_that_goes_on(here, fork, capsys):
    child = fork(["train", "--episodes", "600", "--backend", "gym", "--run-dir", "run"])
    wait_until(lambda: "run    run" in child.out, child)
    child.kill(signal.SIGINT)
    assert child.wait() == 130
    assert child.err.count("\n") == 1
    assert not list(here.glob("videos/*"))
    code, out, _ = call(["train", "--no-curve", "--resume", "run"], capsys)
    assert code == 0
    assert "video  videos/run.mp4" in out
    assert json.loads(Path("run/summary.json").read_text())["video"] == "videos/run.mp4"
    assert names("run") == sorted(runs.FILES)


def test_a_signal_before_anything_was_learned_leaves_nothing(here, fork):
    child = fork(
        ["train", "--episodes", "2", "--no-video", "--no-curve", "--run-dir", "run"], prepare=_stops
    )
    assert child.wait() == 130
    assert child.err == "mjcartpole: interrupted\n"
    assert not Path("run").exists()


def _stops():
    """Send Ctrl-C as soon as the run is announced."""
    begin_run = runs.begin_run

    def begun(*arguments, **options):
        begin_run(*arguments, **options)
        os.kill(os.getpid(), signal.SIGINT)

    runs.begin_run = begun
