"""The equations, against gymnasium, against mechanics from first principles, and against time."""

import dataclasses

import numba
import numpy as np
import pytest
from gymnasium.envs.classic_control import CartPoleEnv
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from mjcartpole.errors import ConfigError
from mjcartpole.physics.equations import (
    CARTPOLE_V1,
    Parameters,
    accelerations,
    coefficients,
    derivative,
    energy,
    rk4_step,
    solve,
    step,
    uniform_rod,
)

EPS = np.finfo(float).eps
BOX = np.array([2.4, 10.0, np.pi, 10.0])

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


def random_states(count, seed=0):
    return np.random.default_rng(seed).uniform(-BOX, BOX, (count, 4))


# --- gymnasium ----------------------------------------------------------------------------------


def gymnasium_step(env, state, action):
    env.state, env.steps_beyond_terminated = state, None
    env.step(action)
    return env.state


@pytest.mark.parametrize(("theirs", "ours"), [("euler", "gym"), ("semi-implicit", "mujoco")])
@pytest.mark.parametrize(
    "rod", [{}, {"pole_mass": 0.9, "length": 2.6, "gravity": 1.6, "force": 4.0, "cart_mass": 0.3}]
)
def test_a_uniform_rod_steps_as_gymnasium_does(theirs, ours, rod):
    p, env = uniform_rod(**rod), CartPoleEnv()
    env.reset(seed=0)
    env.kinematics_integrator, env.tau = theirs, p.timestep
    env.masspole, env.length, env.gravity = p.pole_mass, p.com_distance, p.gravity
    env.force_mag = p.forces[1]
    env.total_mass = p.pole_mass + p.cart_mass
    env.polemass_length = p.pole_mass * p.com_distance
    states = random_states(500)
    for action in (0, 1):
        expected = np.array([gymnasium_step(env, state, action) for state in states])
        error = np.abs(step(p, states, p.forces[action], ours) - expected)
        assert (error <= 4 * EPS * np.maximum(1, np.abs(expected))).all()


def test_cartpole_v1_has_gymnasiums_numbers():
    env, p = CartPoleEnv(), CARTPOLE_V1
    assert (p.cart_mass, p.pole_mass, p.com_distance) == (env.masscart, env.masspole, env.length)
    assert (p.gravity, p.timestep) == (env.gravity, env.tau)
    assert p.forces == (-env.force_mag, env.force_mag)
    assert p.inertia == 0.008333333333333333


# --- first principles ---------------------------------------------------------------------------


def taylor(path, order=2, radius=0.1, points=32):
    """Coefficients of `path(t)` around t = 0 by Cauchy's integral formula on a circle."""
    circle = radius * np.exp(2j * np.pi * np.arange(points) / points)
    values = np.array([path(t) for t in circle])
    return [np.tensordot(circle**-k, values, 1).real / points for k in range(order + 1)]


motions = st.tuples(*(st.floats(-b, b) for b in BOX))


@st.composite
def particle_poles(draw):
    """Masses and places of particles on a line through the hinge, and what they amount to."""
    count = draw(st.integers(2, 4))
    masses = np.array(draw(st.lists(st.floats(0.05, 2.0), min_size=count, max_size=count)))
    gaps = draw(st.lists(st.floats(0.2, 1.0), min_size=count, max_size=count))
    places = np.cumsum(gaps) - draw(st.floats(0.0, 1.0))
    com = masses @ places / masses.sum()
    names = ("slider_damping", "hinge_damping", "slider_armature", "hinge_armature")
    return (
        masses,
        places,
        Parameters(
            cart_mass=draw(st.floats(0.2, 3.0)),
            pole_mass=float(masses.sum()),
            com_distance=float(com),
            inertia=float(masses @ (places - com) ** 2),
            gravity=draw(st.floats(-5.0, 25.0)),
            hinge_sign=draw(st.sampled_from([-1, 1])),
            **{name: draw(st.floats(0.0, 2.0)) for name in names},
        ),
    )


