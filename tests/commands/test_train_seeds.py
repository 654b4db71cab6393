"""`train --seeds`: each as if alone, whatever happens to the others."""

import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from command_line import call, done
from mjcartpole.physics.load import load_model
from nightly import few
from trainings import EACH, assert_equal_runs, dies_at, names, needs_proc, wait_until

FEW = ["train", "--no-curve", "--episodes", "12", "--seed", "3"]


@pytest.fixture(scope="module")
def three(tmp_path_factory):
    """Each of three seeds, trained alone."""
    folder = tmp_path_factory.mktemp("three")
    for seed in (3, 4, 5):
        arguments = ["train", "--episodes", "12", "--seed", seed, "--no-video", "--no-curve"]
        done([*arguments, "--run-dir", folder / f"alone-{seed}"])
    return folder


@pytest.fixture
def alone(here, three):
    """The same, in a folder of its own."""
    return shutil.copytree(three, here, dirs_exist_ok=True)


def assert_equal_seeds(folder):
    for seed in (3, 4, 5):
        assert_equal_runs(f"{folder}/seed-{seed}", f"alone-{seed}")
    assert [name for name in names(folder) if name != "versions.json"] == [
        "aggregate.json",
        "model.xml",
        "seed-3",
        "seed-4",
        "seed-5",
        "seeds.csv",
        "seeds.json",
    ]


def test_each_seed_is_as_if_it_was_trained_alone(alone, capsys):
    code, out, err = call([*FEW, "--seeds", "3", "--workers", "2"], capsys)
    assert (code, err) == (0, "")
    folder = re.search(r"^runs   (\S+)$", out, re.M)[1]
    assert folder == "runs/tuned-mujoco-episodes12-seeds3-5"
    assert_equal_seeds(folder)
    summaries = [json.loads(Path(f"alone-{seed}/summary.json").read_text()) for seed in (3, 4, 5)]
    means = [summary["evaluation"]["mean"] for summary in summaries]
    for seed, summary in zip((3, 4, 5), summaries, strict=True):
        mean, minimum = summary["evaluation"]["mean"], summary["evaluation"]["minimum"]
        assert re.search(rf"^ +{seed} +{mean:.2f} +{minimum:.0f}$", out, re.M)
    rows = Path(folder, "seeds.csv").read_text().splitlines()
    assert rows[0] == "seed,mean,minimum,failed"
    assert [float(row.split(",")[1]) for row in rows[1:]] == means
    assert [row.split(",")[3] for row in rows[1:]] == ["no"] * 3
    figures = json.loads(Path(folder, "aggregate.json").read_text())
    assert (figures["seeds"], figures["failed"]) == (3, {})
    assert figures["greedy_return"]["mean"] == pytest.approx(sum(means) / 3)
    assert figures["greedy_return"]["minimum"] == min(means)
    assert f"mean {sum(means) / 3:.2f}, minimum {min(means):.2f}" in out


