"""The command line as a person uses it: real processes where that matters."""

import json
import os
import re
import signal
import subprocess
import sys
import time

import pytest

from command_line import QUICK, call
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.policy import Policy
from mjcartpole.learning.training import train
from mjcartpole.physics.load import load_model
from nightly import few


def test_training_leaves_a_complete_run_and_its_evaluation_repeats(run, capsys):
    code, out, err = call(["evaluate", "runs/mine"], capsys)
    assert (code, err) == (0, "")
    summary = json.loads((run / "summary.json").read_text())
    assert f"mean return {summary['evaluation']['mean']:.2f}" in out
    assert sum(int(count) for count in re.findall(r"^  .*?(\d+)$", out, re.M)[1:]) == 100
    code, out, _ = call(["evaluate", "runs/mine", "--json"], capsys)
    assert json.loads(out).items() >= summary["evaluation"].items()
    policy = train(TrainConfig(episodes=3, seed=8)).policy
    assert Policy.load(run / "policy.json").q_table.tobytes() == policy.q_table.tobytes()


def test_an_existing_run_is_only_overwritten_on_request(run, capsys):
    before = {path.name: path.read_bytes() for path in run.iterdir()}
    again = ["train", *QUICK, "--seed", "4", "--run-dir", "runs/mine"]
    code, _, err = call(again, capsys)
    assert (code, err.count("\n")) == (2, 1)
    assert "--overwrite" in err
    assert {path.name: path.read_bytes() for path in run.iterdir()} == before
    assert call([*again, "--overwrite"], capsys)[0] == 0
    assert json.loads((run / "summary.json").read_text())["seed"] == 4


def test_a_run_is_evaluated_where_it_was_trained_unless_told_otherwise(run, capsys):
    out = {}
    for backend in ("mujoco", "gym"):
        code, text, _ = call(["evaluate", run, "--backend", backend, "--json"], capsys)
        out[backend] = json.loads(text)
        assert code == 0
    assert [out[name]["backend"] for name in out] == ["mujoco", "gym"]
    # The physics differ by rounding, which decides how a few of the hundred episodes end.
    assert out["mujoco"]["mean"] == pytest.approx(out["gym"]["mean"], abs=25)


def test_a_run_keeps_the_model_that_it_was_trained_on(here, capsys):
    (here / "heavy.xml").write_text(load_model().xml.replace('mass="0.1"', 'mass="0.2"'))
    train_it = ["train", *QUICK, "--model", "heavy.xml", "--run-dir", "runs/heavy"]
    assert call(train_it, capsys)[0] == 0
    stored = (here / "runs/heavy/model.xml").read_text()
    assert stored == (here / "heavy.xml").read_text()
    (here / "heavy.xml").unlink()
    code, out, _ = call(["evaluate", "runs/heavy", "--json", "--episodes", "5"], capsys)
    assert code == 0
    assert json.loads(out)["model"] == str(here.joinpath("runs/heavy/model.xml").relative_to(here))


def test_a_policy_file_alone_can_be_played(run, capsys):
    code, out, _ = call(["evaluate", run / "policy.json", "--episodes", "3", "--seed", "1"], capsys)
    assert code == 0
    assert "3 episodes, seed 1" in out


def frames_of(path):
    import av

    with av.open(str(path)) as container:
        frames = sum(1 for _ in container.decode(video=0))
        return frames, container.duration / av.time_base


@pytest.mark.parametrize("backend", few(["mujoco", "gym"], "mujoco"))
def test_rendering_either_backend(run, backend, capsys):
    arguments = ["render", run, "-o", "out.mp4", "--backend", backend, "--seed", "2"]
    arguments += ["--size", "160x120"]
    code, out, err = call(arguments, capsys)
    assert (code, err) == (0, "")
    steps = int(re.search(r"\((\d+) steps", out)[1])
    frames, seconds = frames_of("out.mp4")
    assert frames == steps + 1
    assert seconds == pytest.approx(frames / 50, abs=0.011)


