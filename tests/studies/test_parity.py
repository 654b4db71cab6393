"""The reference passes the ladder; a small error fails on the right rung for the right cause."""

import dataclasses
import functools
import json
import math
import re
from importlib.metadata import version

import gymnasium
import numpy as np
import pytest

from mjcartpole import cli
from mjcartpole.errors import ConfigError
from mjcartpole.physics import equations, linear
from mjcartpole.physics.equations import CARTPOLE_V1, uniform_rod
from mjcartpole.physics.load import load_model
from mjcartpole.studies.parity import RUNGS, Figure, Result, Subject, run_ladder
from mjcartpole.studies.parity.case import Batch, set_parameters, why_not_gymnasiums
from mjcartpole.studies.parity.convergence import _order_figures
from mjcartpole.studies.parity.diagnosis import likely_cause
from mjcartpole.studies.parity.dynamics import gym_steps, step_gym
from mjcartpole.studies.parity.rounding import EPS
from mjcartpole.studies.parity.trajectories import predicted_growth

REFERENCE = load_model("cartpole").xml
PHYSICS = (2, 3, 4, 6, 7, 9)
"""Rungs that look at the motion."""


def changed(*changes):
    """The reference with changes, each a pattern and its replacement."""
    text = REFERENCE
    for pattern, replacement in changes:
        text, count = re.subn(pattern, replacement, text, count=1, flags=re.DOTALL)
        assert count == 1, pattern
    return text


def climb(text, against="cartpole-v1", rungs=PHYSICS):
    """The subject and its quick results, by rung."""
    subject = Subject(load_model(text, own_timestep=True), against, quick=True)
    return subject, {result.rung: result for result in run_ladder(subject, rungs)}


def failures(results):
    return {rung for rung, result in results.items() if result.verdict in {"fails", "beyond"}}


@pytest.mark.parametrize("against", ["cartpole-v1", pytest.param("itself", marks=pytest.mark.slow)])
def test_the_reference_passes_every_rung(against):
    subject, results = climb(REFERENCE, against, tuple(RUNGS))
    if results[10].verdict == "skipped":
        assert "does not load" in results.pop(10).skipped
    assert {result.verdict for result in results.values()} == {"holds"}
    assert subject.causes == []
    for result in results.values():
        assert any(figure.bound is not None for figure in result.figures)
        assert result.reason


@pytest.mark.slow
def test_the_reference_passes_the_full_ladder():
    results = list(run_ladder(Subject(load_model("cartpole"))))
    assert [result.verdict for result in results] == ["holds"] * len(RUNGS)


