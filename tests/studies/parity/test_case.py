"""What gymnasium's formula can and cannot express."""

import dataclasses

import gymnasium
import numpy as np
import pytest

from mjcartpole.physics import equations
from mjcartpole.physics.equations import CARTPOLE_V1, uniform_rod
from mjcartpole.physics.load import load_model
from mjcartpole.studies.parity import Subject
from mjcartpole.studies.parity.case import Batch, set_parameters, why_not_gymnasiums
from mjcartpole.studies.parity.dynamics import gym_steps
from mjcartpole.studies.parity.rounding import EPS
from parity_cases import changed


def test_gymnasiums_trap():
    """Setting `masscart` alone changes nothing there; set_parameters changes the right thing."""
    state, action = np.array([0.0, 0.1, 0.05, -0.1]), np.array([1])
    batch = Batch(state[None, :], action)
    untouched, trapped, right = (gymnasium.make("CartPole-v1") for _ in range(3))
    trapped.unwrapped.masscart = 2.0
    heavy = uniform_rod(cart_mass=2.0)
    set_parameters(right, heavy)
    as_it_is = gym_steps(untouched, batch)
    assert gym_steps(trapped, batch).tolist() == as_it_is.tolist()
    expected = equations.step(heavy, state, heavy.forces[1], "gym")
    np.testing.assert_allclose(gym_steps(right, batch)[0], expected, rtol=0, atol=4 * EPS)
    assert gym_steps(right, batch)[0, 1] < 0.6 * as_it_is[0, 1] + 0.05
    ours = load_model(changed(('mass="1.0"', 'mass="2.0"')))
    moved = Subject(ours, "itself").simulation("gym").steps(batch.states, np.array([1.0]))
    np.testing.assert_allclose(moved[0], expected, rtol=0, atol=4 * EPS)


def test_what_gymnasiums_formula_cannot_express_is_refused():
    env = gymnasium.make("CartPole-v1")
    for changes in (
        {"inertia": 0.01},
        {"hinge_damping": 0.1},
        {"slider_armature": 0.1},
        {"hinge_sign": -1},
        {"forces": (-9.0, 10.0)},
    ):
        other = dataclasses.replace(CARTPOLE_V1, **changes)
        assert why_not_gymnasiums(other)
        with pytest.raises(ValueError, match="cannot express"):
            set_parameters(env, other)
    assert why_not_gymnasiums(CARTPOLE_V1) == ""
