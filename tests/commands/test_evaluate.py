"""`mjcartpole evaluate`: what a run was trained with, and what takes its place."""

import json

import pytest

from command_line import QUICK, call, done

GIVEN = [
    "--delay",
    "1",
    "--noise",
    "0.01",
    "--vary",
    "pole.length=0.5:1.5",
    "--observe-actions",
    "1",
]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run that was trained with disturbances."""
    folder = tmp_path_factory.mktemp("disturbed") / "run"
    done(["train", *QUICK, *GIVEN, "--run-dir", folder])
    return folder


@pytest.mark.parametrize(
    ("flags", "added"),
    [
        ([], "--vary pole.length=0.5:1.5 --delay 1 --noise 0.01"),
        (["--delay", "0"], "--vary pole.length=0.5:1.5 --noise 0.01"),
        (["--noise", "0", "--lag", "0.1"], "--vary pole.length=0.5:1.5 --delay 1 --lag 0.1"),
        (["--undisturbed"], None),
        (["--undisturbed", "--push", "1@1s"], "--push 1@1s"),
        (["--backend", "gym"], "--delay 1 --noise 0.01"),
        (["--backend", "gym", "--vary", "none"], "--delay 1 --noise 0.01"),
    ],
)
def test_a_run_is_played_as_it_was_trained_but_for_what_is_given(run, flags, added, capsys):
    code, out, _ = call(["evaluate", run, "--episodes", "3", "--json", *flags], capsys)
    assert code == 0
    assert json.loads(out).get("disturbances") == added
    code, out, _ = call(["evaluate", run, "--episodes", "3", *flags], capsys)
    assert ("with" in out) == bool(added)
    assert (added or "") in out


@pytest.mark.parametrize(
    ("flags", "told"),
    [
        (
            [],
            "mjcartpole: gymnasium's cart-pole does not vary: --vary pole.length=0.5:1.5 is left ",
        ),
        (["--vary", "none"], ""),
        (["--undisturbed"], ""),
    ],
)
def test_what_gymnasium_leaves_out_of_a_training_is_told(run, flags, told, capsys):
    code, _, err = call(["evaluate", run, "--episodes", "3", "--backend", "gym", *flags], capsys)
    assert (code, err.startswith(told), err.count("\n")) == (0, True, bool(told))


@pytest.mark.long
def test_the_summary_names_them_and_an_evaluation_gives_the_same_again(run, capsys):
    summary = json.loads((run / "summary.json").read_text())["evaluation"]
    _, out, _ = call(["evaluate", run, "--json"], capsys)
    assert json.loads(out).items() >= summary.items()
    assert summary["disturbances"]


@pytest.mark.parametrize(
    ("flags", "error"),
    [
        (["--delay", "500"], "delay of 500 control steps is no shorter than an episode"),
        (["--vary", "pole.size=1:2"], "nothing to edit is called 'pole.size'"),
        (["--noise", "-1"], "noise must be 0 or more"),
        (["--push", "5"], "push '5' is none; give N s @ seconds"),
        (["--backend", "gym", "--vary", "force=8:12"], "use backend 'mujoco'"),
        (["--pool", "3"], "--pool"),
    ],
)
def test_a_slip_is_one_line(run, flags, error, capsys):
    code, out, err = call(["evaluate", run, *flags], capsys)
    assert (code, out) == (2, "")
    assert error in err
    assert err.count("\n") == 1


def test_a_controller_is_disturbed_too(capsys):
    _, out, _ = call(["evaluate", "--policy", "lqr", "--delay", "9", "--episodes", "3"], capsys)
    assert "with --delay 9" in out
    assert "pole fell         3" in out


@pytest.mark.long
def test_a_film_says_what_was_added(run, tmp_path, capsys):
    words = ["render", run, "--quality", "draft", "--size", "64x48", "--no-overlay", "--sheet"]
    _, out, _ = call([*words, "-o", tmp_path / "a.png"], capsys)
    assert "--vary pole.length=0.5:1.5 --delay 1 --noise 0.01" in out