POLE = '<inertial pos="0 0 0.5" mass="0.1"'
INERTIA = 'diaginertia="0.008333333333333333 0.008333333333333333'
WRONG = {
    "pole mass": ([(POLE, POLE.replace("0.1", "0.1001"))], 2, "pole mass 0.1001 instead of 0.1"),
    "cart mass": ([('mass="1.0"', 'mass="1.001"')], 2, "cart mass 1.001 instead of 1"),
    "inertia": (
        [(INERTIA, INERTIA.replace("0.008333333333333333", "0.008341666666666666"))],
        2,
        "inertia 0.00834167 instead of 0.00833333",
    ),
    "centre": ([(POLE, POLE.replace("0.5", "0.5005"))], 2, "com distance 0.5005 instead of 0.5"),
    "gravity": ([("-9.8", "-9.81")], 2, "gravity 9.81 instead of 9.8"),
    "gear": ([('gear="10"', 'gear="10.01"')], 2, "force of action 1 10.01 instead of 10"),
    "timestep": ([('timestep="0.02"', 'timestep="0.02002"')], 3, "timestep 0.02002 instead of"),
    "half the timestep": ([('timestep="0.02"', 'timestep="0.01"')], 3, "timestep 0.01 instead of"),
    "damping": ([('name="hinge"', 'name="hinge" damping="1e-4"')], 2, "hinge damping 0.0001"),
    "armature": ([('name="slider"', 'name="slider" armature="1e-3"')], 2, "slider armature 0.001"),
    "hinge axis": (
        [('axis="0 1 0"', 'axis="0 -1 0"')],
        2,
        "turned round: a positive angle",
    ),
    "slider axis": (
        [('axis="1 0 0"', 'axis="-1 0 0"')],
        2,
        "turned round: a positive angle",
    ),
    "limit": ([('name="slider"', 'name="slider" range="-2 2"')], 2, "limit of joint 'slider'"),
    "friction": ([('name="hinge"', 'name="hinge" frictionloss="1e-5"')], 2, "friction loss"),
    "tilted rail": ([('axis="1 0 0"', 'axis="1 0 0.001"')], 2, "slide axis of joint 'slider' tilt"),
    "tilted hinge": ([('axis="0 1 0"', 'axis="0 1 0.001"')], 2, "hinge axis of joint 'hinge' tilt"),
    "out of square": ([('axis="0 1 0"', 'axis="0.001 1 0"')], 2, "out of square by 0.0573 degrees"),
    "tilted pole": ([('name="pole">', 'name="pole" euler="0 0.001 0">')], 2, "leans by 0.0573"),
    "rolled cart": ([('name="cart">', 'name="cart" euler="0.01 0 0">')], 2, "hinge axis of joint"),
    "ref": ([('name="hinge"', 'name="hinge" ref="0.01"')], 2, "its ref is 0.01 rad"),
    "gravity aside": ([("0 0 -9.8", "0.01 0 -9.8")], 2, "gravity 0.01 0 -9.8 instead of"),
    "brake": (
        [
            (
                "</actuator>",
                '<dcmotor name="brake" joint="hinge" input="none" motorconst="0.05" '
                'resistance="1"/></actuator>',
            )
        ],
        2,
        "actuator force by actuator 'brake' on joint 'hinge'",
    ),
    "spring": ([('name="hinge"', 'name="hinge" stiffness="1e-4"')], 2, "spring"),
    "contact": (
        [
            ('<geom name="cart"', '<geom name="cart" contype="1" conaffinity="1"'),
            (
                "<worldbody>",
                '<worldbody><geom name="ground" type="plane" size="9 9 1" contype="1" '
                'conaffinity="1" pos="0 0 -0.099"/>',
            ),
        ],
        2,
        "contact between geoms 'ground' and 'cart'",
    ),
    "geom mass": (
        [
            ('angle="radian"', 'angle="radian" inertiafromgeom="true"'),
            ('<geom name="cart"', '<geom name="cart" mass="1"'),
            ('<geom name="pole"', '<geom name="pole" mass="0.1"'),
        ],
        2,
        "inertia",
    ),
    "integrator": ([('integrator="Euler"', 'integrator="RK4"')], 4, "integrator RK4 instead of"),
}


@functools.cache
def steps_of_wrong(name):
    """The subject and its results on the rungs about single steps."""
    changes, _, _ = WRONG[name]
    return climb(changed(*changes), rungs=(2, 3, 4))


@pytest.mark.parametrize("name", WRONG)
def test_a_small_error_fails_on_the_right_rung_for_the_right_cause(name):
    _, first_rung, cause = WRONG[name]
    subject, results = steps_of_wrong(name)
    assert min(failures(results)) == first_rung
    assert any(cause in found for found in subject.causes)


@pytest.mark.parametrize("name", sorted(set(WRONG) - {"geom mass", "integrator"}))
def test_a_failing_step_tells_its_story(name):
    _, _, cause = WRONG[name]
    _, results = steps_of_wrong(name)
    worst, answers, likely = results[3].story
    assert re.match(r"worst state \(.*\), action [01]$", worst)
    assert re.match(r"MuJoCo \(.*\), equations \(.*\)$", answers)
    assert likely.startswith("likely cause: ")
    assert cause in likely
    assert "alone it explains 100.0%" in likely


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


@pytest.mark.parametrize(
    "name",
    [
        name if name in {"all doubled", "elsewhere"} else pytest.param(name, marks=pytest.mark.slow)
        for name in RIGHT_WITH_OTHER_NUMBERS
    ],
)
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


@pytest.mark.parametrize("height", ["0", "1e-14", "1e-9", "1e-6", "-1e-7"])
def test_a_pole_that_is_balanced_on_its_hinge(height):
    text = changed((POLE, POLE.replace('"0 0 0.5"', f'"0 0 {height}"')))
    subject, results = climb(text, "itself", (2, 3, 4, 6, 9))
    assert failures(results) == set()
    assert subject.beyond == []


