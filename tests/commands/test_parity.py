"""The command `parity`: verdicts, reports and refusals."""

import json

import pytest

from mjcartpole import cli
from parity_cases import POLE, WRONG, changed

RIGHT_WITH_OTHER_NUMBERS = {
    "gravity along the hinge": ([("0 0 -9.8", "0 1 -9.8")], "gravity 0 1 -9.8 instead of 9.8"),
    "range": ([('name="slider"', 'name="slider" range="-3 2.4"')], "limit of joint 'slider' at -3"),
    "damper off": (
        [
            ('name="hinge"', 'name="hinge" damping="1"'),
            ('integrator="Euler"/>', 'integrator="Euler"><flag damper="disable"/></option>'),
        ],
        "damping of joint 'hinge', switched off by an option flag",
    ),
    "all doubled": (
        [
            ('mass="1.0"', 'mass="2.0"'),
            (POLE, POLE.replace("0.1", "0.2")),
            (r"0.00833\S* 0.00833[^\s\"]*", "0.016666666666666666 0.016666666666666666"),
            ('gear="10"', 'gear="20"'),
        ],
        "cart mass 2 instead of 1",
    ),
    "idle mass": (
        [('<geom name="pole"', '<geom name="pole" mass="0.01"')],
        "mass 0.01 of geom 'pole', which the <inertial> of body 'pole' overrides",
    ),
    "elsewhere": ([('name="cart">', 'name="cart" pos="20 0 0">')], None),
    "a kilometre off": ([('name="cart">', 'name="cart" pos="600 800 -3">')], None),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", RIGHT_WITH_OTHER_NUMBERS)
def test_motion_and_numbers_have_verdicts_of_their_own(name, tmp_path, capsys):
    changes, said = RIGHT_WITH_OTHER_NUMBERS[name]
    path = tmp_path / "model.xml"
    path.write_text(changed(*changes))
    rungs = ["--rungs", "2", "3", "4", "6", "7", "9"]
    code, out, _ = call(["--model", str(path), *rungs], capsys)
    assert code == 0
    assert "all rungs hold (6): it moves as CartPole-v1\n" in out
    strict, _, _ = call(["--model", str(path), "--rungs", "3", "--strict"], capsys)
    if said is None:
        assert "numbers  CartPole-v1's own" in out
        assert strict == 0
    else:
        assert "numbers  moves as CartPole-v1, with other numbers:\n" in out
        assert f"\n  {said}" in out
        assert strict == 1
    for against in ("itself",):
        code, out, _ = call(["--model", str(path), "--against", against, *rungs], capsys)
        assert code == 0, out


def call(arguments, capsys):
    with pytest.raises(SystemExit) as stop:
        cli.main(["parity", "--quick", *arguments])
    captured = capsys.readouterr()
    return stop.value.code, captured.out, captured.err


def test_the_command_prints_figures_and_writes_them_all(tmp_path, capsys):
    report = tmp_path / "deep" / "report.json"
    code, out, err = call(["--rungs", "2", "3", "--json", str(report)], capsys)
    assert (code, err) == (0, "")
    assert "all rungs hold (2)" in out
    assert out.count("\nmotion ") == out.count("\nnumbers ") == 1
    written = json.loads(report.read_text())
    assert written["holds"] is True
    assert [rung["rung"] for rung in written["rungs"]] == [2, 3]
    for rung in written["rungs"]:
        assert rung["verdict"] == "holds"
        for figure in rung["figures"]:
            assert figure["name"] in out


@pytest.mark.long
def test_the_command_fails_with_1_and_says_why(tmp_path, capsys):
    path = tmp_path / "wrong.xml"
    path.write_text(changed(*WRONG["gravity"][0]))
    code, out, err = call(["--model", str(path), "--rungs", "1", "2", "3"], capsys)
    assert (code, err) == (1, "")
    assert "does not hold on rung 2, 3" in out
    assert out.splitlines()[-1] == "  gravity 9.81 instead of 9.8"
    assert "likely cause: gravity 9.81 instead of 9.8" in out
    code, out, _ = call(["--model", str(path), "--against", "itself", "--rungs", "2"], capsys)
    assert code == 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--model", "nothing"], "no model is called"),
        (["--rungs", "0"], "no rung 0"),
        (["--rungs", "12"], "no rung 12"),
        (["--against", "moon"], "'moon'"),
        (["--json", "/proc/nothing/x.json"], "/proc/nothing"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(arguments, message, capsys):
    code, out, err = call(arguments, capsys)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert message in err