@pytest.mark.slow
def test_the_python_engine_in_processes_gives_the_same(alone):
    command = [sys.executable, "-m", "mjcartpole", *FEW, "--seeds", "3", "--workers", "2"]
    process = subprocess.run(
        [*command, "--engine", "python", "--run-dir", "many"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (process.returncode, process.stderr) == (0, "")
    assert_equal_seeds("many")


@pytest.mark.long
@EACH
def test_seeds_that_are_killed_at_changes_of_the_file_system(stride, alone, fork, capsys):
    rng = random.Random(stride)
    begin = [*FEW, "--seeds", "3", "--workers", "1", "--checkpoint-every", "0", "--run-dir", "many"]
    for count in (*range(1, 12, stride), *(rng.randrange(12, 110) for _ in range(18 // stride))):
        shutil.rmtree("many", ignore_errors=True)
        child = fork(begin, prepare=lambda count=count: dies_at(count))
        assert child.wait() in {0, -signal.SIGKILL}
        code, _, err = call(["train", "--resume", "many"], capsys)
        if code:
            assert re.search("holds no training that could be continued|no run folder", err)
            code, _, err = call(begin, capsys)
        assert (code, err) == (0, ""), count
        assert_equal_seeds("many")


@pytest.mark.slow
def test_seeds_that_are_stopped_go_on(here, fork, capsys):
    config = ["--preset", "article-terminal", "--backend", "gym", "--episodes", "20000"]
    child = fork(["train", *config, "--seeds", "2", "--run-dir", "many"])
    wait_until((here / "many/seed-1/config.json").exists, child)
    child.kill(signal.SIGINT)
    assert child.wait() == 130
    assert child.err.count("\n") == 1
    assert "go on with: mjcartpole train --resume many" in child.err
    assert "stopped" in child.out
    code, out, err = call(["train", "--resume", "many", "--workers", "2"], capsys)
    assert (code, err) == (0, "")
    assert "stopped" not in out
    for seed in ("0", "1"):
        alone = [
            "train",
            *config,
            "--seed",
            seed,
            "--no-video",
            "--no-curve",
            "--run-dir",
            f"alone-{seed}",
        ]
        assert call(alone, capsys)[0] == 0
        assert_equal_runs(f"many/seed-{seed}", f"alone-{seed}")
    code, out, _ = call(["train", "--resume", "many"], capsys)
    assert code == 0


def processes_here():
    """Ids of other processes whose working folder is this one."""
    found = set()
    for path in Path("/proc").glob("[0-9]*"):
        try:
            if (path / "cwd").readlink() == Path.cwd() and int(path.name) != os.getpid():
                found.add(int(path.name))
        except OSError:
            continue
    return found


@pytest.mark.long
@needs_proc
@pytest.mark.parametrize("number", few([signal.SIGKILL, signal.SIGTERM], signal.SIGKILL))
def test_the_workers_of_a_training_that_is_gone_go_as_well(number, here, capsys):
    command = ["train", "--engine", "python", "--episodes", "100000", "--seeds", "2"]
    process = subprocess.Popen(
        [sys.executable, "-m", "mjcartpole", *command, "--run-dir", "many"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        wait_until(lambda: all((here / f"many/seed-{n}/config.json").exists() for n in (0, 1)))
        workers = processes_here() - {process.pid}
        assert len(workers) >= 2
        process.send_signal(number)
        assert process.wait(timeout=60) == {signal.SIGKILL: -9, signal.SIGTERM: 143}[number]
        wait_until(lambda: not processes_here(), seconds=20)
    finally:
        for pid in processes_here():
            os.kill(pid, signal.SIGKILL)


@pytest.fixture
def wild(here):
    """A model whose pushes to the right diverge; some seeds never push there."""
    text = load_model().xml.replace('ctrlrange="-1 1"', 'ctrlrange="-1 9e9"')
    (here / "wild.xml").write_text(text)
    greedy = ["--epsilon", "0", "--epsilon-final", "0", "--q-init-low", "0", "--q-init-high", "1"]
    return ["train", "--model", "wild.xml", "--bins", *"1111", "--episodes", "8", *greedy]


@pytest.mark.long
def test_a_failing_seed_does_not_take_the_others_down(wild, capsys):
    arguments = [*wild, "--seed", "3", "--seeds", "3", "--run-dir", "many"]
    code, out, err = call(arguments, capsys)
    assert code == 2
    assert err.startswith("mjcartpole: no policy can balance this: ")
    assert err.count("\n") == 3
    for seed in (3, 4):
        assert re.search(rf"seed {seed} failed: episode \d+, step \d+: .*wild.xml diverged", err)
        assert re.search(rf"^ +{seed} +failed$", out, re.M)
    assert (
        call([*wild, "--seed", "5", "--no-video", "--no-curve", "--run-dir", "alone"], capsys)[0]
        == 0
    )
    assert_equal_runs("many/seed-5", "alone")
    rows = Path("many/seeds.csv").read_text().splitlines()
    assert [row.split(",")[3] for row in rows[1:]] == ["yes", "yes", "no"]
    assert rows[1] == "3,,,yes"
    figures = json.loads(Path("many/aggregate.json").read_text())
    assert sorted(figures["failed"]) == ["3", "4"]
    assert figures["greedy_return"]["count"] == 1


@pytest.mark.long
def test_a_seed_that_is_blocked_is_named_and_goes_on_once_it_is_free(alone, capsys):
    assert call([*FEW, "--seeds", "3", "--run-dir", "many"], capsys)[0] == 0
    shutil.rmtree("many/seed-4")
    Path("many/seed-4").write_text("a file in the way")
    shutil.rmtree("many/seed-5")
    code, _, err = call(["train", "--resume", "many"], capsys)
    assert (code, err.count("\n")) == (2, 1)
    assert "seed 4 failed" in err
    assert_equal_runs("many/seed-5", "alone-5")
    Path("many/seed-4").unlink()
    code, _, err = call(["train", "--resume", "many"], capsys)
    assert (code, err) == (0, "")
    assert_equal_seeds("many")


@pytest.mark.long
@pytest.mark.parametrize(
    "events", [[], pytest.param(["--tensorboard"], marks=pytest.mark.slow)], ids=["plain", "events"]
)
def test_many_seeds_are_only_overwritten_on_request(events, alone, capsys):
    old = ["train", "--episodes", "5", "--seeds", "4", "--run-dir", "many", *events]
    assert call(old, capsys)[0] == 0
    before = {path: path.read_bytes() for path in Path("many").rglob("*") if path.is_file()}
    new = [*FEW, "--seeds", "3", "--run-dir", "many"]
    code, _, err = call(new, capsys)
    assert (code, err.count("\n")) == (2, 1)
    assert "--overwrite" in err
    assert "--resume many" in err
    assert {path: path.read_bytes() for path in Path("many").rglob("*") if path.is_file()} == before
    code, _, err = call([*new, "--overwrite"], capsys)
    assert (code, err) == (0, "")
    assert_equal_seeds("many")


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        (["--seeds", "0"], "seeds must be a number from 1"),
        (["--seeds", "-2"], "seeds must be a number from 1"),
        (["--seeds", "1000001"], "seeds must be a number from 1"),
        (["--seeds", "2.5"], "2.5"),
        (["--seeds", "2", "--workers", "0"], "workers must be a whole number from 1"),
        (["--seeds", "2", "--workers", "-1"], "workers must be a whole number from 1"),
        (["--workers", "2"], "--workers is for several --seeds"),
        (["--seeds", "2", "--engine", "fast"], "fast"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_seeds_and_workers_that_make_no_sense(flags, message, here, capsys):
    code, out, err = call(["train", "--run-dir", "many", *flags], capsys)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert message in err
    assert not Path("many").exists()


@pytest.mark.parametrize("seeds", [1, 3])
def test_what_cannot_be_mirrored_is_one_line_and_no_folder(seeds, here, capsys):
    code, out, err = call(["train", "--model", "wind", "--mirror", "--seeds", str(seeds)], capsys)
    assert (code, out) == (2, "")
    assert "wind does not: pushed to the right" in err
    assert err.count("\n") == 1
    assert not list(here.iterdir())