UPS = {
    "y up": ("0 -9.8 0", "1 0 0", "0 0 1", "0 0.5 0"),
    "y up, turned round": ("0 -9.8 0", "1 0 0", "0 0 -1", "0 0.5 0"),
    "x up": ("-9.8 0 0", "0 1 0", "0 0 -1", "0.5 0 0"),
    "z down": ("0 0 9.8", "1 0 0", "0 1 0", "0 0 -0.5"),
    "oblique": ("-4 -5 -7", "0.3 0.9 0.1", "0.8 -0.3 0.2", "0.2 0.3 0.4"),
}


@pytest.mark.parametrize(
    "up",
    [up if up in {"z down", "oblique"} else pytest.param(up, marks=pytest.mark.slow) for up in UPS],
)
def test_whatever_is_up_moves_as_its_equations_say(up):
    gravity, rail, hinge, com = UPS[up]
    text = f"""<mujoco><option timestep="0.02" gravity="{gravity}"/><worldbody>
      <body pos="1 2 3"><joint name="x" type="slide" axis="{rail}" damping="0.1"/>
        <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
        <body><joint name="h" axis="{hinge}" frictionloss="0.01"/>
          <inertial pos="{com}" mass="0.1" diaginertia="0.01 0.02 0.02"/></body></body>
      </worldbody><actuator><motor joint="x" gear="10" ctrlrange="-1 1"/></actuator></mujoco>"""
    subject, results = climb(text, "itself", (2, 3, 4, 6))
    assert failures(results) == set()
    assert subject.beyond == []


@pytest.mark.parametrize(
    ("changes", "likely"),
    [
        ({"pole_mass": 0.1001}, "pole mass 0.1001"),
        ({"gravity": 9.81}, "gravity 9.81"),
        ({"timestep": 0.02002}, "timestep 0.02002"),
        ({"com_distance": 0.5005}, "com distance 0.5005"),
    ],
)
def test_the_cause_is_found_from_the_motion_alone(changes, likely):
    """A right model whose steps are wrong: nothing in the document says why."""
    subject = Subject(load_model("cartpole"))
    batch = subject.random_batch(99, 500, (2.4, 3.0, 0.2, 3.0))
    wrong = dataclasses.replace(CARTPOLE_V1, **changes)
    found = equations.step(wrong, batch.states, subject.forces(batch), "gym")

    def predict(p):
        return equations.step(p, batch.states, np.array(p.forces)[batch.actions], "gym")

    assert likely in likely_cause(subject, predict, found)


def test_several_wrong_parameters_are_not_blamed_on_one():
    text = changed((POLE, POLE.replace("0.1", "0.3")), ("-9.8", "-1.62"))
    _, results = climb(text, rungs=(3,))
    assert "more than one: " in results[3].story[-1]
    assert "pole mass 0.3 instead of 0.1" in results[3].story[-1]


def rod(rng):
    """A random planar rod, as a document."""
    cart, pole, length = (
        float(np.exp(rng.uniform(*np.log(ends)))) for ends in ((0.1, 10), (0.01, 5), (0.1, 5))
    )
    inertia = pole * length**2 / 12
    return changed(
        ('mass="1.0"', f'mass="{cart!r}"'),
        (POLE, f'<inertial pos="0 0 {length / 2!r}" mass="{pole!r}"'),
        (r'diaginertia="0.00833\S* 0.00833\S*', f'diaginertia="{inertia!r} {inertia!r}'),
        ("-9.8", f"-{rng.uniform(1, 25)!r}"),
        ('gear="10"', f'gear="{rng.uniform(1, 50)!r}"'),
        ('timestep="0.02"', f'timestep="{rng.uniform(0.001, 0.04)!r}"'),
    )


@pytest.mark.parametrize("seed", [*(pytest.param(n, marks=pytest.mark.slow) for n in range(5)), 5])
def test_random_rods_move_as_their_equations_and_gymnasiums_formula_do(seed):
    text = rod(np.random.default_rng([7, seed]))
    subject, results = climb(text, "itself", (2, 3, 4, 6, 7, 8, 9, 10))
    assert failures(results) == set()
    assert subject.gym_cannot == ""
    assert any("CartPole-v1" in figure.name for figure in results[3].figures)
    _, results = climb(text, rungs=(2, 3))
    assert failures(results) == {2, 3}


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(n, marks=pytest.mark.slow) for n in range(1, 6))]
)
def test_random_poles_with_damping_move_as_their_equations_do(seed):
    rng = np.random.default_rng([8, seed])
    text = rod(rng)
    text = re.sub(r'<inertial pos="0 0 [^"]*" mass="0', r'<inertial pos="0 0 0.4" mass="0', text)
    text = text.replace('name="hinge"', f'name="hinge" damping="{rng.uniform(0, 0.01)}"')
    text = text.replace('name="slider"', f'name="slider" damping="{rng.uniform(0, 1)}"')
    subject, results = climb(text, "itself", (2, 3, 4, 6, 7, 9))
    assert failures(results) == set()
    assert subject.gym_cannot
    assert results[7].verdict == "skipped"
    assert any("gymnasium is no witness here" in line for line in results[3].story)


