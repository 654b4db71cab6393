"""Right models, however far from the reference, move as their own equations do."""

import math
import re

import numpy as np
import pytest

from mjcartpole.physics.load import load_model
from mjcartpole.studies.parity import Subject, run_ladder
from nightly import few
from parity_cases import POLE, WRONG, changed, climb, failures


@pytest.mark.slow
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


@pytest.mark.long
@pytest.mark.parametrize(
    "up",
    [up if up == "oblique" else pytest.param(up, marks=pytest.mark.slow) for up in UPS],
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


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
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


@pytest.mark.slow
@pytest.mark.parametrize("edits", FAR_FROM_THE_REFERENCE, ids=",".join)
def test_extreme_but_right_models_move_as_their_equations_do(edits):
    cartpole = load_model("cartpole", edits, own_timestep=True)
    results = list(run_ladder(Subject(cartpole, "itself", quick=True), (1, 2, 3, 4, 5, 9)))
    assert [result.verdict for result in results] == ["holds"] * 6
    assert not any(math.isnan(figure.value) for figure in results[-1].figures)


@pytest.mark.parametrize("name", ["spring", "contact", "brake"])
def test_what_the_equations_do_not_cover_is_named_and_not_passed(name):
    changes, _, cause = WRONG[name]
    _, results = climb(changed(*changes), "itself", (2, 3, 4, 6, 7, 8, 9))
    assert {result.verdict for result in results.values()} == {"beyond"}
    assert all(cause in result.skipped for result in results.values())


@pytest.mark.parametrize("limits", few(["", ' range="-1 1"'], ""))
@pytest.mark.parametrize(
    "integrator", few(["RK4", "implicit", "implicitfast", "discrete"], "RK4", "discrete")
)
def test_each_integrator_is_a_right_answer_to_the_question_about_itself(integrator, limits):
    text = changed(
        ('integrator="Euler"', f'integrator="{integrator}"'),
        ('name="hinge"', 'name="hinge" damping="0.1"'),
        ('name="slider"', f'name="slider" damping="1"{limits}'),
    )
    _, results = climb(text, "itself", (3, 4))
    assert failures(results) == set()