def virtual_work(masses, places, p, motion, force):
    """Accelerations by d'Alembert's principle on particles: no energy, no mass matrix by hand.

    Every virtual displacement does no work against sum_i m_i (a_i - g): the particles' positions
    as functions of (x, theta), their first and second derivatives taken numerically.
    """
    x, x_dot, theta, theta_dot = motion
    all_masses = np.array([p.cart_mass, *masses])

    def positions(x, theta):
        cart = np.array([[x, 0 * theta]])
        tips = [[x + p.hinge_sign * r * np.sin(theta), r * np.cos(theta)] for r in places]
        return np.concatenate([cart, np.array(tips)])

    along_x = taylor(lambda t: positions(x + t, theta))[1]
    along_theta = taylor(lambda t: positions(x, theta + t))[1]
    convective = 2 * taylor(lambda t: positions(x + t * x_dot, theta + t * theta_dot))[2]
    jacobian = np.stack([along_x, along_theta], axis=-1)
    weight = np.array([0.0, -p.gravity])
    mass = np.einsum("p,pci,pcj->ij", all_masses, jacobian, jacobian)
    right = np.einsum("p,pci,pc->i", all_masses, jacobian, weight - convective)
    mass += np.diag([p.slider_armature, p.hinge_armature])
    right += [force - p.slider_damping * x_dot, -p.hinge_damping * theta_dot]
    return np.linalg.solve(mass, right)


@given(particle_poles(), motions, st.floats(-20.0, 20.0))
def test_accelerations_obey_dalembert(pole, motion, force):
    masses, places, p = pole
    expected = virtual_work(masses, places, p, motion, force)
    scale = np.abs(expected).max() + 100
    np.testing.assert_allclose(accelerations(p, *motion[1:], force), expected, atol=1e-12 * scale)


def test_the_hanging_pole_swings_at_the_textbook_frequency():
    # The cart is so heavy that the pole is a compound pendulum: omega^2 = m g l / (I + m l^2).
    p = uniform_rod(cart_mass=1e12, length=0.8)
    small = 1e-6
    _, theta_acc = accelerations(p, 0.0, np.pi - small, 0.0, 0.0)
    assert theta_acc / small == pytest.approx(9.8 / (4 / 3 * 0.4), rel=1e-6)


def test_a_pole_without_a_lever_leaves_the_cart_alone():
    p = dataclasses.replace(CARTPOLE_V1, com_distance=0.0)
    assert accelerations(p, 3.0, 1.0, 5.0, 2.2) == (2.2 / 1.1, 0.0)


# --- energy -------------------------------------------------------------------------------------


@pytest.mark.parametrize("p", [CARTPOLE_V1, DAMPED], ids=["CartPole-v1", "damped"])
def test_energy_changes_by_the_work_of_push_and_damping(p):
    states, push = random_states(200), 7.0
    by_complex_step = np.zeros(200)
    for axis in range(4):
        moved = states.astype(complex)
        moved[:, axis] += 1e-30j
        by_complex_step += energy(p, moved).imag / 1e-30 * derivative(p, states, push)[:, axis]
    x_dot, theta_dot = states[:, 1], states[:, 3]
    power = push * x_dot - p.slider_damping * x_dot**2 - p.hinge_damping * theta_dot**2
    np.testing.assert_allclose(by_complex_step, power, atol=1e-10)


def test_energy_stays_along_a_free_fall():
    start = [0.0, 0.3, 0.05, -0.2]
    fall = solve_ivp(
        lambda _, state: derivative(CARTPOLE_V1, state, 0.0),
        (0.0, 3.0),
        start,
        method="DOP853",
        rtol=1e-12,
        atol=1e-13,
    )
    along = energy(CARTPOLE_V1, fall.y.T)
    assert np.ptp(fall.y[2]) > 5  # it fell, swung through and rose again
    assert np.ptp(along) < 1e-10


def test_energy_of_a_known_state():
    # Upright at rest: m g l. Both parts at 1 m/s and no rotation: half of all mass.
    assert energy(CARTPOLE_V1, [5.0, 0.0, 0.0, 0.0]) == pytest.approx(0.1 * 9.8 * 0.5)
    assert energy(CARTPOLE_V1, [5.0, 1.0, np.pi / 2, 0.0]) == pytest.approx(0.55)


# --- steps --------------------------------------------------------------------------------------