FAR_FROM_THE_REFERENCE = [
    {"gravity": 0.0},
    {"rail.damping": 50.0, "cart.mass": 0.05},
    {"pole.mass": 1e-4, "hinge.damping": 0.01},
    {"pole.length": 0.02, "gravity": 50.0, "hinge.damping": 0.5},
    {"pole.mass": 1e-4, "gravity": 0.1, "force": 0.5},
    {"pole.length": 0.02, "pole.mass": 1e-4, "gravity": 0.1, "force": 0.5},
    {"pole.length": 40.0, "pole.mass": 1e-4, "gravity": 0.1, "force": 0.5, "timestep": 0.001},
    {"pole.length": 0.02, "pole.mass": 50.0, "cart.mass": 0.02, "force": 200.0},
    {"hinge.armature": 1.0, "rail.armature": 5.0, "hinge.damping": 1.0, "timestep": 0.005},
]


@pytest.mark.parametrize(
    "edits",
    [
        *FAR_FROM_THE_REFERENCE[:3],
        *(pytest.param(edits, marks=pytest.mark.slow) for edits in FAR_FROM_THE_REFERENCE[3:]),
    ],
    ids=",".join,
)
def test_extreme_but_right_models_move_as_their_equations_do(edits):
    cartpole = load_model("cartpole", edits, own_timestep=True)
    results = list(run_ladder(Subject(cartpole, "itself", quick=True), (1, 2, 3, 4, 5, 9)))
    assert [result.verdict for result in results] == ["holds"] * 6
    assert not any(math.isnan(figure.value) for figure in results[-1].figures)


def test_an_order_that_rounding_hides_is_not_measured():
    steep, hidden = ([2.0**-n for n in range(20)], [1e-9, 1e-11])
    assert [figure.value for figure in _order_figures("it", 1, steep)] == [0.0, 1.0]
    (figure,) = _order_figures("it", 4, hidden)
    assert "too small to tell" in figure.name
    assert figure.holds
    assert not _order_figures("it", 1, hidden)[0].holds


def test_what_dm_control_gives_up_on_is_no_crash():
    pytest.importorskip("mjcartpole.envs.dm", exc_type=ImportError)
    thick = changed(("<option ", '<option viscosity="1e300" '))
    result = climb(thick, "itself", (10,))[1][10]
    assert result.verdict == "skipped"
    assert "dm_control does not step this document" in result.skipped


def test_a_dm_control_made_for_another_mujoco_is_skipped_in_words(monkeypatch):
    pytest.importorskip("mjcartpole.envs.dm", exc_type=ImportError)
    from dm_control.mujoco.wrapper.mjbindings import sizes

    stale = {**sizes.array_sizes["mjmodel"], "renamed_since": ("nq",)}
    monkeypatch.setitem(sizes.array_sizes, "mjmodel", stale)
    result = climb(REFERENCE, "itself", (10,))[1][10]
    assert result.verdict == "skipped"
    versions = f"dm-control {version('dm-control')} with mujoco {version('mujoco')}"
    assert result.skipped.startswith(f"{versions} does not load this document: AttributeError")
    assert "renamed_since" in result.skipped


@pytest.mark.parametrize("name", ["spring", "contact", "brake"])
def test_what_the_equations_do_not_cover_is_named_and_not_passed(name):
    changes, _, cause = WRONG[name]
    _, results = climb(changed(*changes), "itself", (2, 3, 4, 6, 7, 8, 9))
    assert {result.verdict for result in results.values()} == {"beyond"}
    assert all(cause in result.skipped for result in results.values())


@pytest.mark.parametrize("limits", ["", ' range="-1 1"'])
@pytest.mark.parametrize("integrator", ["RK4", "implicit", "implicitfast", "discrete"])
def test_each_integrator_is_a_right_answer_to_the_question_about_itself(integrator, limits):
    text = changed(
        ('integrator="Euler"', f'integrator="{integrator}"'),
        ('name="hinge"', 'name="hinge" damping="0.1"'),
        ('name="slider"', f'name="slider" damping="1"{limits}'),
    )
    _, results = climb(text, "itself", (3, 4))
    assert failures(results) == set()


