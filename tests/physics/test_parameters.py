"""Parameters are read from models to the last digit, and what they leave out is named."""

import dataclasses
import math
import re

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjcartpole.errors import ModelError
from mjcartpole.physics.equations import (
    CARTPOLE_V1,
    Parameters,
    accelerations,
    rk4_step,
    step,
    uniform_rod,
)
from mjcartpole.physics.load import load_model, model_names
from mjcartpole.physics.parameters import differences, read_parameters
from mjcartpole.physics.simulation import Simulation
from mjcartpole.physics.unmodelled_effects import beyond_equations, beyond_step
from nightly import at_night, examples

REFERENCE = load_model("cartpole").xml
EPS = np.finfo(float).eps
BOX = np.array([2.4, 10.0, np.pi, 10.0])


def changed(*changes):
    """The reference with changes, each a pattern and its replacement."""
    text = REFERENCE
    for pattern, replacement in changes:
        text, count = re.subn(pattern, replacement, text, count=1, flags=re.DOTALL)
        assert count == 1, pattern
    return load_model(text)


SLIDER, HINGE = '<joint name="slider"', '<joint name="hinge"'


def plus(element, attributes):
    """The change that gives an element more attributes."""
    return element, f"{element} {attributes}"


def build(p, bob="", axis="0 1 0", beam='euler="0 0 0"', motor=""):
    """A model with the parameters of `p`, written to the last digit, and what `bob` adds."""
    return load_model(f"""<mujoco>
      <compiler angle="radian"/>
      <option timestep="{p.timestep!r}" gravity="0 0 {-p.gravity!r}"/>
      <worldbody><body name="table" pos="0.3 -0.2 1.3" {beam}><body name="cart">
        <joint name="slider" type="slide" axis="1 0 0" damping="{p.slider_damping!r}"
               armature="{p.slider_armature!r}"/>
        <inertial pos="0 0 0" mass="{p.cart_mass!r}" diaginertia="0.01 0.01 0.01"/>
        <body name="pole" pos="0 0 0.1">
          <joint name="hinge" type="hinge" axis="{axis}" damping="{p.hinge_damping!r}"
                 armature="{p.hinge_armature!r}"/>
          <inertial pos="0 0 {p.com_distance!r}" mass="{p.pole_mass!r}"
                    diaginertia="{p.inertia!r} {p.inertia!r} {p.inertia!r}"/>
          {bob}
        </body></body></body>
      </worldbody>
      <actuator><motor joint="slider" gear="{p.forces[1]!r}" {motor}/></actuator>
    </mujoco>""")


def random_states(count, seed=0):
    return np.random.default_rng(seed).uniform(-BOX, BOX, (count, 4))


def engine_accelerations(cartpole, state, control):
    model, data = cartpole.model, mujoco.MjData(cartpole.model)
    data.qpos[cartpole.slider], data.qvel[cartpole.slider] = state[:2]
    data.qpos[cartpole.hinges[0]], data.qvel[cartpole.hinges[0]] = state[2:]
    data.ctrl[0] = control
    mujoco.mj_forward(model, data)
    return data.qacc[[cartpole.slider, cartpole.hinges[0]]]


def check_accelerations(cartpole, count=40):
    """MuJoCo and the equations agree over the whole box and beyond it."""
    assert beyond_equations(cartpole) == []
    p = read_parameters(cartpole)
    for index, state in enumerate(random_states(count)):
        action = index % 2
        found = engine_accelerations(cartpole, state, cartpole.controls[action])
        expected = np.array(accelerations(p, *state[1:], p.forces[action]))
        scale = np.abs(expected).max() + 1
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * scale)


def check_steps(cartpole, count=40):
    """One step of the engine is one step of the equations, by both integrators."""
    p = read_parameters(cartpole)
    for integrator in ("gym", "mujoco"):
        simulation = Simulation(cartpole, integrator)
        for index, state in enumerate(random_states(count)):
            action = index % 2
            simulation.state = state
            found = np.array(simulation.step(cartpole.controls[action]))
            expected = step(p, state, p.forces[action], integrator)
            scale = np.maximum(1, np.abs(expected).max())
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13 * scale)


# --- what is read -------------------------------------------------------------------------------


def test_the_reference_is_cartpole_v1():
    cartpole = load_model("cartpole")
    assert read_parameters(cartpole) == CARTPOLE_V1
    assert beyond_equations(cartpole) == beyond_step(cartpole) == []
    assert differences(read_parameters(cartpole), CARTPOLE_V1) == []


def test_the_reference_moves_as_the_equations_say():
    cartpole = load_model("cartpole")
    check_accelerations(cartpole, at_night(500, fast=100))
    check_steps(cartpole, at_night(500, fast=100))


