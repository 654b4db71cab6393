"""Fitted models: known numbers come back, and steps are those of the equations."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjcartpole.learning import stepping
from mjcartpole.learning.fitted import (
    FASTEST,
    Linear,
    Rod,
    Seen,
    bounded,
    fit_linear,
    fit_rod,
    linear_step,
    rod_step,
)
from mjcartpole.physics.equations import CARTPOLE_V1, Parameters, step, uniform_rod
from mjcartpole.physics.linear import step_matrix

positive = st.floats(0.1, 5)


def steps_of(p, n, integrator="gym", seed=0, h=None):
    """Random actions, by the equations."""
    rng, states, actions = np.random.default_rng(seed), [], rng_actions(seed, n)
    states.append(rng.uniform(-0.05, 0.05, 4))
    for action in actions:
        states.append(step(p, states[-1], p.forces[action], integrator, h))
    return Seen(np.array(states[:-1]), np.array(actions), np.array(states[1:]))


def rng_actions(seed, n):
    """Both actions are among three of them."""
    return [seed % 2, 1 - seed % 2, *np.random.default_rng(seed).integers(0, 2, n).tolist()][:n]


def rod_of(p, newness=0.0, h=None):
    """The four numbers by their definitions."""
    mass, moment = p.cart_mass + p.pole_mass, p.pole_mass * p.com_distance
    about_end = p.inertia + moment * p.com_distance
    return Rod(
        push=p.forces[1] / mass,
        coupling=moment / mass,
        weight=moment * p.gravity / about_end,
        leverage=moment / about_end,
        newness=newness,
        h=h or p.timestep,
    )


def test_three_steps_of_the_reference_by_hand():
    # 10 N / 1.1 kg; 0.1 kg 0.5 m / 1.1 kg; 9.8 m/s^2 and 1 over 4/3 of 0.5 m.
    expected = (10 / 1.1, 0.05 / 1.1, 14.7, 1.5, 0.0, 0.02, 0.0)
    assert fit_rod(steps_of(CARTPOLE_V1, 3), 0.02) == pytest.approx(expected, rel=1e-6, abs=1e-9)
    assert rod_of(CARTPOLE_V1) == pytest.approx(expected)


@given(positive, positive, positive, positive, st.floats(2, 30), st.integers(0, 99))
def test_three_steps_tell_any_rod(cart, pole, length, gravity, force, seed):
    p = uniform_rod(
        cart_mass=cart, pole_mass=pole, length=length, gravity=gravity, force=force, timestep=0.01
    )
    found, expected = fit_rod(steps_of(p, 3, seed=seed), 0.01), rod_of(p)
    assert found == pytest.approx(expected, rel=1e-3, abs=1e-5)


def test_any_rigid_pole_is_one_however_its_mass_is_spread():
    p = Parameters(0.7, 0.3, com_distance=0.4, inertia=0.09, gravity=3.7, forces=(-4.0, 4.0))
    for integrator, newness in (("gym", 0.0), ("mujoco", 1.0)):
        found = fit_rod(steps_of(p, 8, integrator), 0.02)
        assert found == pytest.approx(rod_of(p, newness), rel=1e-7, abs=1e-7)


@pytest.mark.parametrize(("integrator", "newness"), [("gym", 0.0), ("mujoco", 1.0)])
@given(st.tuples(*[st.floats(-1.2, 1.2)] * 4), st.integers(0, 1))
def test_a_rods_step_is_that_of_the_equations(integrator, newness, state, action):
    p = uniform_rod(cart_mass=0.8, pole_mass=0.5, length=1.7, force=7.0)
    expected = step(p, state, p.forces[action], integrator)
    assert rod_step(rod_of(p, newness), state, action) == pytest.approx(expected, abs=1e-12)


def test_a_rod_near_what_was_seen_is_that_which_misses_least():
    rng = np.random.default_rng(3)
    exact = steps_of(CARTPOLE_V1, 12)
    seen = exact._replace(after=exact.after + 0.004 * rng.standard_normal((12, 4)))
    rod, (_, v, theta, w), u = fit_rod(seen, 0.02), seen.before.T, 2 * seen.actions - 1
    x_acc, theta_acc = (seen.after[:, 1] - v) / 0.02, (seen.after[:, 3] - w) / 0.02

    def missed(push, coupling, weight, leverage):
        by_cart = push * u + coupling * (np.sin(theta) * w**2 - np.cos(theta) * theta_acc) - x_acc
        by_pole = weight * np.sin(theta) - leverage * np.cos(theta) * x_acc - theta_acc
        return by_cart @ by_cart, by_pole @ by_pole

    least = missed(*rod[:4])
    for place in range(4):
        for change in (0.999, 1.001):
            other = [*rod[:4]]
            other[place] *= change
            assert all(a >= b for a, b in zip(missed(*other), least, strict=True))
    assert 0 <= rod.newness <= 1


def test_no_noise_makes_a_rod_without_a_mass_matrix():
    # Accelerations of opposite signs, as if each were the other's.
    before = np.zeros((4, 4))
    after = np.array([[0, 1, 0, -3], [0, -1, 0, 3], [0, 3, 0, -1], [0, -3, 0, 1]], float)
    rod = fit_rod(Seen(before, np.array([1, 0, 1, 0]), after), 1.0)
    assert rod.coupling * rod.leverage <= 0.99 + 1e-12
    assert all(map(math.isfinite, rod))


MATRIX = np.array(
    [[0.02, 0, 0.001, 0.1], [0.3, -0.2, 0.1, 0.19], [0, 0.5, 0.02, 0], [-0.1, 0.3, 0.2, -0.3]]
)


def test_a_linear_world_comes_back():
    rng, n = np.random.default_rng(1), 9
    before, actions = rng.normal(size=(n, 4)), rng_actions(1, n)
    moved = np.column_stack([before[:, 1:], 2 * np.array(actions) - 1])
    seen = Seen(before, np.array(actions), before + moved @ MATRIX.T)
    linear = fit_linear(seen)
    np.testing.assert_allclose(linear[:4], MATRIX, atol=1e-12)
    for row in range(n):
        found = linear_step(linear, tuple(before[row].tolist()), actions[row])
        assert found == pytest.approx(seen.after[row].tolist(), abs=1e-9)


@pytest.mark.parametrize("bend", [[1, 0, 0], [0.3, -0.5, 0.7]])
def test_what_is_of_third_order_is_not_laid_to_the_velocities(bend):
    rng, n = np.random.default_rng(2), 12
    before, actions = rng.normal(size=(n, 4)), np.array(rng_actions(2, n))
    (_, _, theta, theta_dot), u = before.T, 2 * actions - 1
    moved = np.column_stack([before[:, 1:], u])
    bends = bend @ np.array([u * theta**2, theta**3, theta * theta_dot**2])
    bent = np.outer(bends, [0.0, 0.1, 0.0, 0.2])
    linear = fit_linear(Seen(before, actions, before + moved @ MATRIX.T + bent))
    np.testing.assert_allclose(linear[:4], MATRIX, atol=1e-12)


def test_columns_that_only_take_up_noise_are_left_out():
    rng, n = np.random.default_rng(4), 25
    before, actions = 0.1 * rng.normal(size=(n, 4)), np.array(rng_actions(4, n))
    u = 2 * actions - 1
    moved = np.column_stack([before[:, 1:], u])
    after = before + moved @ MATRIX.T + 0.001 * rng.normal(size=(n, 4))
    columns = np.column_stack([moved, u * before[:, 2] ** 2])
    few = np.linalg.lstsq(columns, after - before)[0][:4].T
    np.testing.assert_allclose(fit_linear(Seen(before, actions, after))[:4], few, atol=1e-12)


def test_a_linear_model_of_the_reference_is_its_tangent():
    found = np.array(fit_linear(steps_of(CARTPOLE_V1, 25))[:4])
    tangent = step_matrix(CARTPOLE_V1)[:, 1:] - np.eye(4)[:, 1:]
    # Of fifth order and more is what is left: 0.05 without the terms of third order.
    np.testing.assert_allclose(found[:, :3], tangent, atol=2e-3)
    np.testing.assert_allclose(found[:, 3], [0, 0.2 / 1.1 / (1 - 0.75 / 11), 0, -0.2927], atol=1e-4)


@pytest.mark.parametrize("action", [0, 1])
def test_no_model_leaves_what_physics_call_sane(action):
    wild = Linear((1e9, 0, 0, 0), (9e9, 0, 0, 0), (0, 0, 0, 1e30), (0, 0, 9e9, 0))
    rod = Rod(1e30, 0.9, 1e30, 1.1, 0.5, 0.02)
    for advance, model in ((linear_step, wild), (rod_step, rod)):
        state = (0.1, -0.2, 0.3, 0.4)
        for _ in range(50):
            state = advance(model, state, action)
            assert max(map(abs, state)) <= FASTEST


@pytest.mark.parametrize(
    ("advance", "model"),
    [
        (rod_step, Rod(9.1, 0.05, 14.7, 1.5, 0.3, 0.02)),
        (linear_step, Linear(*map(tuple, MATRIX.tolist()))),
    ],
)
def test_a_compiled_step_has_the_same_bits(advance, model):
    rng = np.random.default_rng(5)
    fast = getattr(stepping, f"_{advance.__name__}")
    for state in rng.normal(scale=[1, 1, 0.2, 1], size=(200, 4)).tolist():
        action = int(rng.integers(2))
        expected = [float(x).hex() for x in advance(model, tuple(state), action)]
        assert [x.hex() for x in fast(model, tuple(state), action)] == expected


def test_a_bound_is_one_to_both_sides():
    assert [bounded(x) for x in (-2e9, -1.0, 0.0, 3.0, math.inf)] == [-FASTEST, -1, 0, 3, FASTEST]
    assert bounded(math.nan) == -FASTEST