def test_gymnasiums_trap():
    """Setting `masscart` alone changes nothing there; set_parameters changes the right thing."""
    state, action = np.array([0.0, 0.1, 0.05, -0.1]), np.array([1])
    batch = Batch(state[None, :], action)
    untouched, trapped, right = (gymnasium.make("CartPole-v1") for _ in range(3))
    trapped.unwrapped.masscart = 2.0
    heavy = uniform_rod(cart_mass=2.0)
    set_parameters(right, heavy)
    as_it_is = gym_steps(untouched, batch)
    assert gym_steps(trapped, batch).tolist() == as_it_is.tolist()
    expected = equations.step(heavy, state, heavy.forces[1], "gym")
    np.testing.assert_allclose(gym_steps(right, batch)[0], expected, rtol=0, atol=4 * EPS)
    assert gym_steps(right, batch)[0, 1] < 0.6 * as_it_is[0, 1] + 0.05
    ours = load_model(changed(('mass="1.0"', 'mass="2.0"')))
    moved = Subject(ours, "itself").simulation("gym").steps(batch.states, np.array([1.0]))
    np.testing.assert_allclose(moved[0], expected, rtol=0, atol=4 * EPS)


def test_what_gymnasiums_formula_cannot_express_is_refused():
    env = gymnasium.make("CartPole-v1")
    for changes in (
        {"inertia": 0.01},
        {"hinge_damping": 0.1},
        {"slider_armature": 0.1},
        {"hinge_sign": -1},
        {"forces": (-9.0, 10.0)},
    ):
        other = dataclasses.replace(CARTPOLE_V1, **changes)
        assert why_not_gymnasiums(other)
        with pytest.raises(ValueError, match="cannot express"):
            set_parameters(env, other)
    assert why_not_gymnasiums(CARTPOLE_V1) == ""


def test_a_predicted_error_grows_with_the_spectral_radius():
    bounds = predicted_growth(Subject(load_model("cartpole")), 300)
    rho = linear.spectral_radius(CARTPOLE_V1, "gym")
    assert bounds[0] == pytest.approx(4 * EPS)
    assert bounds[-1] / bounds[-2] == pytest.approx(rho, rel=1e-6)


def test_verdicts():
    def verdict(*figures, **options):
        return Result(1, "", "", figures, **options).verdict

    assert verdict(Figure("a", 1.0, 1.0), Figure("b", 9.0)) == "holds"
    assert verdict(Figure("a", 1.1, 1.0)) == "fails"
    assert verdict(Figure("a", float("nan"), 1.0)) == "fails"
    assert Figure("a", float("nan"), 1.0).as_dict()["value"] == "nan"
    assert verdict(Figure("p", 0.5, 0.1, at_least=True)) == "holds"
    assert verdict(Figure("p", 0.01, 0.1, at_least=True)) == "fails"
    assert verdict(problems=("wrong",)) == "fails"
    assert verdict(skipped="no") == "skipped"
    assert verdict(skipped="no", beyond=True) == "beyond"


def test_a_rung_gives_the_same_alone_as_among_others():
    subject = Subject(load_model("cartpole"), quick=True)
    alone = step_gym(subject)
    among = next(r for r in run_ladder(subject, (1, 2, 3)) if r.rung == 3)
    assert alone == among


def test_a_rung_that_is_not_there():
    with pytest.raises(ConfigError, match="no rung 11; available: 1, 2"):
        list(run_ladder(Subject(load_model("cartpole")), (1, 11)))


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


def test_the_command_fails_with_1_and_says_why(tmp_path, capsys):
    path = tmp_path / "wrong.xml"
    path.write_text(changed(*WRONG["gravity"][0]))
    code, out, err = call(["--model", str(path), "--rungs", "1", "2", "3"], capsys)
    assert (code, err) == (1, "")
    assert "does not hold on rung 2, 3" in out
    assert out.splitlines()[-1] == "  gravity 9.81 instead of 9.8"
    assert "likely cause: gravity 9.81 instead of 9.8" in out
    code, out, _ = call(["--model", str(path), "--against", "itself", "--rungs", "2", "3"], capsys)
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
