"""The command line as a person uses it: real processes where that matters."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from mjcartpole import cli
from mjcartpole.errors import ConfigError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.policy import Policy
from mjcartpole.learning.training import train
from mjcartpole.physics.load import load_model

QUICK = ["--episodes", "30", "--no-video"]


def call(arguments, capsys):
    """Run a command in this process; returns exit code, stdout and stderr."""
    with pytest.raises(SystemExit) as stop:
        cli.main([str(argument) for argument in arguments])
    captured = capsys.readouterr()
    return stop.value.code, captured.out, captured.err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["train", "--bins", "1,3,,6,8"], "nothing between two commas"),
        (["model", "show", "-o", "x.xml"], "-o is for `model edit`"),
        (["model", "list", "long"], "`model show` takes a name"),
        (["model", "list", "--set", "pole.length=2"], "`model show` takes a name"),
        (["model", "show", "/dev/zero"], "'/dev/zero' is a device or a pipe, not a file"),
        (["transfer", "policy.json", "--models", "gym", "--set", "pole.length=2"], "no run folder"),
    ],
)
def test_what_has_no_effect_is_refused(arguments, said, capsys):
    code, out, err = call(arguments, capsys)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert said in err


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def run(here, capsys):
    code, *_ = call(["train", *QUICK, "--seed", "3", "--run-dir", "runs/mine"], capsys)
    assert code == 0
    return here / "runs" / "mine"


def test_flags_are_the_fields_of_the_config():
    command = cli.parse(["train", "--gamma", "0.9", "--bins", "1", "1", "2", "3", "--seed=4"])
    assert command.config == TrainConfig(gamma=0.9, bins=(1, 1, 2, 3), seed=4)
    assert command.where.preset == "tuned"
    assert command.how.video is True


@pytest.mark.parametrize("form", [["--preset", "article"], ["--preset=article"]])
def test_a_preset_changes_the_defaults(form):
    command = cli.parse(["train", "--backend", "gym", *form, "--episodes", "50"])
    assert command.config == TrainConfig.preset("article", backend="gym", episodes=50)
    assert command.where.preset == "article"


@pytest.mark.parametrize("form", [["--method", "sarsa"], ["--method=sarsa"]])
def test_a_method_has_flags_of_its_own(form, capsys):
    command = cli.parse(["train", *form, "--epsilon", "0.5"])
    assert command.config == TrainConfig(method="sarsa", epsilon=0.5)
    assert "--td-lambda" not in call(["train", *form, "--help"], capsys)[1]
    assert "--td-lambda" in call(["train", "--help"], capsys)[1]


@pytest.mark.parametrize(
    ("words", "values"),
    [
        ("--bins 1,3,6,9", {"bins": (1, 3, 6, 9)}),
        ("--bins=1,3,6,9 --alpha 0.2", {"bins": (1, 3, 6, 9), "alpha": 0.2}),
        ("--bins 1, 3, 6, 9", {"bins": (1, 3, 6, 9)}),
        ("--bins 1,3 6,9", {"bins": (1, 3, 6, 9)}),
        ("--low -2.4,-1e0,-.2,-1.5 --seed 3", {"low": (-2.4, -1.0, -0.2, -1.5), "seed": 3}),
        ("--low=-2.4,-1,-.2,-1.5", {"low": (-2.4, -1.0, -0.2, -1.5)}),
        ("--set pole.length=1.5,pole.mass=0.2", {"set": ("pole.length=1.5", "pole.mass=0.2")}),
        ("--set=a.b=1,c:d.e=2 f=3", {"set": ("a.b=1", "c:d.e=2", "f=3")}),
    ],
)
def test_commas_part_the_values_of_a_list(words, values):
    assert cli.parse(["train", *words.split()]).config == TrainConfig(**values)


def test_commas_elsewhere(here):
    assert cli.parse(["parity", "--rungs", "1,2,3", "--quick"]).rungs == (1, 2, 3)
    command = cli.parse(["transfer", "a,b", "--models", "gym,long", "-o", "c,d"])
    assert command.models == ("gym", "long")
    assert ([str(source) for source in command.sources], str(command.output)) == (["a,b"], "c,d")
    (here / "heavy,long.xml").write_text("<mujoco/>")
    command = cli.parse(["transfer", "a", "--models", "heavy,long.xml", "gym"])
    assert command.models == ("heavy,long.xml", "gym")


def test_a_list_that_makes_no_sense_is_one_line(here, capsys):
    for bins in ("1,3,6", "1,x,6,8", "1;3;6;8", ","):
        code, out, err = call(["train", "--bins", bins], capsys)
        assert (code, out, err.count("\n")) == (2, "", 1)


def test_negative_numbers_are_values():
    command = cli.parse(["train", "--low", "-1", "-2.5", "-0.3", "-4e0"])
    assert command.config.low == (-1.0, -2.5, -0.3, -4.0)


def test_a_value_that_makes_no_sense_is_our_error():
    with pytest.raises(ConfigError, match="gamma must be a number from 0 to 1, not 2"):
        cli.parse(["train", "--gamma", "2"])


def test_training_leaves_a_complete_run_and_its_evaluation_repeats(run, capsys):
    code, out, err = call(["evaluate", "runs/mine"], capsys)
    assert (code, err) == (0, "")
    summary = json.loads((run / "summary.json").read_text())
    assert f"mean return {summary['evaluation']['mean']:.2f}" in out
    assert sum(int(count) for count in re.findall(r"^  .*?(\d+)$", out, re.M)[1:]) == 100
    code, out, _ = call(["evaluate", "runs/mine", "--json"], capsys)
    assert json.loads(out).items() >= summary["evaluation"].items()
    policy = train(TrainConfig(episodes=30, seed=3)).policy
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


@pytest.mark.parametrize("backend", ["mujoco", "gym"])
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
    [
        "concat:x.mp4",
        "pipe:1.mp4",
        "file:y.mp4",
        "a|b.mp4",
        "c%03d.mp4",
        "-z.mp4",
        "concat:d/q.mp4",
    ],
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
    code, out, _ = call(["train", "--episodes", "5", "--run-dir", "runs/film"], capsys)
    assert code == 0
    assert "video  videos/film.mp4" in out
    summary = json.loads((here / "runs/film/summary.json").read_text())
    assert summary["video"] == "videos/film.mp4"
    assert frames_of(here / "videos/film.mp4")[0] > 5


BAD = [
    (["train", "--preset", "best"], "preset 'best' is unknown; available: tuned"),
    (["train", "--task", "juggle"], "task 'juggle' is unknown; available: CartPole-v1"),
    (["train", "--method", "guess"], "method 'guess' is unknown; available: q-learning, sarsa"),
    (["train", "--method", "sarsa", "--td-lambda", "0.5"], "--td-lambda"),
    (["train", "--episodes", "0"], "episodes must be a whole number from 1 up, not 0"),
    (["train", "--episodes", "-7"], "not -7"),
    (["train", "--episodes", "many"], "many"),
    (["train", "--bins", "1", "2"], "bins needs 4 values"),
    (["train", "--bins", "1", "2", "3", "0"], "from 1 up"),
    (["train", "--bins", "1000", "1000", "1000", "1000"], "states; the most is"),
    (["train", "--low", "5", "5", "5", "5"], "low < high"),
    (["train", "--high", "nan", "1", "1", "1"], "finite"),
    (["train", "--alpha", "7"], "alpha must be a number from 0 to 1"),
    (["train", "--seed", "-1"], "seed must be"),
    (["train", "--backend", "bullet"], "'bullet'"),
    (["train", "--backend", "gym", "--model", "other"], "takes no model"),
    (["train", "--model", "cartpol"], "did you mean 'cartpole'"),
    (["train", "--model", "nowhere.xml"], "'nowhere.xml' is not there"),
    (["train", "--model", "broken.xml"], "line 3"),
    (["train", "--model", "ball.xml"], "a ball joint"),
    (["train", "--run-dir", "/proc/nothing"], "cannot make the folder"),
    (["train", "--run-dir", "full"], "holds other files"),
    (["train", "--run-dir", "a-file"], "a-file"),
    (["train", "--engine", "fast"], "fast"),
    (["train", "--checkpoint-every", "-1"], "checkpoint-every must be a number of seconds"),
    (["train", "--seeds", "0"], "seeds must be a number from 1"),
    (["train", "--workers", "2"], "--workers is for several --seeds"),
    (["train", "--resume", "nowhere"], "no run folder or checkpoint 'nowhere'"),
    (["train", "--resume", "full"], "'full' holds no training that could be continued"),
    (["train", "--resume", "a-file"], "holds no training that could be continued"),
    (["train", "--resume", "RUN", "--seed", "9"], "leave out --seed"),
    (["train", "--resume", "RUN", "--method", "sarsa"], "leave out --method"),
    (["train", "--resume", "RUN", "--seeds", "2", "--overwrite"], "leave out --overwrite, --seeds"),
    (["train", "--overwriet"], "perhaps you meant --overwrite"),
    (["fly"], "fly"),
    (["evaluate"], "RUN-OR-POLICY"),
    (["evaluate", "nowhere"], "no run folder or policy file 'nowhere'"),
    (["evaluate", "full"], "no complete run folder"),
    (["evaluate", "a-file"], "not a policy"),
    (["evaluate", "noise.json"], "not a policy"),
    (["evaluate", "RUN", "--episodes", "0"], "episodes must be"),
    (["evaluate", "RUN", "--seed", "-4"], "seed must be"),
    (["evaluate", "RUN", "--backend", "gym", "--integrator", "mujoco"], "takes no model"),
    (["render", "nowhere"], "nowhere"),
    (["render", "RUN", "-o", "video.xyz"], "video.xyz"),
    (["render", "RUN", "-o", "/proc/nothing/video.mp4"], "/proc/nothing"),
    (["render", "RUN", "--camera", "moon"], "'moon'; available: side, follow"),
    (["render", "RUN", "--size", "0x480"], "width 0 is no size of a picture"),
    (["render", "RUN", "--size", "640"], "such as 640x480, not '640'"),
    (["render"], "RUN-OR-POLICY"),
    (["doctor", "--now"], "--now"),
]


@pytest.mark.parametrize(("arguments", "message"), BAD, ids=lambda value: str(value)[:50])
def test_a_mistake_is_one_line_and_exit_code_2(run, arguments, message, here, capsys):
    (here / "broken.xml").write_text("<mujoco>\n<worldbody>\n<geom sise='1'/></worldbody></mujoco>")
    text = load_model().xml.replace('type="hinge" axis="0 1 0"', 'type="ball"')
    (here / "ball.xml").write_text(text)
    (here / "full").mkdir()
    (here / "full" / "thesis.tex").write_text("years of work")
    (here / "a-file").write_text("text")
    (here / "noise.json").write_bytes(os.urandom(200))
    before = {path: path.read_bytes() for path in here.rglob("*") if path.is_file()}
    code, out, err = call([str(run) if a == "RUN" else a for a in arguments], capsys)
    assert code == 2
    assert out == ""
    assert err.startswith("mjcartpole: error: ")
    assert err.count("\n") == 1
    assert message in err
    assert {path: path.read_bytes() for path in here.rglob("*") if path.is_file()} == before


def start(arguments, here):
    command = [sys.executable, "-m", "mjcartpole", *arguments]
    return subprocess.Popen(
        command, cwd=here, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


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


def test_a_model_that_diverges_is_one_line_as_well(here):
    text = load_model().xml.replace('mass="1.0"', 'mass="1e-12"')
    (here / "wild.xml").write_text(text.replace('gear="10"', 'gear="1e12"'))
    process = start(["train", "--model", "wild.xml", "--no-video"], here)
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


def test_a_reader_that_leaves_early_is_no_error(here):
    process = start(["train", *QUICK], here)
    process.stdout.close()
    assert "Traceback" not in process.stderr.read()
    process.stderr.close()
    assert process.wait(timeout=60) == 0


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


def test_it_is_said_where_no_policy_can_balance_a_model(here, capsys):
    train = ["train", "--engine", "python", "--episodes", "3", "--no-video"]
    words = "no policy can balance this: from 8 of 8 starts every sequence of actions ends"
    for edits, expected in ((["--set", "force=1000"], 1), ([], 0)):
        code, out, _ = call(["model", "show", "cartpole", *edits], capsys)
        assert (code, out.count(words)) == (0, expected)
        code, _, error = call([*train, *edits], capsys)
        assert (code, error.count(words), len(error.splitlines())) == (0, expected, expected)
    assert call([*train, "--backend", "gym"], capsys)[2] == ""


def test_the_word_after_set_is_an_edit_even_where_it_is_none(here, capsys):
    code, _, error = call(["model", "show", "cartpole", "--set", "pole.length"], capsys)
    assert code == 2
    assert "'pole.length' is no edit; give NAME=VALUE" in error


@pytest.fixture
def seeds(here, capsys):
    command = ["train", *QUICK, "--backend", "gym", "--seeds", "3", "--run-dir", "runs/many"]
    assert call(command, capsys)[0] == 0
    return here / "runs" / "many"


def test_many_seeds_are_evaluated_as_after_training(seeds, capsys):
    code, out, err = call(["evaluate", "runs/many"], capsys)
    assert (code, err) == (0, "")
    assert out.startswith(
        "\ngreedy evaluation on gym: 3 seeds, 100 episodes each, seed 1000000\n\n"
    )
    rows = (seeds / "seeds.csv").read_text().splitlines()[1:]
    for seed, mean, least, _ in (row.split(",") for row in rows):
        assert re.search(rf"^ +{seed} +{float(mean):.2f} +{float(least):.0f}$", out, re.M)
    stored = json.loads((seeds / "aggregate.json").read_text())["greedy_return"]
    code, out, err = call(["evaluate", "runs/many", "--json"], capsys)
    figures = json.loads(out)
    assert (code, err, figures["greedy_return"]) == (0, "", stored)
    assert [one["train_seed"] for one in figures["seeds"]] == [0, 1, 2]
    assert {one["seed"] for one in figures["seeds"]} == {1_000_000}


def test_many_seeds_are_evaluated_elsewhere(seeds, capsys):
    where = ["--backend", "mujoco", "--model", "long", "--episodes", "2", "--seed", "5"]
    code, out, err = call(["evaluate", "runs/many", *where], capsys)
    assert (code, err) == (0, "")
    assert "greedy evaluation on mujoco, long: 3 seeds, 2 episodes each, seed 5" in out
    single = call(["evaluate", "runs/many/seed-1", *where], capsys)[1]
    assert "greedy evaluation on mujoco, long: 2 episodes, seed 5" in single
    mean = re.search(r"mean return ([\d.]+)", single)[1]
    assert re.search(rf"^ +1 +{mean} ", out, re.M)


def test_a_seed_without_a_policy_is_named_and_left_out(seeds, capsys):
    (seeds / "seed-1" / "policy.json").unlink()
    for command in (["evaluate"], ["transfer", "--models", "gym", "--episodes", "2"]):
        code, out, err = call([command[0], "runs/many", *command[1:]], capsys)
        said = "mjcartpole: 1 of 3 seeds in runs/many without a policy, such as seed 1: left out\n"
        assert (code, err) == (0, said)
        assert "2 seeds" in out
    for seed in (0, 2):
        (seeds / f"seed-{seed}" / "policy.json").unlink()
    for command in ("evaluate", "render", "transfer"):
        code, out, err = call([command, "runs/many"], capsys)
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert "mjcartpole train --resume runs/many" in err


def test_the_median_of_many_seeds_is_filmed(seeds, capsys):
    rows = [row.split(",") for row in (seeds / "seeds.csv").read_text().splitlines()[1:]]
    median = sorted((float(mean), int(seed)) for seed, mean, *_ in rows)[1][1]
    command = ["render", "runs/many", "--size", "64x48"]
    code, out, err = call([*command, "-o", "film.mp4"], capsys)
    assert (code, err) == (0, "")
    folder = f"runs/many/seed-{median}"
    assert out.startswith(
        f"{folder}  (the median of 3 seeds by mean greedy return)\nvideo  film.mp4"
    )
    assert call(["render", folder, "--size", "64x48", "-o", "alone.mp4"], capsys)[0] == 0
    assert Path("film.mp4").read_bytes() == Path("alone.mp4").read_bytes()
    assert f"videos/many-seed-{median}.mp4" in call(command, capsys)[1]


def test_many_seeds_are_one_column_of_a_transfer(seeds, capsys):
    command = ["transfer", "runs/many", "runs/many/seed-2", "--episodes", "4"]
    code, out, err = call([*command, "--models", "gym,cartpole"], capsys)
    assert (code, err) == (0, "")
    assert "many: the mean over 3 seeds, and its interval over seeds" in out
    cells = json.loads(Path("transfer/transfer.json").read_text())["cells"]
    by_place = {(cell["policy"], cell["model"]): cell for cell in cells}
    means = [
        json.loads(
            call(["evaluate", f"runs/many/seed-{n}", "--json", "--episodes", "4"], capsys)[1]
        )
        for n in range(3)
    ]
    all_means = [one["mean"] for one in means]
    many, alone = by_place["many", "gym"], by_place["many-seed-2", "gym"]
    assert many["mean"] == pytest.approx(sum(all_means) / 3)
    assert many["minimum"] == min(one["minimum"] for one in means)
    assert min(all_means) <= many["low"] <= many["high"] <= max(all_means)
    assert (many["episodes"], alone["episodes"], alone["mean"]) == (12, 4, all_means[2])
    assert call(["transfer", "runs/many", "--sweep", "gravity=9:10:1"], capsys)[0] == 0
    assert json.loads(Path("transfer/sweep-gravity.json").read_text())["holds"].keys() == {"many"}
