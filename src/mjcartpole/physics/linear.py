"""The cart-pole's equations near one state: what a small error becomes.

Derivatives are taken by a complex step, `Im f(s + i h) / h`, which has no rounding of its own:
Squire and Trapp (1998), doi:10.1137/S003614459631241X.
"""

from collections.abc import Callable
from typing import Final

import numpy as np
import numpy.typing as npt

from mjcartpole.integrator import Integrator
from mjcartpole.physics.equations import Array, Parameters, derivative, step

_H: Final = 1e-30
_REST: Final = np.zeros(4)


def linearisation(p: Parameters) -> tuple[Array, Array]:
    """Return A, shape (4, 4), and B, shape (4, 1), of `state_dot = A state + B force`; SI units.

    They hold near rest at angle 0.
    """
    by_state = _jacobian(lambda states: derivative(p, states, 0.0), _REST)
    by_force = derivative(p, _REST, np.asarray(1j * _H)).imag / _H
    return by_state, by_force[:, None]


def step_matrix(
    p: Parameters,
    integrator: Integrator = "gym",
    h: float | None = None,
    state: npt.ArrayLike = _REST,
    force: float = 0.0,
) -> Array:
    """Return jacobian of one `equations.step`, shape (4, 4): what it makes of a small error.

    It is taken at a state, shape (4,), and under a force, N; the others are as `step` has them.
    """
    return _jacobian(lambda states: step(p, states, force, integrator, h), np.asarray(state))


def spectral_radius(p: Parameters, integrator: Integrator = "gym", h: float | None = None) -> float:
    """Return how much one step multiplies a small error near rest at angle 0, in the long run.

    The largest absolute eigenvalue of `step_matrix`; see there for the arguments. The cart's
    position makes a double eigenvalue 1, so a pole that hangs, where nothing grows, gives 1 to
    about eight digits.
    """
    return float(np.abs(np.linalg.eigvals(step_matrix(p, integrator, h))).max())


def _jacobian(function: Callable[[Array], Array], state: Array) -> Array:
    """Return the Jacobian of a function of states, shape (4, 4), by a complex step."""
    return np.asarray(function(state + 1j * _H * np.eye(4)).imag.T / _H)
