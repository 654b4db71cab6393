"""What the equations leave out is named, and what cannot act is not."""

import re

import mujoco
import numpy as np
import pytest

from mjcartpole.physics.equations import step
from mjcartpole.physics.file_steps import method_of
from mjcartpole.physics.free_region import free_region
from mjcartpole.physics.load import load_model
from mjcartpole.physics.parameters import read_parameters
from mjcartpole.physics.simulation import Simulation
from mjcartpole.physics.unmodelled_effects import (
    beyond_equations,
    beyond_step,
    differs_from,
    idle_numbers,
    overridden_masses,
)
from nightly import few

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
        ([(HINGE, '<joint stiffness="1"')], "spring (stiffness) in joint 1"),
        ([plus(HINGE, 'stiffness="0 1"')], "spring (stiffness) in joint 'hinge'"),
        (
            [plus(SLIDER, 'damping="0 1"')],
            "damping of joint 'slider' is not proportional to the velocity",
        ),
        ([plus(POLE, 'gravcomp="1"')], "gravity compensation of body 'pole'"),
        (
            [plus(OPTION, 'density="1.2" wind="1 0 0"')],
            "a fluid around it (option density 1.2 and wind)",
        ),
        ([plus(OPTION, 'viscosity="0.1"')], "a fluid around it (option viscosity 0.1)"),
        (
            [('<motor (.*?) gear="10"', r'<position \1 kp="10"')],
            "spring (a servo's feedback of the position) of actuator 'push'",
        ),
        ([plus(MOTOR, 'delay="0.04" nsample="3"')], "delay of actuator 'push'"),
        (
            [inside("<worldbody", GROUND), inside(CART, BALL)],
            "contact between geoms 'ground' and 'ball'",
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


WHAT_ACTS_UNSEEN = '<dcmotor {} input="none" motorconst="0.05" resistance="1"/>'


@pytest.mark.parametrize("place", [r"(</actuator>)", r"(<actuator>)"])
@pytest.mark.parametrize(("joint", "unit"), [("hinge", "N m"), ("slider", "N")])
def test_an_actuator_without_input_is_seen_by_its_force(place, joint, unit):
    brake = WHAT_ACTS_UNSEEN.format(f'name="brake" joint="{joint}"')
    whole = rf"{brake}\1" if "/" in place else rf"\1{brake}"
    cartpole = changed((place, whole))
    (said,) = beyond_equations(cartpole)
    assert re.fullmatch(
        rf"actuator force by actuator 'brake' on joint '{joint}' that the equations do not have "
        rf"\(up to \S+ {unit}\)",
        said,
    )
    assert cartpole.controls == (-1.0, 1.0)
    assert read_parameters(cartpole).forces == (-10.0, 10.0)


@pytest.mark.parametrize(
    ("option", "said"),
    [
        ('solver="PGS"', "the solver PGS"),
        ('noslip_iterations="3"', "3 noslip iterations"),
        ('iterations="1"', "a solver that ends after 1 iterations"),
        ('ls_iterations="2"', "a solver that ends after 2 ls_iterations"),
    ],
)
def test_dry_friction_that_is_not_solved_to_the_end_is_named(option, said):
    rough = changed(plus(OPTION, option), plus(SLIDER, 'frictionloss="1"'))
    assert beyond_equations(rough) == [f"friction loss in joint 'slider' by {said}"]
    assert beyond_equations(changed(plus(OPTION, option))) == []


def test_what_has_no_force_here_is_not_named():
    assert beyond_equations(changed(plus(CART, 'gravcomp="1"'))) == []
    asleep = flag('sleep="enable"')
    assert beyond_equations(changed(asleep)) == []
    allowed = plus(CART, 'sleep="allowed"')
    assert beyond_equations(changed(asleep, allowed)) == [
        "sleeping of what is at rest (option flag)"
    ]


def test_a_force_of_a_kind_that_nobody_listed_is_seen(monkeypatch):
    """Whatever the names know: here they know nothing."""
    monkeypatch.setattr("mjcartpole.physics.unmodelled_effects._surroundings", lambda cartpole: [])
    thick = changed(plus(OPTION, 'viscosity="0.1"'))
    (said,) = beyond_equations(thick)
    assert said.startswith("fluid force on joint 'slider' that the equations do not have")


@pytest.mark.parametrize(
    "changes",
    [
        [plus(SLIDER, 'range="-1 1"')],
        [plus(SLIDER, 'range="-1 1"'), flag('limit="disable"')],
        [plus(HINGE, 'frictionloss="0.1"')],
        [plus(CART, 'euler="0 0.1 0"')],
        [plus(POLE, 'euler="0.1 0 0"')],
        [('axis="0 1 0"', 'axis="0.3 1 0"')],
        [('axis="0 1 0"', 'axis="0.3 1 0.2"'), ("0 0 -9.8", "1 0.4 -9.8")],
        [('pos="0 0 0.5" mass', 'pos="0.01 0 0.5" mass')],
        [plus(HINGE, 'ref="0.1"')],
        [("0 0 -9.8", "1 0 -9.8")],
        [flag('gravity="disable"')],
        [flag('actuation="disable"')],
        [flag('damper="disable"'), plus(HINGE, 'damping="1"')],
        [('<motor (.*?) gear="10"', r'<general \1 gaintype="affine"')],
        [('<motor (.*?) gear="10"', r'<velocity \1 kv="3"')],
        [plus(MOTOR, 'forcerange="-1 0.5"')],
        [plus(SLIDER, 'actuatorfrcrange="-9 10"')],
        [plus(MOTOR, 'group="3"'), plus(OPTION, 'actuatorgroupdisable="3"')],
        [("</worldbody>", '</worldbody><contact><pair geom1="cart" geom2="floor"/></contact>')],
    ],
)
def test_what_the_equations_cover_moves_as_they_say(changes):
    cartpole = changed(*changes)
    assert beyond_equations(cartpole) == []
    p, region = read_parameters(cartpole), free_region(cartpole).within((-2, 2), (-0.2, 0.2))
    rng, simulation = np.random.default_rng(0), Simulation(cartpole)
    for _ in range(20):
        state = [rng.uniform(*region.x), rng.normal(), rng.uniform(*region.theta), rng.normal()]
        simulation.state, action = state, int(rng.integers(2))
        expected = step(p, state, p.forces[action])
        found = simulation.step(cartpole.controls[action])
        np.testing.assert_allclose(found, expected, rtol=1e-13, atol=1e-13)


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
    assert beyond_equations(cartpole) == ["spring (stiffness) in joint 'hinge'"]
    assert differs_from(cartpole) == [
        "limit of joint 'slider' at -1 and 1",
        "limit of joint 'hinge' at -1 and 1",
        "spring (stiffness) in joint 'hinge'",
    ]


@pytest.mark.parametrize("seed", few(range(12), 0, 7))
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
    assert beyond_step(damped) == ["integrator Euler without eulerdamp instead of Euler"]
    assert beyond_step(damped, method_of(damped)) == []
    rubbing = changed(('"Euler"', '"discrete"'), plus(SLIDER, 'frictionloss="1"'))
    assert beyond_step(rubbing, method_of(rubbing)) == [
        "friction that the integrator discrete solves in its own way"
    ]


def test_numbers_that_no_episode_feels():
    assert idle_numbers(load_model()) == []
    unfelt = changed(
        plus(SLIDER, 'range="-2.4 3"'),
        plus(HINGE, 'damping="1" stiffness="2" frictionloss="3"'),
        flag('damper="disable" gravity="disable" spring="disable" frictionloss="disable"'),
    )
    assert idle_numbers(unfelt) == [
        "limit of joint 'slider' at -2.4 and 3",
        "damping of joint 'hinge', switched off by an option flag",
        "stiffness of joint 'hinge', switched off by an option flag",
        "friction loss of joint 'hinge', switched off by an option flag",
        "gravity, switched off by an option flag",
    ]
    assert differs_from(unfelt) == ["gravity 0 instead of 9.8"]
    assert idle_numbers(changed(plus(SLIDER, 'range="-1 1"'))) == []


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