@pytest.mark.parametrize("name", model_names())
def test_every_shipped_model_is_read(name):
    cartpole = load_model(name)
    assert isinstance(beyond_equations(cartpole), list)
    if cartpole.poles == 1:
        assert read_parameters(cartpole).pole_mass > 0
        return
    with pytest.raises(ModelError, match="2 poles, and the equations are those of one"):
        read_parameters(cartpole)


rods = st.builds(
    uniform_rod,
    cart_mass=st.floats(0.1, 20),
    pole_mass=st.floats(0.01, 5),
    length=st.floats(0.1, 5),
    gravity=st.floats(0.5, 25),
    force=st.floats(0.5, 50),
    timestep=st.sampled_from([0.02]),
)
poles = st.builds(
    dataclasses.replace,
    rods,
    inertia=st.floats(0.001, 2),
    slider_damping=st.floats(0, 5, allow_subnormal=False),
    hinge_damping=st.floats(0, 2, allow_subnormal=False),
    slider_armature=st.floats(0, 2, allow_subnormal=False),
    hinge_armature=st.floats(0, 1, allow_subnormal=False),
)


@examples(15)
@given(st.one_of(rods, poles))
def test_parameters_come_back_to_the_last_digit_and_move_the_same(p):
    cartpole = build(p)
    assert read_parameters(cartpole) == p
    check_accelerations(cartpole, 10)
    check_steps(cartpole, 10)


NON_UNIFORM = Parameters(
    cart_mass=0.7,
    pole_mass=0.3,
    com_distance=0.4,
    inertia=0.02,
    gravity=3.7,
    slider_damping=0.8,
    hinge_damping=0.05,
    slider_armature=0.2,
    hinge_armature=0.01,
    forces=(-6.0, 6.0),
)
BOB = """<body name="bob" pos="0 0.05 0.9"><inertial pos="0 0 0.1" mass="0.25"
         diaginertia="0.002 0.003 0.004"/></body>"""


def test_a_bob_on_the_pole_counts_by_the_parallel_axis_theorem():
    p = read_parameters(cartpole := build(NON_UNIFORM, BOB))
    com = (0.3 * 0.4 + 0.25 * 1.0) / 0.55
    assert p.pole_mass == 0.55
    assert p.com_distance == pytest.approx(com, rel=4 * EPS)
    inertia = 0.02 + 0.3 * (0.4 - com) ** 2 + 0.003 + 0.25 * (1.0 - com) ** 2
    assert p.inertia == pytest.approx(inertia, rel=4 * EPS)
    check_accelerations(cartpole)
    check_steps(cartpole)


TURNED = """<body pos="0.2 0 0.5" euler="0 0.7 0"><inertial pos="0.1 0 0.3" mass="0.25"
       euler="0.3 0.5 0.2" diaginertia="0.002 0.003 0.004"/></body>"""


def test_welded_bodies_may_be_turned_and_lie_beside_the_pole():
    x = 0.2 + 0.1 * math.cos(0.7) + 0.3 * math.sin(0.7)
    balance = (
        f'<body><inertial pos="{-x!r} 0 0.2" mass="0.25" diaginertia="1e-3 1e-3 1e-3"/></body>'
    )
    cartpole = build(NON_UNIFORM, TURNED + balance)
    check_accelerations(cartpole)
    check_steps(cartpole)


def test_all_that_slides_and_does_not_turn_is_the_cart():
    extra = '<body name="cargo"><inertial pos="0 0 0" mass="2.5" diaginertia="1 1 1"/></body>'
    cartpole = changed(('<body name="pole">', extra + '<body name="pole">'))
    assert read_parameters(cartpole).cart_mass == 3.5
    check_accelerations(cartpole)


@pytest.mark.parametrize("axis", ["0 -1 0", "0 1 0"])
@pytest.mark.parametrize("euler", ["0 0 0", "0 0 1.5707963267948966", "0 0 2.1"])
def test_axes_may_be_flipped_and_the_track_turned(axis, euler):
    cartpole = build(NON_UNIFORM, BOB, axis=axis, beam=f'euler="{euler}"')
    assert read_parameters(cartpole).hinge_sign == (1 if axis == "0 1 0" else -1)
    check_accelerations(cartpole)
    check_steps(cartpole)


def test_a_flipped_slider_turns_the_lean_too():
    cartpole = changed(('type="slide" axis="1 0 0"', 'type="slide" axis="-1 0 0"'))
    assert read_parameters(cartpole).hinge_sign == -1
    check_accelerations(cartpole)


def test_a_reference_angle_is_allowed_where_the_pole_stands_at_angle_0():
    lying = (
        ('<body name="pole">', f'<body name="pole" euler="0 {math.pi / 2!r} 0">'),
        plus(HINGE, f'ref="{math.pi / 2!r}"'),
        plus(SLIDER, 'ref="0.7"'),
    )
    cartpole = changed(*lying)
    assert differences(read_parameters(cartpole), CARTPOLE_V1) == []
    check_accelerations(cartpole)


