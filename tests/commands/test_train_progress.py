"""`train --evaluate-every` and `--until`: what is printed and written, and what is refused."""

import json
import re
from pathlib import Path

import pytest

from command_line import call
from mjcartpole.learning import runs
from nightly import few
from trainings import names

GYM = ["train", "--backend", "gym", "--no-video", "--no-curve", "--run-dir", "run"]


def test_greedy_means_stand_beside_the_table(here, capsys):
    flags = ["--episodes", "25", "--log-every", "10", "--evaluate-every", "4"]
    code, out, err = call([*GYM, *flags], capsys)
    assert (code, err) == (0, "")
    head, *rows = Path("run", runs.EVALUATIONS).read_text().splitlines()
    assert head == "episode,steps,mean,minimum"
    means = {int(row.split(",")[0]): float(row.split(",")[2]) for row in rows}
    assert list(means) == [4, 8, 12, 16, 20, 24]
    assert " episode   mean return   greedy mean\n" in out
    for end, last in ((10, 8), (20, 20), (25, 24)):
        assert re.search(rf"^ +{end} +[\d.]+ +{means[last]:.1f}$", out, re.M)
    assert names("run") == sorted([*runs.FILES, runs.EVALUATIONS])
    assert call([*GYM, *flags[:2], "--overwrite"], capsys)[0] == 0
    assert names("run") == sorted(runs.FILES), "what is asked for no more is gone"


def test_a_training_that_is_solved_is_complete(here, capsys):
    code, out, err = call([*GYM, "--until", "60"], capsys)
    assert (code, err) == (0, "")
    summary = json.loads(Path("run/summary.json").read_text())
    episodes = summary["episodes"]
    assert episodes == summary["solved"]["episodes"] < 1_000
    assert episodes % 10 == 0
    assert f"\nstopped after episode {episodes}: {summary['stopped']}\n" in out
    assert "greedy evaluation on gym" in out
    resumed = call(["train", "--resume", "run"], capsys)
    assert resumed == (0, "run is complete: nothing is left to do\n", "")
    assert "greedy evaluation" in call(["evaluate", "run", "--episodes", "2"], capsys)[1]


@pytest.mark.long
def test_seeds_say_within_how_many_episodes_they_were_solved(here, capsys):
    command = [
        "train",
        "--backend",
        "gym",
        "--until",
        "60",
        "--no-curve",
        "--seeds",
        "3",
        "--run-dir",
        "many",
    ]
    code, out, err = call(command, capsys)
    assert (code, err) == (0, "")
    solved = [
        json.loads(Path(f"many/seed-{seed}/summary.json").read_text())["solved"]["episodes"]
        for seed in range(3)
    ]
    median, most = sorted(solved)[1:]
    line = (
        f"episodes until the mean greedy return was at least 60: median {median}, "
        f"95 % of seeds {most} (3 of 3 reached it)\n"
    )
    assert line in out
    figures = {"at": 60.0, "seeds": 3, "solved": 3, "median": median, "p95": most}
    assert json.loads(Path("many/aggregate.json").read_text())["episodes_to_solve"] == figures
    for seed in range(3):
        assert Path(f"many/seed-{seed}", runs.EVALUATIONS).is_file()
    # Seeds that are complete are read, not trained.
    assert line in call(["train", "--resume", "many"], capsys)[1]


REFUSED = [
    (["--evaluate-every", "0"], "evaluate_every must be a whole number from 1 up, not 0"),
    (["--episodes", "9", "--evaluate-every", "10"], "at most 9, the episodes that there are"),
    (["--until", "501"], "of at most 500, the most that an episode of CartPole-v1 returns"),
    (["--until", "nan"], "until must be a number"),
    (["--resume", "run", "--until", "400"], "leave out --until"),
]


@pytest.mark.parametrize(("flags", "said"), few(REFUSED, *REFUSED[1:3]))
def test_what_makes_no_sense_is_refused_in_one_line(flags, said, here, capsys):
    code, out, err = call(["train", *flags], capsys)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert said in err
    assert not Path("runs").exists()
