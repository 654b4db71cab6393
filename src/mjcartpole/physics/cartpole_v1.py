"""CartPole-v1's own step, operation by operation: the same bits as gymnasium's.

The same equations as `equations.py`, solved in another order, so that a compiled loop can stand in
for gymnasium's environment without a digit of difference. A plain function of floats; Numba
compiles it as it is.
"""

import numpy as np

from mjcartpole.task import CONTROL_STEP

_GRAVITY = 9.8
_MASS_POLE = 0.1
_TOTAL_MASS = 0.1 + 1.0
_LENGTH = 0.5
_POLE_MASS_LENGTH = _MASS_POLE * _LENGTH
FORCE = 10.0
"""N, to the left for action 0, to the right for action 1."""


def cartpole_v1_step(
    x: float, x_dot: float, theta: float, theta_dot: float, force: float
) -> tuple[float, float, float, float]:
    """Return the state 0.02 s later, as gymnasium's `CartPoleEnv` computes it by explicit Euler.

    In m, m/s, rad, rad/s; the force pushes the cart along +x, N.
    """
    return cartpole_v1_moved(x, x_dot, theta, theta_dot, force, np.sin(theta), np.cos(theta))


def cartpole_v1_moved(
    x: float, x_dot: float, theta: float, theta_dot: float, force: float, sin: float, cos: float
) -> tuple[float, float, float, float]:
    """Return the same, where sine and cosine of the angle are known."""
    temp = (force + _POLE_MASS_LENGTH * (theta_dot * theta_dot) * sin) / _TOTAL_MASS
    theta_acc = (_GRAVITY * sin - cos * temp) / (
        _LENGTH * (4.0 / 3.0 - _MASS_POLE * (cos * cos) / _TOTAL_MASS)
    )
    x_acc = temp - _POLE_MASS_LENGTH * theta_acc * cos / _TOTAL_MASS
    return (
        x + CONTROL_STEP * x_dot,
        x_dot + CONTROL_STEP * x_acc,
        theta + CONTROL_STEP * theta_dot,
        theta_dot + CONTROL_STEP * theta_acc,
    )
