"""The command line on runs of many seeds: evaluated, filmed and transferred as after training."""

import json
import re
from pathlib import Path

import pytest

from command_line import QUICK, call


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


@pytest.mark.long
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


@pytest.mark.slow
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


@pytest.mark.long
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
