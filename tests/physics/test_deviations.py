"""By what a model differs from a reference."""

import pytest

from mjcartpole.physics.deviations import deviations
from mjcartpole.physics.equations import CARTPOLE_V1
from mjcartpole.physics.load import load_model
from mjcartpole.physics.parameters import read_parameters

REFERENCE = load_model("cartpole").xml


def found(old, new):
    assert old in REFERENCE
    return deviations(load_model(REFERENCE.replace(old, new, 1)), CARTPOLE_V1)


def test_the_reference_deviates_in_nothing():
    cartpole = load_model()
    assert deviations(cartpole, CARTPOLE_V1) == []
    long = load_model("long")
    assert deviations(long, read_parameters(long)) == []


@pytest.mark.parametrize(
    ("old", "new", "phrase", "fields"),
    [
        ('axis="1 0 0"', 'axis="1 0 0.01"', "slide axis of joint 'slider' tilted", {"rail_tilt"}),
        (
            'axis="0 1 0"',
            'axis="0 1 0.01"',
            "hinge axis of joint 'hinge' tilted",
            {"hinge_tilt", "com_distance", "inertia"},
        ),
        (
            'axis="0 1 0"',
            'axis="0.01 1 0"',
            "out of square by 0.573 degrees",
            {"skew", "com_distance", "inertia"},
        ),
        ('axis="0 1 0"', 'axis="0 -1 0"', "turned round", {"hinge_sign"}),
        ('name="hinge"', 'name="hinge" ref="0.1"', "leans by -5.73 degrees", {"lean"}),
        ("0 0 -9.8", "0 0 9.8", "leans to -x (gravity is 0 0 9.8)", {"hinge_sign"}),
        ("0 0 -9.8", "0.5 0 -9.8", "gravity 0.5 0 -9.8", {"gravity", "rail_tilt", "lean"}),
        ("0 0 -9.8", "0 2 -9.8", "gravity 0 2 -9.8 instead of 9.8", {"gravity", "hinge_tilt"}),
        ("0 0 -9.8", "0 0 -9.81", "gravity 9.81 instead of 9.8", {"gravity"}),
        (
            'name="slider"',
            'name="slider" frictionloss="2"',
            "friction loss 2 instead of 0 in joint 'slider'",
            {"slider_friction"},
        ),
    ],
)
def test_each_is_named_as_what_it_is(old, new, phrase, fields):
    (first, *_) = found(old, new)
    assert phrase in first.phrase
    assert first.fields == fields
