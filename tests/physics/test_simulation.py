"""One control step, against known answers and against MuJoCo itself."""

import copy
import pickle
import re

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjcartpole.errors import ConfigError, SimulationError
from mjcartpole.physics.load import load_model
from mjcartpole.physics.simulation import Simulation, check_sane, stepping_model

CARTPOLE = load_model("cartpole")
states = st.tuples(*(st.floats(-b, b) for b in (2.4, 10.0, np.pi, 10.0)))
controls = st.sampled_from(CARTPOLE.controls)


def accelerations(x_dot, theta, theta_dot, force):
    """Barto, Sutton and Anderson's frictionless cart-pole, written out independently.

    [M + m, m l cos] [x_ddot, theta_ddot] = [F + m l theta_dot^2 sin, m g l sin], with the second
    row divided by nothing: I + m l^2 = 4/3 m l^2.
    """
    cart, pole, half, gravity = 1.0, 0.1, 0.5, 9.8
    sin, cos = np.sin(theta), np.cos(theta)
    mass = np.array([[cart + pole, pole * half * cos], [pole * half * cos, 4 / 3 * pole * half**2]])
    right = np.array([force + pole * half * theta_dot**2 * sin, pole * gravity * half * sin])
    return np.linalg.solve(mass, right)


@given(states, controls)
def test_explicit_euler_moves_positions_by_the_old_velocity(state, control):
    simulation = Simulation(CARTPOLE, "gym")
    simulation.state = state
    x, x_dot, theta, theta_dot = state
    x_acc, theta_acc = accelerations(x_dot, theta, theta_dot, 10.0 * control)
    expected = [
        x + 0.02 * x_dot,
        x_dot + 0.02 * x_acc,
        theta + 0.02 * theta_dot,
        theta_dot + 0.02 * theta_acc,
    ]
    np.testing.assert_allclose(simulation.step(control), expected, rtol=1e-13, atol=1e-13)


@given(states, controls)
def test_the_files_own_euler_moves_positions_by_the_new_velocity(state, control):
    simulation = Simulation(CARTPOLE, "mujoco")
    simulation.state = state
    x, x_dot, theta, theta_dot = state
    x_acc, theta_acc = accelerations(x_dot, theta, theta_dot, 10.0 * control)
    x_dot, theta_dot = x_dot + 0.02 * x_acc, theta_dot + 0.02 * theta_acc
    expected = [x + 0.02 * x_dot, x_dot, theta + 0.02 * theta_dot, theta_dot]
    np.testing.assert_allclose(simulation.step(control), expected, rtol=1e-13, atol=1e-13)


@given(states, controls)
def test_a_step_returns_the_state_that_it_leaves(state, control):
    for integrator in ("gym", "mujoco"):
        simulation = Simulation(CARTPOLE, integrator)
        simulation.state = state
        np.testing.assert_array_equal(simulation.state, state)
        assert simulation.step(control) == tuple(simulation.state)


def test_a_step_depends_on_the_state_alone():
    fresh, used = Simulation(CARTPOLE), Simulation(CARTPOLE)
    for _ in range(50):
        used.step(1.0)
    state = (0.1, -0.2, 0.05, 0.3)
    fresh.state, used.state = state, state
    assert fresh.step(-1.0) == used.step(-1.0)


def test_plain_floats_put_a_state_as_the_setter_does():
    state = (0.1, -0.2, 0.05, 0.3)
    set_, set_state = Simulation(CARTPOLE), Simulation(CARTPOLE)
    set_.state = state
    set_state.set_state(state)
    np.testing.assert_array_equal(set_state.state, state)
    assert set_state.step(1.0) == set_.step(1.0)