@pytest.mark.parametrize(
    "name",
    few(
        [
            "concat:x.mp4",
            "pipe:1.mp4",
            "file:y.mp4",
            "a|b.mp4",
            "c%03d.mp4",
            "-z.mp4",
            "concat:d/q.mp4",
        ],
        "c%03d.mp4",
        "concat:d/q.mp4",
    ),
)
def test_a_videos_path_is_a_path_whatever_it_looks_like(run, here, name, capsys):
    code, out, err = call(["render", run, "-o", name, "--size", "64x48"], capsys)
    assert (code, err) == (0, "")
    assert f"video  {name}  (" in out
    written = [str(path.relative_to(here)) for path in here.rglob("*.mp4")]
    assert written == [name]
    assert frames_of(here / name)[0] > 5


def test_a_file_whose_name_begins_with_a_dash_is_a_file(run, here, capsys):
    (here / "-mine.xml").write_text(load_model().xml)
    assert call(["model", "show", "-mine.xml"], capsys)[0] == 0
    assert (
        call(["model", "edit", "-mine.xml", "--set=pole.length=1", "-o", "-2.xml"], capsys)[0] == 0
    )
    assert (here / "-2.xml").is_file()
    assert call(["render", run, "-o=-3.gif", "--size", "64x48"], capsys)[0] == 0
    assert (here / "-3.gif").is_file()


def test_training_films_its_first_evaluation_episode(here, capsys):
    code, out, _ = call(
        ["train", "--episodes", "4", "--no-curve", "--run-dir", "runs/film"], capsys
    )
    assert code == 0
    assert "video  videos/film.mp4" in out
    summary = json.loads((here / "runs/film/summary.json").read_text())
    assert summary["video"] == "videos/film.mp4"
    assert frames_of(here / "videos/film.mp4")[0] > 5


