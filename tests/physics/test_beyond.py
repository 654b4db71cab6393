"""What the equations leave out is named, and what cannot act is not."""

import re

import mujoco
import numpy as np
import pytest

from mjcartpole.physics.beyond import beyond_equations, beyond_step, overridden_masses
from mjcartpole.physics.model import load_model
from mjcartpole.physics.parameters import read_parameters
from mjcartpole.physics.simulation import Simulation

REFERENCE = load_model("cartpole").xml


def changed(*changes):
    """The reference with changes, each a pattern and its replacement."""
    text = REFERENCE
    for pattern, replacement in changes:
        text, count = re.subn(pattern, replacement, text, count=1, flags=re.DOTALL)
        assert count == 1, pattern
    return load_model(text)


SLIDER, HINGE, MOTOR, OPTION, CART, POLE = (
    '<joint name="slider"',
    '<joint name="hinge"',
    '<motor name="push"',
    "<option",
    '<body name="cart"',
    '<body name="pole"',
)


def plus(element, attributes):
    """The change that gives an element more attributes."""
    return element, f"{element} {attributes}"


def flag(attributes):
    return 'integrator="Euler"/>', f'integrator="Euler"><flag {attributes}/></option>'


def inside(element, content):
    """The change that puts something into the world, the cart or the pole."""
    return rf"({element}[^>]*>)", rf"\1{content}"


BALL = '<geom name="ball" type="sphere" size="0.1" contype="1" conaffinity="1"/>'
GROUND = '<geom name="ground" type="plane" size="1 1 1" contype="1"/>'
SITES = '<site name="a"/>', '<site name="b"/>'
STRING = '<tendon><spatial name="string"{}><site site="a"/><site site="b"/></spatial></tendon>'
RIGGED = inside("<worldbody", SITES[0]), inside(POLE, SITES[1])


def rigged(text):
    return (*RIGGED, ("</worldbody>", f"</worldbody>{text}"))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ([plus(SLIDER, 'range="-2.4 2.4"')], "limit of joint 'slider' at -2.4 and 2.4"),
        ([plus(HINGE, 'frictionloss="0.1"')], "friction loss in joint 'hinge'"),
        ([(HINGE, '<joint stiffness="1"')], "spring (stiffness) in joint 1"),
        ([plus(HINGE, 'stiffness="0 1"')], "spring (stiffness) in joint 'hinge'"),
        (
            [plus(SLIDER, 'damping="0 1"')],
            "damping of joint 'slider' is not proportional to the velocity",
        ),
        ([plus(CART, 'euler="0 0.1 0"')], "slide axis of joint 'slider' is tilted, not horizontal"),
        ([plus(POLE, 'euler="0.1 0 0"')], "hinge axis of joint 'hinge' is tilted, not horizontal"),
        (
            [('axis="0 1 0"', 'axis="1 1 0"')],
            "hinge axis of joint 'hinge' is not perpendicular to the slide axis of joint 'slider'",
        ),
        (
            [('pos="0 0 0.5" mass', 'pos="0.01 0 0.5" mass')],
            "the pole's centre of mass is 0.01 m beside joint 'hinge' at angle 0",
        ),
        (
            [plus(HINGE, 'ref="0.1"')],
            "the pole's centre of mass is 0.0499 m beside joint 'hinge' at angle 0"
            " (its ref is 0.1 rad)",
        ),
        ([("0 0 -9.8", "1 0 -9.8")], "gravity is not vertical (1 0 -9.8)"),
        ([plus(CART, 'gravcomp="1"')], "gravity compensation of body 'cart'"),
        (
            [plus(OPTION, 'density="1.2" wind="1 0 0"')],
            "a fluid around it (option density 1.2 and wind)",
        ),
        ([plus(OPTION, 'viscosity="0.1"')], "a fluid around it (option viscosity 0.1)"),
        ([flag('gravity="disable"')], "gravity is switched off (option flag)"),
        ([flag('actuation="disable"')], "actuation is switched off (option flag)"),
        (
            [flag('damper="disable"'), plus(HINGE, 'damping="1"')],
            "damping is switched off (option flag)",
        ),
        ([flag('sleep="enable"')], "sleeping of what is at rest (option flag)"),
        (
            [('<motor (.*?) gear="10"', r'<position \1 kp="10"')],
            "bias (servo, velocity feedback) of actuator 'push'",
        ),
        (
            [('<motor (.*?) gear="10"', r'<general \1 gaintype="affine"')],
            "gain of actuator 'push' is not fixed",
        ),
        ([plus(MOTOR, 'delay="0.04" nsample="3"')], "delay of actuator 'push'"),
        ([plus(MOTOR, 'forcerange="-1 0.5"')], "force range of actuator 'push' clips its force"),
        (
            [plus(SLIDER, 'actuatorfrcrange="-9 10"')],
            "actuator force range of joint 'slider' clips the force of actuator 'push'",
        ),
        (
            [plus(MOTOR, 'group="3"'), plus(OPTION, 'actuatorgroupdisable="3"')],
            "actuator 'push' is in a disabled group",
        ),
        (
            [inside("<worldbody", GROUND), inside(CART, BALL)],
            "contact between geoms 'ground' and 'ball'",
        ),
        (
            [("</worldbody>", '</worldbody><contact><pair geom1="cart" geom2="floor"/></contact>')],
            "contact between geoms 'floor' and 'cart'",
        ),
        (rigged(STRING.format(' stiffness="2"')), "tendon 'string'"),
        (
            rigged('<equality><connect body1="pole" body2="cart" anchor="0 0 0"/></equality>'),
            "equality constraint 0",
        ),
    ],
)
def test_what_the_equations_leave_out_is_named(changes, said):
    cartpole = changed(*changes)
    assert beyond_equations(cartpole) == [said]
    assert read_parameters(cartpole).pole_mass > 0