@pytest.mark.parametrize(("method", "order"), [("gym", 1), ("mujoco", 1), ("rk4", 4)])
def test_the_order_of_convergence(method, order):
    start, push, end = np.array([0.1, 0.5, 0.3, -1.0]), 5.0, 0.4
    exact = solve_ivp(
        lambda _, s: derivative(DAMPED, s, push), (0, end), start, "DOP853", rtol=1e-13, atol=1e-13
    ).y[:, -1]
    errors = []
    for count in (40, 80):
        state = start
        for _ in range(count):
            if method == "rk4":
                state = rk4_step(DAMPED, state, push, end / count)
            else:
                state = step(DAMPED, state, push, method, end / count)
        errors.append(np.abs(state - exact).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.1)


def test_implicit_damping_brakes_the_new_velocity():
    p, (x, x_dot, theta, theta_dot) = DAMPED, (0.1, 2.0, 0.4, -3.0)
    new = step(p, [x, x_dot, theta, theta_dot], 5.0, "mujoco")
    # By its definition: without damping, but pushed by the damping of the velocities to come.
    free = dataclasses.replace(p, slider_damping=0.0, hinge_damping=0.0)
    k, h = coefficients(free), p.timestep
    mass = np.array([[k.slider_inertia, k.coupling * np.cos(theta)]] * 2)
    mass[1] = mass[0, 1], k.hinge_inertia
    acc = np.array(accelerations(free, x_dot, theta, theta_dot, 5.0))
    braked = acc + np.linalg.solve(mass, -np.array([0.8, 0.05]) * new[1::2])
    np.testing.assert_allclose(new[1::2], [x_dot, theta_dot] + h * braked, rtol=1e-13)
    np.testing.assert_allclose(new[::2], [x, theta] + h * new[1::2], rtol=1e-15)


@pytest.mark.parametrize("integrator", ["gym", "mujoco"])
def test_one_state_and_many_give_the_same_bits(integrator):
    states = random_states(24)
    forces = np.linspace(-10, 10, 24)
    many = step(DAMPED, states.reshape(2, 3, 4, 4), forces.reshape(2, 3, 4), integrator)
    one_by_one = [step(DAMPED, *pair, integrator) for pair in zip(states, forces, strict=True)]
    np.testing.assert_array_equal(many.reshape(24, 4), one_by_one)
    along = energy(DAMPED, states)
    assert along.shape == (24,)
    assert along.tolist() == [float(energy(DAMPED, state)) for state in states]
    assert rk4_step(DAMPED, states, forces).shape == (24, 4)


def test_one_state_under_many_forces():
    assert step(DAMPED, np.zeros(4), np.array([-1.0, 0.0, 1.0])).shape == (3, 4)


def test_numba_compiles_the_same_lines_to_the_same_bits():
    compiled, k = numba.njit(solve), coefficients(DAMPED)
    for _, x_dot, theta, theta_dot in random_states(50):
        expected = solve(k, x_dot, theta, theta_dot, 3.0)
        assert compiled(k, x_dot, theta, theta_dot, 3.0) == expected


# --- mistakes -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"pole_mass": 0.0}, "pole mass is 0.0; it must be more than 0"),
        ({"cart_mass": -1.0}, "cart mass is -1.0"),
        ({"gravity": np.nan}, "gravity is nan; it must be finite"),
        ({"hinge_damping": -0.1}, "hinge damping"),
        ({"forces": (0.0, np.inf)}, "forces"),
        ({"timestep": 0.0}, "timestep"),
        ({"hinge_sign": 0}, "hinge sign is 0; it must be 1 or -1"),
    ],
)
def test_numbers_that_no_cart_pole_has(change, reason):
    with pytest.raises(ConfigError, match=reason):
        dataclasses.replace(CARTPOLE_V1, **change)


def test_a_state_has_four_values_and_an_integrator_exists():
    with pytest.raises(ConfigError, match=r"4 values.*\(3,\)"):
        step(CARTPOLE_V1, np.zeros(3), 0.0)
    with pytest.raises(ConfigError, match="'rk4' is unknown"):
        step(CARTPOLE_V1, np.zeros(4), 0.0, "rk4")
