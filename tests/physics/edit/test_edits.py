"""Edits: one key at a time, in a text that differs where it was asked to."""

import difflib
import itertools
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjcartpole.errors import ConfigError, MjCartPoleError, ModelError, ModelSyntaxError
from mjcartpole.physics.edit.edits import (
    EDIT_NAMES,
    check_key,
    describe_edits,
    edit_document,
    edits_of,
    parse_edit,
)
from mjcartpole.physics.load import load_model
from mjcartpole.physics.parameters import read_parameters
from mjcartpole.physics.unmodelled_effects import differs_from
from nightly import at_night, characters, examples

REFERENCE = load_model("cartpole").xml
BOB = load_model("bob").xml


def parameters(text):
    return read_parameters(load_model(text, own_timestep=True))


def changed_lines(before, after):
    lines = difflib.ndiff(before.splitlines(), after.splitlines())
    return [line[2:].strip() for line in lines if line.startswith("+")]


# --- by element ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("key", "value", "line"),
    [
        (
            "joint:hinge.damping",
            0.1,
            '<joint name="hinge" type="hinge" axis="0 1 0" damping="0.1"/>',
        ),
        ("geom:cart.rgba", [1, 0, 0, 0.5], 'material="blue" rgba="1 0 0 0.5"/>'),
        ("geom:cart.rgba", "1 0 0 1", 'material="blue" rgba="1 0 0 1"/>'),
        ("option.integrator", "RK4", 'integrator="RK4"/>'),
        ("body:cart.pos", np.array([0, 0, 0.1]), '<body name="cart" pos="0 0 0.1">'),
        ("motor:push.gear", 20, 'gear="20" ctrlrange="-1 1"/>'),
        ("motor.gear", "20", 'gear="20" ctrlrange="-1 1"/>'),
        ("actuator.motor.gear", "20", 'gear="20" ctrlrange="-1 1"/>'),
        ("actuator.motor:push.gear", "20", 'gear="20" ctrlrange="-1 1"/>'),
        ("default.joint.damping", 1, '<joint damping="1" frictionloss="0" armature="0"/>'),
        ("default:stop.geom.size", "1 1 1", '<geom type="box" size="1 1 1" material="signal"/>'),
        ("body:cart.inertial.mass", 3, '<inertial pos="0 0 0" mass="3" diagin'),
        ("option.flag.contact", "disable", '<flag contact="disable"/></option>'),
        ("flag.contact", "disable", '<flag contact="disable"/></option>'),
        ("size.nuserdata", 3, '<size nuserdata="3"/>'),
        ("headlight.active", np.int64(1), 'specular="0 0 0" active="1"/>'),
        ("visual.scale.com", 2.0, '<scale com="2"/>'),
        ("compiler.autolimits", False, 'autolimits="false"/>'),
        ("mujoco.model", 'a "b" & c', '<mujoco model="a &quot;b&quot; &amp; c">'),
    ],
)
def test_one_attribute_of_one_element(key, value, line):
    text = edit_document(REFERENCE, {key: value})
    (changed,) = changed_lines(REFERENCE, text)
    assert line in changed
    assert key == "compiler.autolimits" or load_model(text)
    assert edit_document(text, {key: value}) == text


def test_an_element_has_the_last_word():
    text = edit_document(REFERENCE, {"body:pole.inertial.mass": 0.2, "pole.mass": 0.5})
    assert parameters(text).pole_mass == 0.2
    assert parameters(text).inertia == 0.5 / 12


def test_names_may_hold_dots():
    dotted = REFERENCE.replace('name="hinge"', 'name="hinge.damping"')
    dotted = dotted.replace('name="slider"', 'name="hinge"').replace('="slider"', '="hinge"')
    damped = parameters(edit_document(dotted, {"joint:hinge.damping": 1}))
    assert (damped.slider_damping, damped.hinge_damping) == (1, 0)
    damped = parameters(edit_document(dotted, {"joint:hinge.damping.damping": 1}))
    assert (damped.slider_damping, damped.hinge_damping) == (0, 1)


