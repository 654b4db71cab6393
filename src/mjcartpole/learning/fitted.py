"""A cart with a pole, fitted by least squares to steps that were seen, and its own step.

Two models, each a tuple of numbers with a step that Numba compiles as it is. `Rod` has the
equations of any rigid pole on a level rail without friction (see `physics/equations.py`), divided
by what cannot be told apart from outside, so that four unknowns are left:

    x_acc     = push u + coupling (sin(theta) theta_dot^2 - cos(theta) theta_acc)
    theta_acc = weight sin(theta) - leverage cos(theta) x_acc

with u = 1 for a push to the right and -1 for one to the left. Accelerations are what the velocities
change by in a control step of h seconds, and positions move by old and new velocities, mixed. Where
what is seen is noisy, the unknowns stand with what is known best: u exactly, and the large
accelerations that a push makes. `Linear` knows no physics: a state changes by a matrix times
`(x_dot, theta, theta_dot, u)`. Both are odd, as the world is where left and right are alike.
"""

import math
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

Vector: TypeAlias = npt.NDArray[np.float64]
State: TypeAlias = tuple[float, float, float, float]
Row: TypeAlias = tuple[float, float, float, float]

FASTEST: Final = 1e9
"""No value of a state is larger, whatever was fitted: far from 1e10, where physics count as
diverged, and far beyond any limit."""

MOST_COUPLED: Final = 0.99
"""Of coupling times leverage, which is below 1 for any masses: where noise says otherwise."""

LEAST_MISSED: Final = 1e-300
"""Of a sum of squares: a fit may be exact."""


class Seen(NamedTuple):
    """Steps that were seen: states before and after, shape (n, 4), and actions, shape (n,)."""

    before: Vector
    actions: npt.NDArray[np.int64]
    after: Vector


class Rod(NamedTuple):
    """The rod's equations: of a cart of M and a rod of m, l and I about its end under g."""

    push: float
    """F / (M + m), m/s^2."""
    coupling: float
    """m l / (M + m), m."""
    weight: float
    """m g l / I, 1/s^2."""
    leverage: float
    """m l / I, 1/m."""
    newness: float
    """How much of a step is made with the new velocities, from 0 (explicit Euler) to 1."""
    h: float
    """Seconds of a control step."""
    start: float = 0.0
    """Angle at the start of an episode, rad; what is drawn is added."""


class Linear(NamedTuple):
    """What each value changes by in a step, for each unit of `(x_dot, theta, theta_dot, u)`."""

    x: Row
    x_dot: Row
    theta: Row
    theta_dot: Row
    start: float = 0.0
    """As a rod's."""


Fitted: TypeAlias = Rod | Linear


def rod_step(rod: Rod, state: State, action: int) -> State:
    """Return the state one control step later."""
    x, x_dot, theta, theta_dot = state
    sin, cos = np.sin(theta), np.cos(theta)
    push = rod.push if action == 1 else -rod.push
    swing = rod.coupling * sin * (theta_dot * theta_dot - rod.weight * cos)
    x_acc = (push + swing) / (1.0 - rod.coupling * rod.leverage * cos * cos)
    theta_acc = rod.weight * sin - rod.leverage * cos * x_acc
    x_dot_next, theta_dot_next = x_dot + rod.h * x_acc, theta_dot + rod.h * theta_acc
    return (
        bounded(x + rod.h * (x_dot + rod.newness * (x_dot_next - x_dot))),
        bounded(x_dot_next),
        bounded(theta + rod.h * (theta_dot + rod.newness * (theta_dot_next - theta_dot))),
        bounded(theta_dot_next),
    )


def linear_step(linear: Linear, state: State, action: int) -> State:
    """Return the state one control step later."""
    x, x_dot, theta, theta_dot = state
    moved = x_dot, theta, theta_dot, 1.0 if action == 1 else -1.0
    return (
        bounded(x + dot(linear.x, moved)),
        bounded(x_dot + dot(linear.x_dot, moved)),
        bounded(theta + dot(linear.theta, moved)),
        bounded(theta_dot + dot(linear.theta_dot, moved)),
    )


def dot(row: Row, values: Row) -> float:
    """Return the sum of products."""
    return row[0] * values[0] + row[1] * values[1] + row[2] * values[2] + row[3] * values[3]


def bounded(value: float) -> float:
    """Return a value that is not beyond `FASTEST`, nor NaN."""
    if -FASTEST < value < FASTEST:
        return value
    return FASTEST if value > 0 else -FASTEST


def fit_rod(seen: Seen, h: float) -> Rod:
    """Return the rod that steps of h seconds fit best."""
    _, _, theta, theta_dot = seen.before.T
    sin, cos, u = np.sin(theta), np.cos(theta), 2.0 * seen.actions - 1.0
    x_acc, theta_acc = (seen.after - seen.before)[:, 1::2].T / h
    push, coupling = _solve((u, sin * theta_dot**2 - cos * theta_acc), x_acc)
    weight, leverage = _solve((sin, -cos * x_acc), theta_acc)
    # x moved by h (x_dot + newness h x_acc), and so did theta, which may count from -pi to pi.
    x, x_dot = seen.before.T[:2]
    (newness,) = _solve((h * h * x_acc,), seen.after[:, 0] - x - h * x_dot)
    if coupling * leverage > MOST_COUPLED:
        coupling = MOST_COUPLED / leverage
    return Rod(push, coupling, weight, leverage, min(max(newness, 0.0), 1.0), h)


def fit_linear(seen: Seen) -> Linear:
    """Return the linear model that steps fit best, as it is at theta = 0.

    What is of third order is fitted beside it, and left out: else x_dot and theta_dot, almost
    multiples of each other after random pushes, are blamed for it.
    """
    _, x_dot, theta, theta_dot = seen.before.T
    u = 2.0 * seen.actions - 1.0
    columns = x_dot, theta, theta_dot, u, u * theta**2, theta**3, theta * theta_dot**2
    a, b, c, d = (_row(columns, change) for change in (seen.after - seen.before).T)
    return Linear(a, b, c, d)


def _row(columns: tuple[Any, ...], target: Vector) -> Row:
    """Return the weights of the first four columns, fitted beside one or all of the others."""
    few = columns[:5]
    chosen = columns if _criterion(columns, target) < _criterion(few, target) else few
    a, b, c, d, *_ = _solve(chosen, target)
    return a, b, c, d


def _criterion(columns: tuple[Any, ...], target: Vector) -> float:
    """Return Akaike's criterion of a fit, per step: more columns have to be worth their noise.

    Corrected for few steps (Hurvich and Tsai, 1989, doi:10.1093/biomet/76.2.297).
    """
    spare = len(target) - len(columns) - 1
    if spare <= 0:
        return math.inf
    missed = target - np.stack(columns, axis=1) @ _solve(columns, target)
    return math.log(max(float(missed @ missed), LEAST_MISSED)) + 2 * len(columns) / spare


def _solve(columns: tuple[Any, ...], target: Vector) -> list[float]:
    """Return the weights of columns, each of shape (n,), whose sum is next to a target."""
    weights: list[float] = np.linalg.lstsq(np.stack(columns, axis=1), target)[0].tolist()
    return weights
