"""Edits by meaning: the physics that was asked for, and every number that belongs to it."""

import difflib
import re

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjcartpole.errors import ConfigError, ModelSyntaxError
from mjcartpole.physics.edit.document import Document
from mjcartpole.physics.edit.edits import edit_document
from mjcartpole.physics.edit.semantic_edits import apply_meanings
from mjcartpole.physics.equations import Parameters
from mjcartpole.physics.load import load_model, model_names, same_model
from mjcartpole.physics.parameters import differences, read_parameters
from mjcartpole.physics.unmodelled_effects import beyond_equations
from nightly import examples

MUJOCO_3 = mujoco.__version__.startswith("3.")
only_mujoco_3 = pytest.mark.skipif(not MUJOCO_3, reason="MuJoCo 4 reads every double")

REFERENCE = load_model("cartpole").xml
BOB = load_model("bob").xml

FROM_GEOMS = """<mujoco>
  <default>
    <geom density="700"/>
    <default class="pole">
      <geom type="capsule" fromto="0 0 .1 0 0 .9" size=".03" mass=".2"/>
    </default>
  </default>
  <option timestep="0.02"/>
  <worldbody>
    <body name="c"><joint name="x" type="slide" axis="1 0 0" damping="0.5"/>
      <geom type="box" size=".2 .1 .1"/>
      <geom type="sphere" size=".1" mass="0.3"/>
      <body name="p" pos="0 0 0.1"><joint axis="0 1 0" pos="0 0 0.1"/>
        <geom class="pole"/>
        <site name="tip" pos="0 0 .9"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="x" ctrlrange="-4 4" gear="-3"/></actuator>
</mujoco>
"""


def parameters(text):
    return read_parameters(load_model(text, own_timestep=True))


def changed_lines(before, after):
    lines = difflib.ndiff(before.splitlines(), after.splitlines())
    return [line[2:].strip() for line in lines if line.startswith("+")]


def number(low, high):
    return st.floats(np.log(low), np.log(high)).map(lambda value: float(np.exp(value)))


EDITS = st.fixed_dictionaries(
    {},
    optional={
        "pole.length": number(0.05, 20),
        "pole.mass": number(1e-3, 100),
        "cart.mass": number(1e-3, 100),
        "gravity": st.just(0.0) | number(0.01, 100),
        "force": number(0.01, 1000),
        "timestep": number(1e-4, 0.1),
        "hinge.damping": st.just(0.0) | number(1e-6, 10),
        "hinge.armature": number(1e-6, 1),
        "rail.damping": number(1e-6, 10),
        "rail.armature": number(1e-6, 1),
    },
)


def rod(edits):
    """The analytic uniform rod with some edits, computed without the model."""
    length, mass = edits.get("pole.length", 1.0), edits.get("pole.mass", 0.1)
    force = edits.get("force", 10.0)
    return Parameters(
        cart_mass=edits.get("cart.mass", 1.0),
        pole_mass=mass,
        com_distance=length / 2,
        inertia=mass * length**2 / 12,
        gravity=edits.get("gravity", 9.8),
        slider_damping=edits.get("rail.damping", 0.0),
        hinge_damping=edits.get("hinge.damping", 0.0),
        slider_armature=edits.get("rail.armature", 0.0),
        hinge_armature=edits.get("hinge.armature", 0.0),
        forces=(-force, force),
        timestep=edits.get("timestep", 0.02),
    )


# --- the physics that was asked for -------------------------------------------------------------


@examples(40)
@given(EDITS, st.randoms())
def test_any_edits_in_any_order_give_the_analytic_rod(edits, random):
    at_once = edit_document(REFERENCE, edits)
    assert differences(parameters(at_once), rod(edits), rtol=1e-12) == []
    items = list(edits.items())
    random.shuffle(items)
    assert edit_document(REFERENCE, dict(items)) == at_once
    step_by_step = REFERENCE
    for key, value in items:
        step_by_step = edit_document(step_by_step, {key: value})
    assert differences(parameters(step_by_step), rod(edits), rtol=1e-12) == []
    assert edit_document(at_once, edits) == at_once
    assert beyond_equations(load_model(at_once, own_timestep=True)) == []


@examples(25)
@given(EDITS, EDITS)
def test_the_last_edit_decides(first, second):
    text = edit_document(edit_document(REFERENCE, first), second)
    assert differences(parameters(text), rod({**first, **second}), rtol=1e-12) == []


@examples(25)
@given(EDITS)
def test_the_pole_is_drawn_as_long_as_it_is(edits):
    text = edit_document(REFERENCE, edits)
    spec = mujoco.MjSpec.from_string(text)
    assert spec.geom("pole").fromto[5] == edits.get("pole.length", 1.0)
    np.testing.assert_array_equal(spec.geom("hinge_cap").fromto, [0, -0.04, 0, 0, 0.04, 0])