def test_a_pole_whose_document_hangs_is_counted_from_upright():
    cartpole = changed(('pos="0 0 0.5" mass', 'pos="0 0 -0.5" mass'))
    assert read_parameters(cartpole).com_distance == pytest.approx(0.5)
    check_accelerations(cartpole)


def test_slider_and_hinge_may_share_a_body():
    cartpole = load_model("""<mujoco><option timestep="0.02"/><worldbody><body>
        <joint name="s" type="slide" axis="1 0 0" armature="1"/><joint type="hinge" axis="0 1 0"/>
        <inertial pos="0 0 0.5" mass="0.1" diaginertia="0.01 0.01 0.01"/>
      </body></worldbody><actuator><motor joint="s"/></actuator></mujoco>""")
    assert read_parameters(cartpole).cart_mass == 0.0
    check_accelerations(cartpole)


def test_a_motors_own_damping_and_armature_act_through_its_gear():
    cartpole = build(NON_UNIFORM, motor='damping="0.03" armature="0.002"')
    p = read_parameters(cartpole)
    assert p.slider_damping == pytest.approx(0.8 + 36 * 0.03)
    assert p.slider_armature == pytest.approx(0.2 + 36 * 0.002)
    check_accelerations(cartpole)
    check_steps(cartpole)


def test_forces_are_gear_times_gain_times_control():
    cartpole = changed(
        (
            '<motor (.*?)gear="10" ctrlrange="-1 1"',
            r'<general \1gear="3" gainprm="2" ctrlrange="-1 4"',
        )
    )
    assert read_parameters(cartpole).forces == (-6.0, 24.0)
    check_accelerations(cartpole)


def test_implicitfast_brakes_as_euler_does():
    fast = ('integrator="Euler"', 'integrator="implicitfast"')
    check_steps(changed(fast, plus(HINGE, 'damping="0.3"'), plus(SLIDER, 'damping="0.5"')))


def test_runge_kutta_is_the_files_too():
    cartpole = changed(('integrator="Euler"', 'integrator="RK4"'), plus(HINGE, 'damping="0.1"'))
    p, simulation = read_parameters(cartpole), Simulation(cartpole, "mujoco")
    for state in random_states(20):
        simulation.state = state
        expected = rk4_step(p, state, 10.0)
        np.testing.assert_allclose(simulation.step(1.0), expected, rtol=1e-13, atol=1e-13)


def test_numbers_beyond_reason_are_a_model_error():
    with pytest.raises(ModelError, match=r"slider damping is -1\.0"):
        read_parameters(changed(plus(SLIDER, 'damping="-1"')))


# --- what differs -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (('mass="0.1"', 'mass="0.1001"'), "pole mass 0.1001 instead of 0.1"),
        (('mass="0.1"', 'mass="0.10000000001"'), "pole mass 0.10000000001 instead of 0.1"),
        (('pos="0 0 0.5" mass', 'pos="0 0 0.5005" mass'), "com distance 0.5005 instead of 0.5"),
        (
            ("0.0083333[0-9]* 0.0083333[0-9]*", "0.00834 0.00834"),
            "inertia 0.00834 instead of 0.00833333",
        ),
        (("0 0 -9.8", "0 0 -9.81"), "gravity 9.81 instead of 9.8"),
        (('timestep="0.02"', 'timestep="0.01"'), "timestep 0.01 instead of 0.02"),
        (plus(HINGE, 'damping="1e-4"'), "hinge damping 0.0001 instead of 0"),
        (plus(SLIDER, 'armature="1e-3"'), "slider armature 0.001 instead of 0"),
        (('axis="0 1 0"', 'axis="0 -1 0"'), "hinge sign -1 instead of 1"),
    ],
)
def test_a_difference_is_said_with_both_numbers(change, said):
    assert differences(read_parameters(changed(change)), CARTPOLE_V1) == [said]


def test_several_differences_stand_in_the_order_of_the_fields():
    p = dataclasses.replace(CARTPOLE_V1, forces=(-10.01, 10.01), cart_mass=2.0)
    assert differences(p, CARTPOLE_V1) == [
        "cart mass 2 instead of 1",
        "force of action 0 -10.01 instead of -10",
        "force of action 1 10.01 instead of 10",
    ]


def test_rounding_is_no_difference_and_the_tolerance_is_the_callers():
    near = dataclasses.replace(CARTPOLE_V1, gravity=np.nextafter(9.8, 10))
    assert differences(near, CARTPOLE_V1) == []
    assert differences(near, CARTPOLE_V1, rtol=0) == ["gravity 9.800000000000002 instead of 9.8"]