# --- refusals -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("edits", "said"),
    [
        ({"pole.lenght": 1}, "called 'pole.lenght': did you mean 'pole.length'"),
        ({"colour": 1}, "available: cart.mass, force, gravity"),
        ({"jiont:hinge.damping": 1}, "did you mean 'joint'"),
        ({"joint:hing.damping": 1}, "is called 'hing', did you mean 'hinge'"),
        ({"joint:hinge.dampng": 1}, "<joint> has no attribute 'dampng', did you mean 'damping'"),
        ({"joint:hinge.polycoef": 1}, "<joint> has no attribute 'polycoef'"),
        ({"body:pole.inertial.mas": 1}, "<inertial> has no attribute 'mas', did you mean 'mass'"),
        ({"joint:hinge": 1}, "names no attribute"),
        ({"option.": 1}, "names no attribute"),
        ({"joint.damping": 1}, "2 <joint>; say which of joint:slider, joint:hinge"),
        ({"inertial.mass": 1}, "say which of body:cart.inertial, body:pole.inertial"),
        ({"site:tip.pos": "0 0 0"}, "no <site> of the document is called 'tip'"),
        ({"site.pos": "0 0 0"}, "the document has no <site>"),
        ({"body:pole.site.pos": "0 0 0"}, "body:pole has no <site>"),
        ({"motor:push.gear": 1, "motor.gear": 2}, "are the same attribute"),
        ({"pole.mass": 0}, "pole.mass must be finite and more than 0 (kg), not 0"),
        ({"pole.mass": -1}, "more than 0 (kg), not -1"),
        ({"cart.mass": "much"}, "cart.mass must be a number (kg), not 'much'"),
        ({"cart.mass": None}, "must be a number"),
        ({"cart.mass": True}, "must be a number"),
        ({"pole.length": 0.0}, "more than 0 (m)"),
        ({"pole.length": float("inf")}, "must be finite"),
        ({"pole.length": 1e200}, "would not be finite"),
        ({"gravity": float("nan")}, "must be finite"),
        ({"gravity": -9.8}, "0 or more"),
        ({"timestep": 0}, "more than 0 (s)"),
        ({"force": 0}, "more than 0 (N)"),
        ({"hinge.damping": -0.1}, "0 or more (N m s/rad)"),
        ({"rail.friction": -0.1}, "0 or more (N)"),
        ({"joint:hinge.damping": -0.1}, "must be 0 or more, not '-0.1'"),
        ({"joint:hinge.armature": "nan"}, "must be finite, not 'nan'"),
        ({"body:pole.inertial.mass": 0}, "must be more than 0, not '0'"),
        ({"body:pole.inertial.diaginertia": "1 1 -1"}, "must be 0 or more"),
        ({"option.timestep": "0"}, "must be more than 0"),
        ({"geom:pole.rgba": [1, 0, float("inf"), 1]}, "must be finite"),
        ({"geom:pole.rgba": {"r": 1}}, "must be text, a number or several numbers"),
        ({"geom:pole.rgba": None}, "must be text, a number or several numbers"),
        ({"geom:pole.name": "a\x00b"}, "must be printable text"),
    ],
)
def test_what_makes_no_sense_is_refused_with_the_reason(edits, said):
    with pytest.raises(ConfigError, match=re.escape(said)) as caught:
        edit_document(REFERENCE, edits)
    assert "\n" not in str(caught.value)


def test_what_does_not_compile_is_the_loaders_error():
    text = edit_document(REFERENCE, {"option.integrator": "Simpson"})
    with pytest.raises(ModelSyntaxError):
        load_model(text)
    for bad in ("<mujoco>", "<mujoco/>"):
        with pytest.raises(ModelError):
            edit_document(bad, {"pole.mass": 1})


KEYS = [*EDIT_NAMES, "joint:hinge.damping", "option.integrator", "geom:pole.size", "default.geom.x"]


