"""Order and growth of errors."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mjcartpole.physics import equations, linear
from mjcartpole.physics.equations import CARTPOLE_V1
from mjcartpole.physics.load import load_model
from mjcartpole.studies.parity import Subject
from mjcartpole.studies.parity.convergence import _exact, _order_figures, _start
from mjcartpole.studies.parity.rounding import EPS
from mjcartpole.studies.parity.trajectories import predicted_growth


def test_an_order_that_rounding_hides_is_not_measured():
    steep, hidden = ([2.0**-n for n in range(20)], [1e-9, 1e-11])
    assert [figure.value for figure in _order_figures("it", 1, steep)] == [0.0, 1.0]
    (figure,) = _order_figures("it", 4, hidden)
    assert "too small to tell" in figure.name
    assert figure.holds
    assert not _order_figures("it", 1, hidden)[0].holds


def test_a_predicted_error_grows_with_the_spectral_radius():
    bounds = predicted_growth(Subject(load_model("cartpole")), 300)
    rho = linear.spectral_radius(CARTPOLE_V1, "gym")
    assert bounds[0] == pytest.approx(4 * EPS)
    assert bounds[-1] / bounds[-2] == pytest.approx(rho, rel=1e-6)


@pytest.mark.parametrize("edit", ["pole.mass=0.1", "pole.length=0.1", "hinge.damping=2"])
def test_the_reference_is_that_of_dop853(edit):
    subject = Subject(load_model("cartpole", edits=[edit]), "itself")
    duration, exact = _exact(subject)
    p = subject.reference
    expected = solve_ivp(
        lambda _, state: equations.derivative(p, state, p.forces[1]),
        (0.0, duration),
        _start(subject),
        method="DOP853",
        rtol=1e-13,
        atol=1e-13,
    ).y[:, -1]
    assert np.abs(exact - expected).max() < 1e-12