def test_edits_are_those_that_a_hand_would_make():
    edits = {
        "pole.length": 1.5,
        "pole.mass": 0.4,
        "gravity": 1.62,
        "force": 5,
        "rail.friction": 2,
    }
    by_hand = REFERENCE
    for old, new in [
        ("0 0 -9.8", "0 0 -1.62"),
        ('gear="10"', 'gear="5"'),
        ('type="slide" axis="1 0 0"', 'type="slide" axis="1 0 0" frictionloss="2"'),
        ('pos="0 0 0.5" mass="0.1"', 'pos="0 0 0.75" mass="0.4"'),
        ("0.008333333333333333 0.008333333333333333 0.00001", "0.075 0.075 4e-05"),
        ('fromto="0 0 0 0 0 1"', 'fromto="0 0 0 0 0 1.5"'),
    ]:
        assert by_hand.count(old) == 1
        by_hand = by_hand.replace(old, new)
    assert edit_document(REFERENCE, edits) == by_hand


def test_edits_are_those_that_mujocos_spec_would_make():
    spec = mujoco.MjSpec.from_string(REFERENCE)
    spec.body("pole").mass, spec.body("pole").ipos[2] = 0.3, 1.0
    spec.body("pole").inertia = [0.1, 0.1, 3e-5]  # 0.3 * 2^2 / 12
    fromto = spec.geom("pole").fromto.copy()
    fromto[5] = 2.0
    spec.geom("pole").fromto = fromto
    spec.joint("hinge").damping[0], spec.option.timestep = 0.1, 0.005
    edits = {"pole.mass": 0.3, "pole.length": 2, "hinge.damping": 0.1, "timestep": 0.005}
    edited = load_model(edit_document(REFERENCE, edits))
    assert same_model(spec.compile(), edited.model)


def test_reference_values_leave_the_reference_as_it_is():
    edits = {
        "pole.length": 1,
        "pole.mass": 0.1,
        "cart.mass": 1,
        "gravity": 9.8,
        "force": 10,
        "timestep": 0.02,
        "hinge.damping": 0,
        "rail.friction": -0.0,
    }
    assert edit_document(REFERENCE, edits) == REFERENCE
    assert edit_document(REFERENCE, {}) == REFERENCE


def test_a_rod_written_with_six_digits_becomes_exact():
    rounded = REFERENCE.replace("0.008333333333333333", "0.00833333")
    text = edit_document(rounded, {"pole.mass": 0.2})
    assert differences(parameters(text), rod({"pole.mass": 0.2})) == []


# --- other models -------------------------------------------------------------------------------


@examples(20)
@given(number(0.1, 10), number(0.01, 10), number(0.01, 10), number(0.1, 100))
def test_geoms_are_scaled_where_they_decide_the_mass(length, mass, cart, force):
    edits = {"pole.length": length, "pole.mass": mass, "cart.mass": cart, "force": force}
    text = edit_document(FROM_GEOMS, edits)
    found, before = parameters(text), parameters(FROM_GEOMS)
    assert found.pole_mass == pytest.approx(mass, rel=1e-12)
    assert found.cart_mass == pytest.approx(cart, rel=1e-12)
    assert found.forces == pytest.approx((-force, force), rel=1e-12)
    # Reach before: 0.9 - 0.1 from the hinge, centre half-way between 0.1 and 0.9, which is 0.4.
    assert before.com_distance == pytest.approx(0.4)
    assert found.com_distance == pytest.approx(length / 2, rel=1e-12)
    again = parameters(edit_document(text, edits))
    assert differences(again, found, rtol=1e-12) == []


def test_what_a_class_gives_is_written_at_the_element():
    text = edit_document(FROM_GEOMS, {"pole.length": 1.6})
    assert changed_lines(FROM_GEOMS, text) == [
        '<geom class="pole" fromto="0 0 0.1 0 0 1.7000000000000002"/>',
        '<site name="tip" pos="0 0 1.7000000000000002"/>',
    ]
    text = edit_document(FROM_GEOMS, {"cart.mass": 2 * parameters(FROM_GEOMS).cart_mass})
    assert changed_lines(FROM_GEOMS, text) == [
        '<geom type="box" size=".2 .1 .1" density="1400"/>',
        '<geom type="sphere" size=".1" mass="0.6"/>',
    ]
    text = edit_document(FROM_GEOMS, {"gravity": 5})
    assert changed_lines(FROM_GEOMS, text) == ['<option timestep="0.02" gravity="0 0 -5"/>']


@pytest.mark.parametrize(
    "geom",
    [
        '<geom type="capsule" fromto="0 0 0 0 0 1" size="0.04"/>',
        '<geom type="cylinder" pos="0 0 .5" size="0.04 0.5"/>',
        '<geom type="box" pos="0 0 .5" size="0.04 .03 0.5"/>',
        '<geom type="box" pos="0 0 .5" size="0.5 .03 0.04" euler="0 1.5707963267948966 0"/>',
        '<geom type="ellipsoid" pos="0 0 .5" size="0.04 .04 0.5"/>',
        '<inertial pos="0 0 .5" mass=".4" diaginertia=".02 .02 .001"/>'
        '<geom type="capsule" fromto="0 0 0 0 0 1" size="0.04"/>',
    ],
)
def test_poles_of_any_kind_are_stretched(geom):
    text = REFERENCE.replace('contype="0" conaffinity="0" mass="0"', 'contype="0"')
    text, count = re.subn(r'(axis="0 1 0"/>).*?</body>', rf"\1{geom}</body>", text, flags=re.DOTALL)
    assert count == 1
    before, after = parameters(text), parameters(edit_document(text, {"pole.length": 2}))
    assert after.com_distance == pytest.approx(1, rel=1e-12)
    assert after.pole_mass == pytest.approx(before.pole_mass, rel=1e-12)
    assert 3.5 < after.inertia / before.inertia < 4.01