@pytest.mark.parametrize(
    "changes",
    [
        [plus(SLIDER, 'range="-1 1"'), flag('limit="disable"')],
        [plus(HINGE, 'frictionloss="1"'), flag('constraint="disable"')],
        [inside("<worldbody", GROUND), inside(CART, BALL), flag('contact="disable"')],
        [inside(CART, BALL), inside(POLE, BALL.replace("ball", "bob"))],
        [plus(HINGE, 'springref="1"')],
        [plus(MOTOR, 'forcerange="-1 1"')],
        rigged(STRING.format("")),
        [plus(OPTION, 'wind="1 2 3"')],
    ],
)
def test_what_cannot_act_is_not_listed(changes):
    cartpole, reference = changed(*changes), load_model("cartpole")
    assert beyond_equations(cartpole) == []
    if cartpole.model.body_mass.sum() == reference.model.body_mass.sum():
        for state in np.random.default_rng(0).uniform(-3, 3, (10, 4)):
            steps = []
            for simulation in (Simulation(cartpole), Simulation(reference)):
                simulation.state = state
                steps.append(simulation.step(1.0))
            np.testing.assert_allclose(*steps, rtol=1e-13)


def test_several_things_are_all_named():
    cartpole = changed(plus(SLIDER, 'range="-1 1"'), plus(HINGE, 'range="-1 1" stiffness="1"'))
    assert len(beyond_equations(cartpole)) == 3


@pytest.mark.parametrize("seed", range(12))
def test_contacts_are_those_that_mujoco_finds(seed):
    """All geoms in one place: then every pair that MuJoCo lets through is a contact."""
    rng = np.random.default_rng(seed)

    def geoms(letter):
        masks = rng.integers(0, 4, (2, 2))
        return "".join(
            f'<geom name="{letter}{i}" size="0.1" contype="{a}" conaffinity="{b}"/>'
            for i, (a, b) in enumerate(masks)
        )

    parent = rng.choice(["enable", "disable"])
    cartpole = load_model(f"""<mujoco>
      <option timestep="0.02"><flag filterparent="{parent}"/></option>
      <worldbody>{geoms("w")}<body name="s">{geoms("s")}
        <body name="c"><joint name="x" type="slide" axis="1 0 0"/>{geoms("c")}
          <body name="d">{geoms("d")}
            <body name="p"><joint name="h" axis="0 1 0"/>{geoms("p")}
              <body>{geoms("b")}</body></body>
      </body></body></body></worldbody>
      <contact><exclude body1="p" body2="s"/><pair geom1="p1" geom2="d0"/></contact>
      <actuator><motor joint="x"/></actuator></mujoco>""")
    model, data = cartpole.model, mujoco.MjData(cartpole.model)
    mujoco.mj_forward(model, data)
    touching = {
        f"contact between geoms {' and '.join(repr(model.geom(g).name) for g in sorted(pair))}"
        for pair in data.contact.geom.tolist()
    }
    assert {said for said in beyond_equations(cartpole) if "contact" in said} == touching


def test_a_slider_that_turns_with_the_pole_is_named():
    cartpole = load_model("""<mujoco><option timestep="0.02"/><worldbody><body>
        <joint name="h" type="hinge" axis="0 1 0"/><joint name="s" type="slide" axis="1 0 0"/>
        <inertial pos="0 0 0.5" mass="0.1" diaginertia="0.01 0.01 0.01"/>
      </body></worldbody><actuator><motor joint="s"/></actuator></mujoco>""")
    said = "slide axis of joint 's' turns with the pole: joint 'h' comes first in the same body"
    assert beyond_equations(cartpole) == [said]


def test_steps_that_are_not_eulers_are_named():
    assert beyond_step(changed(('"Euler"', '"RK4"'))) == ["integrator RK4 instead of Euler"]
    assert beyond_step(changed(('"Euler"', '"implicitfast"'))) == []
    assert beyond_step(changed(flag('eulerdamp="disable"'))) == []
    damped = changed(flag('eulerdamp="disable"'), plus(HINGE, 'damping="1"'))
    assert beyond_step(damped) == ["implicit damping (eulerdamp) switched off"]


def test_a_mass_that_an_inertial_overrides_is_named():
    assert overridden_masses(load_model()) == []
    heavy = changed(('<geom name="pole"', '<geom name="pole" mass="0.01"'))
    assert read_parameters(heavy) == read_parameters(load_model())
    assert overridden_masses(heavy) == [
        "mass 0.01 of geom 'pole', which the <inertial> of body 'pole' overrides"
    ]
    used = changed(
        ('<geom name="pole"', '<geom name="pole" mass="0.01"'),
        ('angle="radian"', 'angle="radian" inertiafromgeom="true"'),
        ('<geom name="cart"', '<geom name="cart" mass="1"'),
    )
    assert overridden_masses(used) == []
