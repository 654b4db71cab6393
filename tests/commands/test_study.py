"""The command study: from a file to tables, and on from there."""

import contextlib
import csv
import json
import os
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import pytest

from command_line import call
from mjcartpole.commands import study_run
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.evaluation import evaluate
from mjcartpole.learning.training import train
from mjcartpole.studies.study.expect import Expected
from mjcartpole.studies.study.records import LOG

FILE = """
[study]
seeds = {seeds}
measure = ["greedy_mean", "area_under_curve"]
[base]
backend = "gym"
episodes = {episodes}
[factors]
alpha = {alpha}
ties = ["first", "random"]
"""


@pytest.fixture
def ask(tmp_path, monkeypatch):
    """Write a study's file, in an empty folder."""
    monkeypatch.chdir(tmp_path)

    def write(seeds=2, alpha="[0.1, 0.3]", episodes=5):
        text = FILE.format(seeds=seeds, alpha=alpha, episodes=episodes)
        (tmp_path / "a.toml").write_text(text)
        return tmp_path / "studies" / "a"

    return write


def table(folder):
    with (folder / "runs.csv").open() as file:
        return list(csv.DictReader(file))


def lasting(folder):
    """What is the same wherever it was done."""
    rows = [
        {k: v for k, v in row.items() if k not in ("seconds", "steps_per_second", "host")}
        for row in table(folder)
    ]
    return rows, (folder / "curves.csv").read_text()


def test_a_row_is_what_the_training_says(ask, capsys):
    folder = ask()
    code, out, err = call(["study", "a.toml"], capsys)
    assert (code, err) == (0, "")
    assert "4 points (grid: alpha, ties)\n8 runs, 2 seeds each\n" in out
    rows = table(folder)
    assert [(row["alpha"], row["ties"], row["seed"]) for row in rows[:3]] == [
        ("0.1", "first", "0"),
        ("0.1", "first", "1"),
        ("0.1", "random", "0"),
    ]
    alone = train(TrainConfig(backend="gym", episodes=5, alpha=0.3, ties="random", seed=1))
    assert float(rows[-1]["greedy_mean"]) == evaluate(alone.policy, backend="gym").mean
    assert float(rows[-1]["area_under_curve"]) == alone.returns.mean()
    assert (folder / "study.toml").read_text() == (folder.parents[1] / "a.toml").read_text()


def test_the_order_and_the_number_of_workers_change_no_byte_but_of_times(ask, capsys):
    folder = ask()
    _, one, _ = call(["study", "a.toml", "--workers", 1], capsys)
    first = lasting(folder)
    lines = (folder / LOG).read_bytes().splitlines(keepends=True)
    (folder / LOG).write_bytes(b"".join(reversed(lines[3:])))
    _, again, _ = call(["study", "a.toml", "--workers", 3, "--resume"], capsys)
    assert lasting(folder) == first
    assert "5 runs done before, 3 left" in again
    assert one.splitlines()[-1] == again.splitlines()[-1]


def test_what_is_added_is_all_that_is_done(ask, capsys):
    folder = ask()
    call(["study", "a.toml"], capsys)
    before = (folder / LOG).read_bytes()
    ask(seeds=3, alpha="[0.1, 0.2, 0.3]")
    code, out, _ = call(["study", "a.toml", "--resume"], capsys)
    assert code == 0 and "8 runs done before, 10 left" in out
    log = (folder / LOG).read_bytes()
    assert log.startswith(before) and log.count(b"\n") == 18
    assert len({json.loads(line)["key"] for line in log.splitlines()}) == len(table(folder)) == 18
    ask(seeds=1)
    _, out, _ = call(["study", "a.toml", "--resume"], capsys)
    assert "0 left" in out and len(table(folder)) == 4


def test_a_study_that_is_there_is_kept(ask, capsys):
    folder = ask(alpha="[0.1]", seeds=1)
    call(["study", "a.toml"], capsys)
    code, _, err = call(["study", "a.toml"], capsys)
    assert code == 2 and "go on with it with --resume" in err and err.count("\n") == 1
    code, out, _ = call(["study", "a.toml", "--overwrite"], capsys)
    assert code == 0 and "done before" not in out
    assert len(table(folder)) == 2
    (folder.parent / "b").mkdir()
    (folder.parent / "b" / "mine.txt").write_text("mine")
    code, _, err = call(["study", "a.toml", "--run-dir", "studies/b", "--overwrite"], capsys)
    assert code == 2 and "holds other files" in err
    assert [path.name for path in (folder.parent / "b").iterdir()] == ["mine.txt"]


def test_a_dry_run_says_what_it_would_be_and_keeps_nothing(ask, capsys):
    folder = ask()
    code, out, _ = call(["study", "a.toml", "--dry-run", "--workers", 2], capsys)
    assert code == 0 and not folder.parent.exists()
    words = (
        "4 points",
        "8 runs, 2 seeds each",
        "greedy_mean: ",
        "steps    about",
        "with 2 at once",
    )
    assert [word for word in words if word not in out] == []