def test_nothing_of_the_past_remains_in_a_new_state():
    simulation, data = Simulation(CARTPOLE), Simulation(CARTPOLE).data
    simulation.data.qfrc_applied[:], simulation.data.xfrc_applied[:] = 5.0, 5.0
    simulation.state = (np.nan, 0.0, 0.0, 0.0)
    for _ in range(20):
        simulation.step(1.0)
    simulation.state = np.zeros(4)
    for name in ("time", "ctrl", "qfrc_applied", "xfrc_applied", "qacc", "qacc_warmstart"):
        np.testing.assert_array_equal(getattr(simulation.data, name), getattr(data, name))
    assert not any(warning.number for warning in simulation.data.warning)


def test_mujocos_timers_count_since_the_state_was_set():
    mujoco.set_mjcb_time(None)  # MuJoCo's own clock, which a command in this process has stopped.
    simulation = Simulation(CARTPOLE)
    timer = simulation.data.timer[int(mujoco.mjtTimer.mjTIMER_STEP)]
    simulation.step(1.0)
    simulation.state = np.zeros(4)
    assert (timer.number, timer.duration) == (0, 0.0)
    for _ in range(3):
        simulation.step(1.0)
    assert timer.number == 3
    assert timer.duration > 0


def variant(pattern, replacement):
    text, count = re.subn(pattern, replacement, CARTPOLE.xml, count=1)
    assert count == 1
    return load_model(text)


def test_substeps_fill_the_control_step():
    fine = variant('timestep="0.02"', 'timestep="0.0002"')
    coarse, exact = Simulation(fine, "gym"), Simulation(fine, "mujoco")
    coarse.state = exact.state = (0.0, 0.5, 0.1, -0.5)
    assert fine.substeps == 100
    # Two first-order methods with the same small step agree to that order, and not better.
    difference = np.abs(np.subtract(coarse.step(1.0), exact.step(1.0))).max()
    assert 1e-8 < difference < 1e-4
    assert coarse.data.time == pytest.approx(0.02)


def test_the_files_own_integrator_is_used():
    runge_kutta = Simulation(variant('integrator="Euler"', 'integrator="RK4"'), "mujoco")
    euler = Simulation(CARTPOLE, "mujoco")
    runge_kutta.state = euler.state = (0.0, 0.5, 0.1, -0.5)
    assert 1e-5 < abs(runge_kutta.step(1.0)[2] - euler.step(1.0)[2]) < 1e-2


@pytest.mark.parametrize("name", ["RK4", "implicit", "implicitfast"])
def test_explicit_euler_does_not_depend_on_the_files_integrator(name):
    other = Simulation(variant('integrator="Euler"', f'integrator="{name}"'), "gym")
    euler = Simulation(CARTPOLE, "gym")
    other.state = euler.state = (0.0, 0.5, 0.1, -0.5)
    assert other.step(1.0) == euler.step(1.0)


def test_damping_acts_and_is_explicit_under_explicit_euler():
    damped = Simulation(variant('<joint damping="0"', '<joint damping="0.5"'), "gym")
    free = Simulation(CARTPOLE, "gym")
    damped.state = free.state = (0.0, 2.0, 0.0, 0.0)
    # Upright and at rest, the pole adds (4/3 - m/(M+m))/(4/3) of its share: solve for the cart.
    mass = 1.1 - 0.1 / (4 / 3)
    difference = damped.step(1.0)[1] - free.step(1.0)[1]
    assert difference == pytest.approx(-0.02 * 0.5 * 2.0 / mass, rel=1e-12)


def test_the_shared_model_is_not_changed():
    before = CARTPOLE.model.opt.disableflags
    Simulation(CARTPOLE, "gym").step(1.0)
    assert CARTPOLE.model.opt.disableflags == before


def test_an_unknown_integrator_is_refused():
    with pytest.raises(ConfigError, match="'euler' is unknown; available: gym, mujoco"):
        Simulation(CARTPOLE, "euler")


def test_a_state_has_four_values():
    with pytest.raises(ConfigError, match="4 values"):
        Simulation(CARTPOLE).state = (0.0, 0.0)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e11])