def test_what_is_fixed_to_the_pole_moves_along():
    found = parameters(edit_document(BOB, {"pole.length": 2, "pole.mass": 0.4}))
    # A rod of 0.2 kg and 2 m, a ball of 0.2 kg and r = 0.06 m at its end; centre at 1.5 m.
    inertia = 0.2 * 4 / 12 + 0.2 * 0.5**2 + 0.2 * 0.5**2 + 2 * 0.000144
    assert found.com_distance == pytest.approx(1.5, rel=1e-12)
    assert found.inertia == pytest.approx(inertia, rel=1e-12)


@only_mujoco_3
def test_a_number_that_mujoco_does_not_read_is_one_line():
    """It calls a number too large that is too small for a double of full precision."""
    with pytest.raises(ModelSyntaxError, match="number is too large in attribute 'damping'"):
        load_model("cartpole", {"hinge.damping": 1e-310, "pole.length": 2})


@pytest.mark.skipif(MUJOCO_3, reason="MuJoCo 3 does not read it")
def test_the_smallest_numbers_are_read():
    cartpole = load_model("cartpole", {"gravity": 1e-310, "hinge.damping": 5e-324})
    assert cartpole.model.opt.gravity[2] == -1e-310
    assert cartpole.model.dof_damping[cartpole.hinges[0]] == 5e-324


def test_horizontal_gravity_stays():
    text = edit_document(load_model("wind").xml, {"gravity": 3})
    np.testing.assert_array_equal(load_model(text).model.opt.gravity, [0.5, 0, -3])


# --- refusals ---


@pytest.mark.parametrize(
    ("old", "new", "edits", "said"),
    [
        ('gear="10" ctrlrange="-1 1"', 'ctrlrange="-9 11"', {"force": 5}, "not equally to both"),
        ("<motor", '<general biastype="affine" biasprm="1"', {"force": 5}, "no plain motor"),
        ('angle="radian"', 'angle="radian" settotalmass="3"', {"pole.mass": 1}, "settotalmass"),
        (
            'axis="0 1 0"',
            'axis="0 1 0" springdamper="1 1" stiffness="1"',
            {"hinge.damping": 0.3},
            "springdamper",
        ),
        (
            '<body name="pole">',
            '<body name="pole"><replicate count="2"><body name="r">'
            '<geom size="1"/></body></replicate>',
            {"pole.length": 2},
            "edit by element",
        ),
        ('pos="0 0 0.5" mass="0.1"', 'pos="0 0 0" mass="0.1"', {"pole.length": 2}, "no direction"),
        ('mass="0.1"', 'mass="0.1" euler="0.1 0 0"', {"pole.length": 2}, "turned or beside"),
        ('pos="0 0 0.5" mass="0.1"', 'pos="0.1 0 0.5" mass="0.1"', {"pole.length": 2}, "beside"),
    ],
)
def test_what_the_document_does_not_allow_is_refused(old, new, edits, said):
    assert REFERENCE.count(old) == 1
    text = REFERENCE.replace(old, new)
    with pytest.raises(ConfigError, match=re.escape(said)) as caught:
        edit_document(text, edits)
    assert "\n" not in str(caught.value)


# --- in one step --------------------------------------------------------------------------------


@pytest.mark.parametrize("name", model_names())
def test_in_one_step_is_the_same_as_step_by_step(name):
    cartpole = load_model(name)
    of_pole = [f"pole{n + 1}" if cartpole.poles > 1 else "pole" for n in range(cartpole.poles)]
    edits = {f"{pole}.length": 0.7 for pole in of_pole} | {f"{pole}.mass": 0.3 for pole in of_pole}
    edits |= {"cart.mass": 0.8, "gravity": 5.0}
    first, second = Document(cartpole.xml), Document(cartpole.xml)
    apply_meanings(first, edits, name, in_one=True)
    apply_meanings(second, edits, name, in_one=False)
    assert first.text == second.text != cartpole.xml


@only_mujoco_3
@pytest.mark.parametrize(
    ("edits", "who"),
    [
        ({}, "cartpole with gravity=1e-310"),
        ({"pole.mass": 1.2}, "cartpole"),
        ({"pole.length": 1.2}, "the edited document"),
    ],
)
def test_the_first_step_that_fails_says_why(edits, who):
    with pytest.raises(ModelSyntaxError, match=f"^{who} is not a valid MJCF: number is too large"):
        load_model("cartpole", {"gravity": 1e-310, **edits})
