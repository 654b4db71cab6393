"""Steps of MuJoCo's integrators in closed form, against MuJoCo."""

import numpy as np
import pytest

from mjcartpole.physics.file_steps import METHODS, file_step, method_of
from mjcartpole.physics.load import load_model
from mjcartpole.physics.parameters import read_parameters
from mjcartpole.physics.simulation import Simulation

REFERENCE = load_model("cartpole").xml
MOTOR = '<motor name="push" joint="slider" gear="10"'
MODELS = {
    "plain": {},
    "damped": {"hinge.damping": 0.1, "rail.damping": 1.0},
    "armature and friction": {"rail.friction": 2.0, "hinge.armature": 0.01},
    "tilted": {"option.gravity": "1 2 -9.8", "hinge.damping": 0.1, "joint:hinge.ref": 0.3},
}


def stepped_by(method, edits):
    """The model of an integrator's name, or with `eulerdamp` off."""
    name = method.split()[0]
    text = load_model("cartpole", {**edits, "option.integrator": name}).xml
    if name != method:
        flag = f'integrator="{name}"><flag eulerdamp="disable"/></option>'
        text = text.replace(f'integrator="{name}"/>', flag)
    return text


def check(cartpole, method):
    simulation, p = Simulation(cartpole, "mujoco"), read_parameters(cartpole)
    simulation.model.opt.tolerance = 0.0
    rng = np.random.default_rng(0)
    states = rng.uniform(-1, 1, (100, 4)) * [4.8, 10, np.pi, 10]
    found = simulation.steps(states, np.ones(100))
    np.testing.assert_allclose(
        found, file_step(p, states, p.forces[1], method), rtol=1e-13, atol=1e-13
    )
    assert file_step(p, states[0], p.forces[1], method).shape == (4,)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("method", METHODS)
def test_a_step_is_mujocos(method, model):
    cartpole = load_model(stepped_by(method, MODELS[model]))
    assert method_of(cartpole) == method
    check(cartpole, method)


@pytest.mark.parametrize("method", METHODS)
def test_a_motor_that_feeds_back_its_velocity(method):
    text = stepped_by(method, {"hinge.damping": 0.1})
    assert MOTOR in text
    servo = '<velocity name="push" joint="slider" gear="2" kv="3"'
    check(load_model(text.replace(MOTOR, servo)), method)


def test_discrete_is_implicitfast_where_nothing_constrains():
    cartpole = load_model("cartpole", {"option.integrator": "discrete", "hinge.damping": 0.1})
    assert method_of(cartpole) == "implicitfast"
    check(cartpole, "implicitfast")