@pytest.mark.parametrize("place", range(4))
def test_a_diverged_state_is_refused(bad, place):
    state = [0.0] * 4
    check_sane(tuple(state), "x")
    state[place] = bad
    with pytest.raises(SimulationError, match="diverged"):
        check_sane(tuple(state), "x")


def test_a_bad_state_does_not_start_over_in_silence():
    simulation = Simulation(CARTPOLE, "mujoco")
    simulation.state = (0.0, np.nan, 0.1, 0.0)
    assert np.isnan(simulation.step(1.0)[1])


CONTACT = int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
CONSTRAINT = int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)


GEOMS = '<geom contype="0" conaffinity="0" mass="0"/>'
JOINTS = '<joint damping="0" frictionloss="0" armature="0"/>'
SLIDER = '<joint name="slider" type="slide" axis="1 0 0"/>'


@pytest.mark.parametrize(
    "original, edited, off",
    [
        ("", "", CONTACT | CONSTRAINT),
        (GEOMS, '<geom contype="1" conaffinity="0" mass="0"/>', CONTACT | CONSTRAINT),
        (GEOMS, '<geom contype="1" conaffinity="1" mass="0"/>', 0),
        (JOINTS, '<joint damping="0" frictionloss="0.1" armature="0"/>', CONTACT),
        (SLIDER, '<joint name="slider" type="slide" axis="1 0 0" range="-2 2"/>', CONTACT),
        ("</mujoco>", '<contact><pair geom1="rail" geom2="pole"/></contact></mujoco>', 0),
        (
            "</mujoco>",
            '<equality><joint joint1="hinge" active="false"/></equality></mujoco>',
            CONTACT,
        ),
    ],
)
def test_only_work_that_can_have_no_effect_is_left_out(original, edited, off):
    assert original in CARTPOLE.xml
    model = load_model(CARTPOLE.xml.replace(original, edited) if original else CARTPOLE.xml).model
    stepped = stepping_model(model, "mujoco")
    assert stepped.opt.disableflags & (CONTACT | CONSTRAINT) == off
    assert model.opt.disableflags == CARTPOLE.model.opt.disableflags
    _assert_same_motion(model, stepped)


def _assert_same_motion(model, stepped):
    """MuJoCo's own step of the model as it was compiled gives the same bits."""
    one, other = mujoco.MjData(model), mujoco.MjData(stepped)
    for data in (one, other):
        data.qpos[:], data.qvel[:] = (0.3, 0.1), (1.5, -0.4)
    for step in range(400):
        one.ctrl[0] = other.ctrl[0] = 1.0 if step % 7 < 4 else -1.0
        mujoco.mj_step(model, one)
        mujoco.mj_step(stepped, other)
        np.testing.assert_array_equal(one.qpos, other.qpos)
        np.testing.assert_array_equal(one.qvel, other.qvel)


@pytest.mark.parametrize("integrator", ["gym", "mujoco"])
@pytest.mark.parametrize("name", ["cartpole", "twopoles", "friction", "stops"])
@pytest.mark.parametrize(
    "copied", [copy.copy, copy.deepcopy, lambda simulation: pickle.loads(pickle.dumps(simulation))]
)
def test_a_copy_goes_on_bit_equal_and_alone(name, integrator, copied):
    cartpole = load_model(name)
    simulation = Simulation(cartpole, integrator)
    simulation.set_state([0.1] * simulation.size)
    for turn in range(40):
        simulation.step(cartpole.controls[turn % 2])
    simulation.model.opt.gravity[2] += 1.0
    before, other = simulation.state, copied(simulation)
    ahead = [other.step(cartpole.controls[turn % 3 == 0]) for turn in range(60)]
    np.testing.assert_array_equal(simulation.state, before)
    assert ahead == [simulation.step(cartpole.controls[turn % 3 == 0]) for turn in range(60)]
