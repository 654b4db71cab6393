"""Dry friction, against MuJoCo's own solver and by hand."""

import numpy as np
import pytest

from mjcartpole.errors import ConfigError
from mjcartpole.physics.dry_friction import DryFriction, friction_forces
from mjcartpole.physics.equations import accelerations
from mjcartpole.physics.load import load_model
from mjcartpole.physics.parameters import read_parameters
from mjcartpole.physics.simulation import Simulation

FREE = 0.0, 0.0
FRICTION = DryFriction(loss=2.0, softness=0.1, rate=50.0)


def slider_alone(velocity, smooth, mass=1.0):
    """The friction of a cart of so many kilograms; the hinge is not coupled to it."""
    force, torque = friction_forces(
        (FRICTION, None), (mass, 0.0, 1.0), (velocity, 0.0), (smooth, 0.0)
    )
    assert torque == 0
    return float(force)


def test_a_sliding_joint_is_braked_by_the_whole_loss():
    assert slider_alone(1.0, 0.0) == -2.0
    assert slider_alone(-1.0, 0.0) == 2.0
    assert slider_alone(0.0, 100.0) == -2.0


def test_a_gripped_joint_creeps():
    # f = -(a + rate v) / softness with a = smooth + f: f = -(smooth + rate v) / (1 + softness).
    assert slider_alone(0.0, 1.5) == pytest.approx(-1.5 / 1.1, rel=1e-14)
    assert slider_alone(0.01, 0.0) == pytest.approx(-0.5 / 1.1, rel=1e-14)
    assert slider_alone(0.0, 0.0) == 0.0


def test_without_friction_there_is_no_force():
    assert friction_forces((None, None), (1.0, 0.2, 0.3), (1.0, 1.0), (1.0, 1.0)) == FREE


LOSSES = [(2.0, 0.0), (0.0, 0.02), (2.0, 0.02), (20.0, 1.0), (1e-3, 1e-6)]


@pytest.mark.parametrize("losses", LOSSES)
@pytest.mark.parametrize("solref", ["0.02 1", "0.1 0.5", "-100 -5"])
def test_accelerations_are_those_of_mujocos_solver(losses, solref):
    edits = {"joint:slider.frictionloss": losses[0], "joint:hinge.frictionloss": losses[1]}
    edits["joint:slider.solreffriction"] = solref
    edits["joint:slider.solimpfriction"] = "0.8 0.95 0.01"
    cartpole = load_model("cartpole", edits)
    p, rng = read_parameters(cartpole), np.random.default_rng(0)
    states = rng.uniform(-1, 1, (200, 4)) * [2.4, 1, 3.1, 1]
    states[:, [1, 3]] *= 10.0 ** rng.uniform(-6, 1, (200, 1))
    controls = rng.choice([-1.0, 0.0, 1.0], 200)
    simulation = Simulation(cartpole)
    simulation.model.opt.tolerance = 0.0
    found = simulation.accelerations(states, controls)
    _, x_dot, theta, theta_dot = states.T
    expected = np.column_stack(accelerations(p, x_dot, theta, theta_dot, 10.0 * controls))
    scale = np.maximum(1.0, np.abs(expected).max(axis=0))
    assert (np.abs(found - expected) / scale).max() < 1e-12


def test_one_state_and_many_agree():
    velocities = np.array([0.0, 1.0, -1e-3])
    many, _ = friction_forces((FRICTION, None), (1.0, 0.0, 1.0), (velocities, 0.0), (0.5, 0.0))
    assert many.tolist() == [slider_alone(velocity, 0.5) for velocity in velocities]


@pytest.mark.parametrize("bad", [(0.0, 1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 1.0, np.nan)])
def test_what_is_no_friction_is_refused(bad):
    with pytest.raises(ConfigError, match="must be finite"):
        DryFriction(*bad)


def test_what_is_switched_off_is_not_read():
    assert read_parameters(load_model()).slider_friction is None
    off = load_model("cartpole", {"rail.friction": 1}).xml.replace(
        'integrator="Euler"/>', 'integrator="Euler"><flag frictionloss="disable"/></option>'
    )
    assert read_parameters(load_model(off)).slider_friction is None