@examples(200)
@given(
    st.text(characters(), max_size=12) | st.sampled_from(KEYS),
    st.none() | st.floats() | st.text(characters(), max_size=8),
)
def test_anything_gives_a_document_or_one_clear_line(key, value):
    try:
        text = edit_document(REFERENCE, {key: value})
        load_model(text, own_timestep=True)
    except MjCartPoleError as error:
        assert "\n" not in str(error)


# --- the command line ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "edit"),
    [
        ("pole.length=1.5", ("pole.length", 1.5)),
        (" gravity = 1e-3 ", ("gravity", 0.001)),
        ("joint:hinge.damping=0.1", ("joint:hinge.damping", "0.1")),
        ('geom:pole.rgba="1 0 0 1"', ("geom:pole.rgba", "1 0 0 1")),
        ("geom:pole.rgba='1 0 0 1'", ("geom:pole.rgba", "1 0 0 1")),
        ("text:t.data=a=b", ("text:t.data", "a=b")),
    ],
)
def test_an_edit_is_read_from_the_command_line(text, edit):
    assert parse_edit(text) == edit


@pytest.mark.parametrize(
    "text",
    [
        "",
        "=",
        "pole.length",
        "pole.length=",
        "=1",
        "pole.length 1.5",
        "pole.length=long",
        "pole.length=-1",
        "pole=1",
        "joint.x=1",
        "gravity.x=1",
        "joint=1",
        "option.=1",
        ":a.b=1",
        ".=1",
    ],
)
def test_what_is_no_edit_is_refused_in_one_line(text):
    with pytest.raises(ConfigError) as caught:
        parse_edit(text)
    assert "\n" not in str(caught.value)


def test_edits_may_be_texts_or_a_mapping():
    assert edits_of([]) == edits_of({}) == {}
    assert edits_of("gravity=3") == edits_of(["gravity=3"]) == {"gravity": 3.0}
    assert edits_of({"gravity": "3"}) == {"gravity": "3"}
    with pytest.raises(ConfigError, match="'gravity' is edited twice"):
        edits_of(["gravity=3", "gravity=4"])


def test_every_name_is_described_and_works():
    for name, text in EDIT_NAMES.items():
        check_key(name)
        assert re.fullmatch(r"[^\n]+ \([^()]+\)", text), text
        assert edit_document(REFERENCE, {name: 0.005}) != REFERENCE


# --- in words -----------------------------------------------------------------------------------


def test_edits_are_described():
    text = edit_document(REFERENCE, {"cart.mass": 2, "joint:hinge.damping": 0.1})
    assert describe_edits(REFERENCE, text) == [
        "body:cart.inertial.mass: 1.0 → 2",
        "joint:hinge.damping: nothing → 0.1",
    ]
    assert describe_edits(REFERENCE, REFERENCE) == []
    (line,) = describe_edits(REFERENCE, BOB)
    assert re.fullmatch(r"other elements: \d+ before, \d+ after", line)


def test_differences_from_the_reference_are_named():
    assert differs_from(load_model("cartpole")) == []
    edits = {"pole.mass": 0.2, "rail.friction": 1, "option.integrator": "RK4"}
    assert differs_from(load_model(edit_document(REFERENCE, edits))) == [
        "pole mass 0.2 instead of 0.1",
        "inertia 0.0166667 instead of 0.00833333",
        "friction loss 1 instead of 0 in joint 'slider'",
        "integrator RK4 instead of Euler",
    ]


def test_every_pair_of_edits_touches_only_its_own_lines():
    values = dict.fromkeys(EDIT_NAMES, 0.004)
    alone = {
        name: set(changed_lines(REFERENCE, edit_document(REFERENCE, {name: value})))
        for name, value in values.items()
    }
    pairs = list(itertools.combinations(values, 2))
    for a, b in pairs[:: at_night(1, fast=5)]:
        lines = changed_lines(REFERENCE, edit_document(REFERENCE, {a: values[a], b: values[b]}))
        assert len(lines) <= len(alone[a]) + len(alone[b])