@pytest.mark.parametrize(
    ("flags", "there", "said"),
    [
        (["--workers", 8], 0, "50 s with 8 at once"),
        (["--workers", 1], 0, "1 min 40 s with 1 at once"),
        (["--scheduler", "a:1"], 4, "25 s with 4 at once"),
        (["--scheduler", "a:1"], 0, "1 min 40 s with one worker; the scheduler has none yet"),
    ],
)
def test_the_time_of_a_dry_run_is_that_of_the_cores_there_are(
    ask, capsys, monkeypatch, flags, there, said
):
    ask()
    monkeypatch.setattr(study_run, "connected", lambda _: contextlib.nullcontext(object()))
    monkeypatch.setattr(study_run, "threads_of", lambda _: there)
    monkeypatch.setattr(study_run, "available_cores", lambda: 2)
    monkeypatch.setattr(study_run, "expect", lambda _: Expected(10, 100))
    code, out, _ = call(["study", "a.toml", "--dry-run", *flags], capsys)
    assert code == 0 and f"time     about {said}\n" in out


def test_each_mistake_has_its_line(ask, capsys):
    ask(alpha="[]", seeds=0)
    code, out, err = call(["study", "a.toml"], capsys)
    assert (code, out) == (2, "")
    lines = err.splitlines()
    assert len(lines) == 2 and all(line.startswith("mjcartpole: error: [") for line in lines)


def test_runs_of_other_versions_are_told(ask, capsys):
    folder = ask()
    call(["study", "a.toml"], capsys)
    text = (folder / LOG).read_text()
    numpy = json.loads(text.splitlines()[0])["versions"]["numpy"]
    (folder / LOG).write_text(text.replace(f'"numpy": "{numpy}"', '"numpy": "1.0"', 1))
    code, out, err = call(["study", "a.toml", "--resume"], capsys)
    assert code == 0 and "8 runs done before, 0 left" in out
    said = (
        f"some runs were done before with numpy '1.0' (here '{numpy}'); --overwrite does all anew"
    )
    assert err == f"mjcartpole: {said}\n"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "give one study: mjcartpole study FILE.toml"),
        (["nothing.toml"], "cannot be read: No such file"),
        (["a.toml", "--resume", "--overwrite"], "--overwrite removes it"),
        (["a.toml", "--workers", "0"], "workers must be a whole number from 1 up"),
    ],
)
def test_words_that_make_no_sense(ask, capsys, words, said):
    folder = ask()
    code, _, err = call(["study", *words], capsys)
    assert code == 2 and said in err and err.count("\n") == 1
    assert not folder.exists()


def test_a_run_that_fails_is_told_and_takes_no_other_down(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.toml").write_text(
        '[study]\nseeds = 1\n[base]\nepisodes = 3\n[factors]\n"motor.gear" = ["10", "1e12"]'
    )
    code, _, err = call(["study", "a.toml"], capsys)
    assert code == 2 and "motor.gear=1e12 seed=0 failed: " in err and "diverged" in err
    good, bad = table(tmp_path / "studies" / "a")
    assert float(good["greedy_mean"]) > 0 and not good["error"]
    assert bad["greedy_mean"] == "" and "diverged" in bad["error"]
    code, out, _ = call(["study", "a.toml", "--resume"], capsys)
    assert "2 runs done before, 0 left" in out


@pytest.mark.long
def test_the_example_of_the_docs(tmp_path, monkeypatch, capsys):
    docs = Path(__file__).parents[2] / "docs"
    text = (docs / "study.toml").read_text()
    assert textwrap.indent(text, "    ", lambda line: line.strip()) in (
        docs / "studies.md"
    ).read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    Path("study.toml").write_text(text.replace("= 10", "= 2").replace("= 300", "= 5"))
    code, out, err = call(["study", "study.toml"], capsys)
    assert (code, err) == (0, "") and "8 points (grid: alpha, td_lambda, pole.length)" in out
    code, out, err = call(["study", "report", "studies/study"], capsys)
    assert (code, err) == (0, "") and out.count("Best by ") == 2


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="there are no such signals")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_what_is_done_outlives_a_signal(ask, number, capsys):
    folder = ask(seeds=40, episodes=400)
    command = [sys.executable, "-m", "mjcartpole", "study", "a.toml"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as begun:
        until = time.monotonic() + 120
        while not ((folder / LOG).exists() and (folder / LOG).read_bytes().count(b"\n") > 5):
            assert time.monotonic() < until
            time.sleep(0.02)
        begun.send_signal(number)
        said = begun.stderr.read()
    if number == signal.SIGINT:
        assert begun.returncode == 130 and "go on with: mjcartpole study a.toml" in said
    done = (folder / LOG).read_bytes().count(b"\n")
    code, out, _ = call(["study", "a.toml", "--resume"], capsys)
    assert code == 0 and f"{done} runs done before, {160 - done} left" in out
    rows = table(folder)
    assert len({row["key"] for row in rows}) == 160
    call(["study", "a.toml", "--run-dir", "whole"], capsys)
    assert lasting(folder.parents[1] / "whole") == lasting(folder)
