"""Forces that the engine applies and the equations do not have."""

import dataclasses

import pytest

from mjcartpole.physics.engine_check import unexplained_forces
from mjcartpole.physics.free_region import free_region
from mjcartpole.physics.load import load_model, model_names
from mjcartpole.physics.parameters import read_parameters

REFERENCE = load_model("cartpole").xml


def kinds(cartpole, p=None):
    return set(unexplained_forces(cartpole, p or read_parameters(cartpole), free_region(cartpole)))


@pytest.mark.parametrize("name", sorted({*model_names()} - {"twopoles", "wieland"}))
def test_of_the_gallery_nothing_is_unexplained(name):
    assert kinds(load_model(name)) == set()


@pytest.mark.parametrize(
    ("changes", "kind"),
    [
        ({"gravity": 9.8001}, "qfrc_bias"),
        ({"com_distance": 0.50001}, "qfrc_bias"),
        ({"hinge_damping": 1e-6}, "qfrc_damper"),
        ({"motor_damping": 1e-3}, "qfrc_actuator"),
    ],
)
def test_wrong_parameters_leave_a_force_of_their_kind(changes, kind):
    cartpole = load_model()
    assert kind in kinds(cartpole, dataclasses.replace(read_parameters(cartpole), **changes))


@pytest.mark.parametrize(
    ("element", "attribute", "kind"),
    [
        ('name="hinge"', 'stiffness="1e-9"', "qfrc_spring"),
        ('name="hinge"', 'damping="0 1e-6"', "qfrc_damper"),
        ('<body name="pole"', 'gravcomp="1e-6"', "qfrc_gravcomp"),
        ("<option", 'density="1e-6"', "qfrc_fluid"),
    ],
)
def test_the_smallest_effect_is_seen_by_its_force(element, attribute, kind):
    cartpole = load_model(REFERENCE.replace(element, f"{element} {attribute}", 1))
    said = unexplained_forces(cartpole, read_parameters(cartpole), free_region(cartpole))
    assert kind in said
    assert "that the equations do not have (up to " in said[kind]


def test_a_cart_a_kilometre_off_has_nothing_unexplained():
    far = REFERENCE.replace('<body name="cart"', '<body name="cart" pos="700 -700 50"', 1)
    assert kinds(load_model(far)) == set()
