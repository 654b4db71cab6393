"""Linearisation and steps near rest, against the textbook's matrices and against time."""

import numpy as np
import pytest

from mjcartpole.errors import ConfigError
from mjcartpole.physics.equations import CARTPOLE_V1, Parameters, coefficients, step
from mjcartpole.physics.linear import linearisation, spectral_radius, step_matrix

DAMPED = Parameters(
    cart_mass=0.7,
    pole_mass=0.3,
    com_distance=0.4,
    inertia=0.02,
    gravity=3.7,
    slider_damping=0.8,
    hinge_damping=0.05,
    slider_armature=0.2,
    hinge_armature=0.01,
    hinge_sign=-1,
)


def textbook(p):
    """A and B from mass matrix, damping and weight."""
    k = coefficients(p)
    mass = np.array([[k.slider_inertia, k.coupling], [k.coupling, k.hinge_inertia]])
    right = np.array([[-k.slider_damping, 0, 0, 1], [0, k.weight, -k.hinge_damping, 0]])
    effect = np.linalg.solve(mass, right)
    a = np.zeros((4, 4))
    a[0, 1] = a[2, 3] = 1
    a[1, 1:], a[3, 1:] = effect[:, :3]
    return a, np.array([0, effect[0, 3], 0, effect[1, 3]])


@pytest.mark.parametrize("p", [CARTPOLE_V1, DAMPED], ids=["CartPole-v1", "damped"])
def test_the_linearisation_is_the_textbooks(p):
    a, b = linearisation(p)
    assert (a.shape, b.shape) == ((4, 4), (4, 1))
    for found, expected in zip((a, b[:, 0]), textbook(p), strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize("h", [None, 0.1])
@pytest.mark.parametrize("p", [CARTPOLE_V1, DAMPED], ids=["CartPole-v1", "damped"])
def test_the_step_matrix_of_explicit_euler_is_one_plus_h_a(p, h):
    expected = np.eye(4) + (h or p.timestep) * textbook(p)[0]
    np.testing.assert_allclose(step_matrix(p, "gym", h), expected, rtol=1e-14, atol=1e-14)


def test_a_semi_implicit_step_moves_by_the_new_velocities():
    kick, move = np.eye(4), np.eye(4)
    move[0, 1] = move[2, 3] = 0.02
    kick[1::2] += 0.02 * textbook(CARTPOLE_V1)[0][1::2]
    found = step_matrix(CARTPOLE_V1, "mujoco")
    np.testing.assert_allclose(found, move @ kick, rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize("integrator", ["gym", "mujoco"])
def test_the_step_matrix_anywhere_is_the_steps_slope(integrator):
    state, h = np.array([0.4, -0.3, 0.7, 1.1]), 1e-6
    slopes = [
        (
            step(DAMPED, state + h * axis, 3.0, integrator)
            - step(DAMPED, state - h * axis, 3.0, integrator)
        )
        / (2 * h)
        for axis in np.eye(4)
    ]
    found = step_matrix(DAMPED, integrator, state=state, force=3.0)
    np.testing.assert_allclose(found, np.transpose(slopes), rtol=1e-8, atol=1e-8)


def test_the_spectral_radius_of_cartpole_v1():
    # theta_acc = omega^2 theta with omega^2 = g / (l (4/3 - m / (M + m))): Euler grows by
    # 1 + h omega, the semi-implicit method by the larger root of z^2 - (2 + h^2 omega^2) z + 1.
    h_omega = 0.02 * np.sqrt(9.8 / (0.5 * (4 / 3 - 0.1 / 1.1)))
    assert spectral_radius(CARTPOLE_V1, "gym") == pytest.approx(1 + h_omega, rel=1e-12)
    half = 1 + h_omega**2 / 2
    root = half + np.sqrt(half**2 - 1)
    assert spectral_radius(CARTPOLE_V1, "mujoco") == pytest.approx(root, rel=1e-12)
    assert spectral_radius(CARTPOLE_V1, "gym", 0.001) < spectral_radius(CARTPOLE_V1, "gym")


def test_the_spectral_radius_foretells_how_errors_grow():
    zero, small = np.zeros(4), np.array([0.0, 0.0, 1e-12, 0.0])
    for _ in range(150):
        zero, last = step(CARTPOLE_V1, zero, 0.0), small
        small = step(CARTPOLE_V1, small, 0.0)
    assert small[2] / last[2] == pytest.approx(spectral_radius(CARTPOLE_V1), rel=1e-6)
    assert not zero.any()


def test_an_unknown_integrator_is_refused():
    with pytest.raises(ConfigError, match="rk4"):
        spectral_radius(CARTPOLE_V1, "rk4")