def start(arguments, here):
    command = [sys.executable, "-m", "mjcartpole", *arguments]
    return subprocess.Popen(
        command, cwd=here, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


@pytest.mark.slow
def test_ctrl_c_ends_at_once_and_keeps_what_was_learned(here, capsys):
    process = start(["train", "--episodes", "1000000", "--run-dir", "runs/long"], here)
    assert "1,000,000 episodes" in process.stdout.readline()
    time.sleep(1)
    process.send_signal(signal.SIGINT)
    sent = time.monotonic()
    _, err = process.communicate(timeout=30)
    # A second on a quiet machine; a busy one is given more.
    assert time.monotonic() - sent < 10
    assert process.returncode == 130
    assert err.count("\n") == 1
    assert re.search(r"interrupted after [\d,]+ of 1,000,000 episodes; .* kept in runs/long", err)
    summary = json.loads((here / "runs/long/summary.json").read_text())
    assert summary["interrupted"] is True
    assert summary["episodes"] > 0
    assert call(["evaluate", "runs/long", "--episodes", "2"], capsys)[0] == 0


@pytest.mark.slow
def test_a_model_that_diverges_is_one_line_as_well(here):
    text = load_model().xml.replace('mass="1.0"', 'mass="1e-12"')
    (here / "wild.xml").write_text(text.replace('gear="10"', 'gear="1e12"'))
    process = start(["train", "--model", "wild.xml", "--no-video", "--no-curve"], here)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 2
    warning, said = err.splitlines()
    assert warning.startswith("mjcartpole: no policy can balance this: ")
    assert "the simulation of wild.xml diverged" in said
    assert not (here / "MUJOCO_LOG.TXT").exists()


def test_module_and_version(here):
    process = start(["--version"], here)
    out, err = process.communicate(timeout=60)
    assert re.fullmatch(r"mjcartpole \d+\.\d+\.\d+\n", out)
    assert (process.returncode, err) == (0, "")


@pytest.mark.slow
def test_only_a_process_of_its_own_looks_for_garbage_seldom(here):
    code = (
        "import sys, gc, atexit; from mjcartpole.cli import main; before = gc.get_threshold()\n{}"
    )
    told = (
        "atexit.register(lambda: print(gc.get_threshold() == before, gc.get_freeze_count() > 0))\n"
    )
    for words, expected in (("main()", "False True"), ("main(['-V'])", "True False")):
        command = [sys.executable, "-c", code.format(told + words), "--version"]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        assert done.stdout.splitlines()[-1] == expected


@pytest.mark.slow
def test_only_in_a_process_of_its_own_steps_take_no_time_of_themselves(here):
    code = (
        "import mujoco; from mjcartpole.cli import main\ntry: {}\nexcept SystemExit: pass\n"
        "data = mujoco.MjData(model := mujoco.MjModel.from_xml_string('<mujoco/>'))\n"
        "mujoco.mj_step(model, data, nstep=100); print(data.timer[0].duration > 0)"
    )
    for words, expected in (("main()", "False"), ("main(['model', 'list'])", "True")):
        command = [sys.executable, "-c", code.format(words), "model", "list"]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        assert done.stdout.splitlines()[-1] == expected


@pytest.mark.slow
def test_a_reader_that_leaves_early_is_no_error(here):
    process = start(["train", *QUICK], here)
    process.stdout.close()
    assert "Traceback" not in process.stderr.read()
    process.stderr.close()
    assert process.wait(timeout=60) == 0


def test_help_ends_in_the_narrowest_terminal(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "1")
    code, out, err = call(["evaluate", "--help"], capsys)
    assert (code, err, len(out.splitlines()[-1])) == (0, "", 40)
    assert os.environ["COLUMNS"] == "1"


def test_the_doctor_says_what_draws_and_what_encodes(here, capsys):
    code, out, err = call(["doctor"], capsys)
    assert (code, err) == (0, "")
    code, as_json, err = call(["doctor", "--json"], capsys)
    assert (code, err) == (0, "")
    report = json.loads(as_json)
    assert f"frames are drawn by {report['renderer']};" in out
    for one in report["backends"]:
        state = "works" if one["works"] else "does not work"
        assert re.search(rf"^  {one['name']} +{state}", out, re.M)
    assert not list(here.iterdir())


HELP = [[], ["--help"], ["train", "--help"], ["evaluate", "-h"], ["render", "-h"], ["doctor", "-h"]]


@pytest.mark.parametrize("command", HELP)
def test_help(command, capsys):
    code, out, _ = call(command, capsys)
    assert code == 0
    assert "usage: mjcartpole" in out


def test_help_tells_of_the_version(capsys):
    assert "--version" in call(["--help"], capsys)[1]


@pytest.mark.long
def test_a_run_at_the_files_own_timestep_is_evaluated_as_it_was_trained(here, capsys):
    odd = load_model().xml.replace('timestep="0.02"', 'timestep="0.015"')
    (here / "odd.xml").write_text(odd)
    train = ["train", "--model", "odd.xml", *QUICK, "--run-dir", "mine"]
    code, _, error = call(train, capsys)
    assert (code, "does not divide" in error) == (2, True)
    assert call([*train, "--own-timestep"], capsys)[0] == 0
    stored = json.loads((here / "mine" / "summary.json").read_text())["evaluation"]
    code, out, _ = call(["evaluate", "mine", "--json"], capsys)
    assert (code, json.loads(out)["mean"]) == (0, stored["mean"])
    assert call(["render", "mine", "--size", "64x48", "-o", "it.gif"], capsys)[0] == 0
    assert call(["transfer", "mine", "--models", "odd.xml"], capsys)[0] == 2
    transfer = ["transfer", "mine", "--models", "odd.xml", "--own-timestep", "--episodes", "3"]
    assert call(transfer, capsys)[0] == 0
    code, out, _ = call(["model", "show", "odd.xml", "--own-timestep"], capsys)
    assert "1 step of 0.015 s per action, 0.015 s" in out
    code, _, error = call(["evaluate", "mine", "--backend", "gym", "--own-timestep"], capsys)
    assert (code, "asked for" in error) == (2, True)


@pytest.mark.long
def test_it_is_said_where_no_policy_can_balance_a_model(here, capsys):
    train = ["train", "--engine", "python", "--episodes", "3", "--no-video", "--no-curve"]
    words = "no policy can balance this: from 8 of 8 starts every sequence of actions ends"
    for edits, expected in ((["--set", "force=1000"], 1), ([], 0)):
        code, out, _ = call(["model", "show", "cartpole", *edits], capsys)
        assert (code, out.count(words)) == (0, expected)
        code, _, error = call([*train, *edits], capsys)
        assert (code, error.count(words), len(error.splitlines())) == (0, expected, expected)
    assert call([*train, "--backend", "gym"], capsys)[2] == ""
