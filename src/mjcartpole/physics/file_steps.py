"""One physics step of a cart-pole by each of MuJoCo's integrators, in closed form.

`Euler` moves positions by the new velocities and brakes these, unless the flag `eulerdamp` is off;
`implicitfast` does the same for a motor's own feedback as well; `implicit` solves for all that
changes with the velocities, what turns included; `RK4` is the classic Runge-Kutta method (MuJoCo's
manual, chapter "Computation", on numerical integration).
"""

import dataclasses

import mujoco
import numpy as np
import numpy.typing as npt

from mjcartpole.physics import equations
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.equations import Array, Parameters, coefficients
from mjcartpole.physics.parameters import is_on

METHODS = ("Euler", "Euler without eulerdamp", "implicitfast", "implicit", "RK4")


def method_of(cartpole: CartPole) -> str:
    """Return by which of `METHODS` a file has itself stepped, or another integrator's own name.

    `discrete` differs from `implicitfast` only in how it solves constraints.
    """
    damps = is_on(cartpole.model, mujoco.mjtDisableBit.mjDSBL_EULERDAMP)
    if cartpole.integrator == "Euler" and not damps:
        return "Euler without eulerdamp"
    return "implicitfast" if cartpole.integrator == "discrete" else cartpole.integrator


def file_step(p: Parameters, state: npt.ArrayLike, force: npt.ArrayLike, method: str) -> Array:
    """Return the state one physics step later by one of `METHODS`, shape (..., 4).

    The force is in N, constant during the step; it broadcasts against the state's leading shape.
    """
    if method == "RK4":
        return equations.rk4_step(p, state, force)
    if method == "Euler":
        return equations.step(p, state, force, "mujoco")
    if method == "Euler without eulerdamp":
        return _moved(p, state, equations.step(p, state, force, "gym"))
    all_implicit = dataclasses.replace(
        p, slider_damping=p.slider_damping + p.motor_damping, motor_damping=0.0
    )
    if method == "implicitfast":
        return equations.step(all_implicit, state, force, "mujoco")
    return _moved(p, state, _implicit(all_implicit, np.asarray(state), np.asarray(force)))


def _implicit(p: Parameters, state: Array, force: Array) -> Array:
    """Return new velocities; what changes with them is taken from the end of the step."""
    h, k = p.timestep, coefficients(p)
    x_dot, theta, theta_dot = state[..., 1], state[..., 2], state[..., 3]
    x_acc, theta_acc = equations.accelerations(p, x_dot, theta, theta_dot, force)
    sin, cos = np.sin(theta), np.cos(theta)
    shared = k.coupling * cos - k.crossing * sin
    push = k.slider_inertia * x_acc + shared * theta_acc
    turn = shared * x_acc + k.hinge_inertia * theta_acc
    slider, hinge = k.slider_inertia + h * k.slider_damping, k.hinge_inertia + h * k.hinge_damping
    # The centrifugal force goes with the square of the pole's velocity.
    swung = shared - 2 * h * (k.coupling * sin + k.crossing * cos) * theta_dot
    determinant = slider * hinge - shared * swung
    after = np.array(np.broadcast_arrays(state, state)[0])
    after[..., 1] = x_dot + h * (hinge * push - swung * turn) / determinant
    after[..., 3] = theta_dot + h * (slider * turn - shared * push) / determinant
    return after


def _moved(p: Parameters, before: npt.ArrayLike, after: Array) -> Array:
    """Return a state whose positions have moved by the new velocities."""
    moved, start = after.copy(), np.asarray(before)
    for place in (0, 2):
        moved[..., place] = start[..., place] + p.timestep * after[..., place + 1]
    return moved
