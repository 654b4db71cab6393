"""`train`: what it prints, and where it goes."""

import json
import os
import re
import select
import shlex
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from command_line import call
from mjcartpole.commands import films
from mjcartpole.errors import RenderError
from mjcartpole.learning import runs
from mjcartpole.learning.checkpoints import LATEST
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.training import train
from trainings import FILM, NINE, SHORT, SLOW, contents, names, wait_until


@pytest.mark.long
def test_events_are_replaced_with_the_run_they_belong_to(here, capsys):
    pytest.importorskip("tensorboardX")
    assert call([*SHORT, "--tensorboard", "--run-dir", "run"], capsys)[0] == 0
    assert len(list(here.glob("run/events.out.tfevents.*"))) == 1
    assert call([*SHORT, "--overwrite", "--run-dir", "run"], capsys)[0] == 0
    assert names("run") == sorted(runs.FILES)


def test_without_tensorboardx_nothing_is_begun(here, fork):
    child = fork(
        [*SHORT, "--tensorboard", "--run-dir", "run"],
        prepare=lambda: sys.modules.update(tensorboardX=None),
    )
    assert child.wait() == 2
    assert child.err.count("\n") == 1
    assert "pip install 'mjcartpole[tensorboard]'" in child.err
    assert (child.out, Path("run").exists()) == ("", False)


def test_a_film_without_pillow_is_refused_before_training(here, fork, capsys, monkeypatch):
    def without_pillow(words):
        child = fork(words, prepare=lambda: sys.modules.update(PIL=None))
        assert (child.wait(), child.out) == (2, "")
        assert child.err == (
            "mjcartpole: error: a film needs the package pillow: pip install pillow; "
            "or leave it out: --no-video\n"
        )

    def full(*_):
        raise RenderError("no film")

    without_pillow([*FILM, "run"])
    assert not Path("run").exists()
    monkeypatch.setattr(films, "film_result", full)
    assert call([*FILM, "run"], capsys)[0] == 2
    without_pillow(["train", "--resume", "run"])


def test_what_training_prints(here, capsys):
    code, out, err = call(
        ["train", "--episodes", "25", "--log-every", "10", "--no-video", "--no-curve"], capsys
    )
    assert (code, err) == (0, "")
    assert re.search(r"^tuned on mujoco: 25 episodes, seed 0$", out, re.M)
    returns = train(TrainConfig(episodes=25)).returns
    for end, block in ((10, returns[:10]), (20, returns[10:20]), (25, returns[20:])):
        assert re.search(rf"^\s+{end}\s+{block.mean():.1f}$", out, re.M)
    assert "run    runs/tuned-mujoco-episodes25-log_every10-seed0" in out
    assert (here / "runs" / "tuned-mujoco-episodes25-log_every10-seed0" / "summary.json").is_file()
    assert not (here / "videos").exists()


def test_a_second_training_says_where_it_goes(here, capsys):
    first = Path("runs/tuned-gym-episodes9-seed0")
    assert "is there already" not in call(NINE, capsys)[1]
    code, out, _ = call(NINE, capsys)
    assert code == 0
    assert out.splitlines()[1] == f"{first} is there already: this goes to {first}-2"
    assert f"run    {first}-2" in out
    assert contents(first) == contents(f"{first}-2")
    code, out, _ = call([*NINE, "--overwrite"], capsys)
    assert (code, "is there already" in out) == (0, False)
    assert names("runs") == [first.name, f"{first.name}-2"]


def test_a_complete_run_names_the_unfinished_one_beside_it(here, capsys):
    first = Path("runs/tuned-gym-episodes9-seed0")
    for _ in range(2):
        call(NINE, capsys)
    Path(f"{first}-2/summary.json").unlink()
    hint = f"; unfinished beside it: mjcartpole train --resume {first}-2"
    code, out, _ = call(["train", "--resume", first], capsys)
    assert (code, out) == (0, f"{first} is complete: nothing is left to do{hint}\n")
    assert f"this goes to {first}-3{hint}\n" in call(NINE, capsys)[1]


@pytest.mark.long
def test_a_hint_names_the_folder_as_a_shell_takes_it(here, fork, capsys):
    child = fork([*SLOW, "--run-dir", "my run", "--checkpoint-every", "0"])
    wait_until((here / "my run" / LATEST).exists, child)
    child.kill(signal.SIGINT)
    assert child.wait() == 130
    hint = shlex.split(re.search(r"go on with: mjcartpole (.*)$", child.err.strip())[1])
    assert hint == ["train", "--resume", "my run"]
    assert call(hint, capsys)[0] == 0


@pytest.mark.long
def test_a_header_says_what_was_changed(here, capsys):
    flags = ["--set", "pole.length=1.5,pole.mass=0.2", "--bins", "1,3,6,9", "--model", "cartpole"]
    out = call([*SHORT, *flags], capsys)[1]
    assert out.splitlines()[0] == (
        "tuned on mujoco: 4 episodes, seed 0, "
        "with --set pole.length=1.5 pole.mass=0.2 --bins 1,3,6,9"
    )
    assert "run    runs/tuned-mujoco-pole.length1.5-pole.mass0.2-episodes4-bins1_3_6_9-seed0" in out
    assert (
        "2 at once, with --alpha 0.5"
        in call([*NINE, "--seeds", "2", "--workers", "2", "--alpha", "0.5"], capsys)[1]
    )


def test_equal_trainings_print_the_same(here, capsys):
    outs = [call([*NINE, "--run-dir", f"{n}/run"], capsys)[1].replace(f"{n}/", "") for n in "ab"]
    assert outs[0] == outs[1]
    assert "per second" not in outs[0]


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="needs a terminal that a program can read")
def test_a_terminal_is_told_of_compiling_and_of_the_speed_without_it(here):
    import pty

    reader, writer = pty.openpty()
    cache = {"NUMBA_CACHE_DIR": str(here / "cache"), "TERM": "xterm", "COLUMNS": "120"}
    command = [sys.executable, "-m", "mjcartpole", *FILM, "run", "--no-video", "--no-curve"]
    process = subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=writer, env={**os.environ, **cache}
    )
    shown = b""
    while process.poll() is None or select.select([reader], [], [], 0.5)[0]:
        if select.select([reader], [], [], 0.1)[0]:
            shown += os.read(reader, 4096)
    os.close(writer)
    os.close(reader)
    assert "compiling ─".encode() in shown
    # Nine episodes take less than a millisecond, and to compile takes seconds.
    assert re.search(rb"[\d,]+ steps in 0\.0 s \([\d,]+ per second\)\r\n$", shown)
    assert json.loads(Path("run/timing.json").read_text())["training_seconds"] < 0.5


def test_a_training_that_is_refused_leaves_nothing(here, capsys):
    assert call([*NINE, "--run-dir", "run"], capsys)[0] == 0
    code, out, err = call([*FILM, "run"], capsys)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert names(".") == ["run"]
    os.chdir("run")
    assert call(["train", "--resume", "."], capsys)[1] == ". is complete: nothing is left to do\n"


def test_an_unwritable_videos_folder_is_noticed_before_training(here, capsys):
    (here / "videos").write_text("a file in the way")
    code, out, err = call(["train"], capsys)
    assert (code, out) == (2, "")
    assert "videos" in err
    assert not list(here.glob("runs/*/*"))
