r"""The cart-pole in closed form, for any planar rigid pole: what the engine is held against.

The state is `(x, x_dot, theta, theta_dot)`: m, m/s, rad, rad/s. Theta is 0 upright. The pole's
centre of mass stands at `(x + s l sin(theta), l cos(theta))`, with `s = 1` where a positive angle
leans to +x. Its kinetic and potential energy, with armatures J_c and J_p,

    T = 1/2 (M + m + J_c) x_dot^2 + s m l cos(theta) x_dot theta_dot
        + 1/2 (I + m l^2 + J_p) theta_dot^2
    V = m g l cos(theta)

give by Lagrange's equations, with the push F and viscous damping b_c, b_p,

    (M + m + J_c) x_acc + s m l cos(theta) theta_acc = F - b_c x_dot + s m l sin(theta) theta_dot^2
    s m l cos(theta) x_acc + (I + m l^2 + J_p) theta_acc = m g l sin(theta) - b_p theta_dot

which Cramer's rule solves. With I = m l^2 / 3, a uniform thin rod of length 2 l, and nothing else,
this is what CartPole-v1 computes: Barto, Sutton and Anderson (1983), doi:10.1109/TSMC.1983.6313077,
without friction; corrected by Florian (2007), "Correct equations for the dynamics of the cart-pole
system", https://coneural.org/florian/papers/05_cart_pole.pdf.

Every function takes one state, shape (4,), or many, shape (..., 4); forces broadcast against the
leading shape. Scalars and arrays pass through the same lines.
"""

import math
from dataclasses import dataclass
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from mjcartpole import task
from mjcartpole.errors import ConfigError
from mjcartpole.integrator import Integrator, check_integrator

Number: TypeAlias = float | npt.NDArray[np.float64]
"""A float or an array of them."""

Array: TypeAlias = npt.NDArray[Any]
"""Floats; complex numbers pass too, so that a derivative can be taken by a complex step."""


@dataclass(frozen=True)
class Parameters:
    """Everything that decides how a cart-pole moves.

    Attributes:
        cart_mass: M, kg: all that slides and does not rotate.
        pole_mass: m, kg: all that rotates.
        com_distance: l, m, from the hinge up to the pole's centre of mass at angle 0; negative
            for a pole that hangs there.
        inertia: I, kg m^2, of the pole about its centre of mass.
        gravity: g, m/s^2, positive downwards.
        slider_damping: b_c, N s/m.
        hinge_damping: b_p, N m s/rad.
        slider_armature: J_c, kg: inertia that resists x_dot and has no weight.
        hinge_armature: J_p, kg m^2: inertia that resists theta_dot and has no weight.
        forces: Push on the cart along +x in N, by action 0 and by action 1.
        timestep: h, s: one physics step.
        hinge_sign: s: 1 if a positive angle leans the pole to +x, -1 if to -x.
    """

    cart_mass: float
    pole_mass: float
    com_distance: float
    inertia: float
    gravity: float
    slider_damping: float = 0.0
    hinge_damping: float = 0.0
    slider_armature: float = 0.0
    hinge_armature: float = 0.0
    forces: tuple[float, float] = (-10.0, 10.0)
    timestep: float = task.CONTROL_STEP
    hinge_sign: int = 1

    def __post_init__(self) -> None:
        """Refuse numbers that no cart-pole has.

        Raises:
            ConfigError: A value is not finite, a mass, inertia, armature or damping is negative,
                the pole or the timestep is nothing, or the sign is neither 1 nor -1.
        """
        for name in ("cart_mass", "inertia", *_FRICTION_AND_ARMATURE):
            _check(name, getattr(self, name), getattr(self, name) >= 0, "0 or more")
        for name in ("pole_mass", "timestep"):
            _check(name, getattr(self, name), getattr(self, name) > 0, "more than 0")
        for name in ("com_distance", "gravity"):
            _check(name, getattr(self, name), True, "finite")
        for force in self.forces:
            _check("forces", force, True, "finite")
        _check("hinge_sign", self.hinge_sign, self.hinge_sign in {-1, 1}, "1 or -1")


_FRICTION_AND_ARMATURE: Final = (
    "slider_damping",
    "hinge_damping",
    "slider_armature",
    "hinge_armature",
)


def _check(name: str, value: float, holds: bool, wanted: str) -> None:
    if not (math.isfinite(value) and holds):
        raise ConfigError(f"{name.replace('_', ' ')} is {value!r}; it must be {wanted}")


def uniform_rod(
    *,
    cart_mass: float = 1.0,
    pole_mass: float = 0.1,
    length: float = 1.0,
    gravity: float = 9.8,
    force: float = 10.0,
    timestep: float = task.CONTROL_STEP,
) -> Parameters:
    """CartPole-v1's kind of cart-pole: a uniform thin rod, no friction. The defaults are its own.

    Args:
        cart_mass: M, kg.
        pole_mass: m, kg.
        length: The whole rod, m; gymnasium's `length` is half of it.
        gravity: g, m/s^2.
        force: N, to either side.
        timestep: h, s.

    Raises:
        ConfigError: A number makes no sense.
    """
    return Parameters(
        cart_mass=cart_mass,
        pole_mass=pole_mass,
        com_distance=length / 2,
        inertia=pole_mass * length**2 / 12,
        gravity=gravity,
        forces=(-force, force),
        timestep=timestep,
    )


CARTPOLE_V1: Final = uniform_rod()
"""The numbers of gymnasium's CartPole-v1."""


class Coefficients(NamedTuple):
    """What the two equations are made of; Numba compiles code that takes it.

    Attributes:
        slider_inertia: M + m + J_c, kg.
        coupling: s m l, kg m.
        hinge_inertia: I + m l^2 + J_p, kg m^2.
        weight: m g l, N m.
        slider_damping: b_c, N s/m.
        hinge_damping: b_p, N m s/rad.
    """

    slider_inertia: float
    coupling: float
    hinge_inertia: float
    weight: float
    slider_damping: float
    hinge_damping: float


def coefficients(p: Parameters, implicit_damping: float = 0.0) -> Coefficients:
    """The coefficients of a cart-pole's two equations.

    Args:
        p: The cart-pole.
        implicit_damping: h, s, when damping shall act on the velocities *after* a step of h:
            (M + h D) v_next = M v + h f, D on the diagonal, is the same as a mass matrix
            M + h D with the damping force of the old velocities. MuJoCo's Euler does that.
    """
    moment = p.pole_mass * p.com_distance
    return Coefficients(
        slider_inertia=p.cart_mass
        + p.pole_mass
        + p.slider_armature
        + implicit_damping * p.slider_damping,
        coupling=p.hinge_sign * moment,
        hinge_inertia=p.inertia
        + moment * p.com_distance
        + p.hinge_armature
        + implicit_damping * p.hinge_damping,
        weight=moment * p.gravity,
        slider_damping=p.slider_damping,
        hinge_damping=p.hinge_damping,
    )


def solve(
    k: Coefficients, x_dot: Number, theta: Number, theta_dot: Number, force: Number
) -> tuple[Number, Number]:
    """Both accelerations, by Cramer's rule (equations and source: see the module).

    Args:
        k: The coefficients.
        x_dot: m/s, any shape that broadcasts with the others.
        theta: rad.
        theta_dot: rad/s.
        force: F, N.

    Returns:
        `(x_acc, theta_acc)`: m/s^2, rad/s^2, of the broadcast shape.
    """
    sin, cos = np.sin(theta), np.cos(theta)
    coupled = k.coupling * cos
    push = force - k.slider_damping * x_dot + k.coupling * sin * theta_dot * theta_dot
    torque = k.weight * sin - k.hinge_damping * theta_dot
    determinant = k.slider_inertia * k.hinge_inertia - coupled * coupled
    x_acc = (k.hinge_inertia * push - coupled * torque) / determinant
    theta_acc = (k.slider_inertia * torque - coupled * push) / determinant
    return x_acc, theta_acc


def accelerations(
    p: Parameters, x_dot: Number, theta: Number, theta_dot: Number, force: Number
) -> tuple[Number, Number]:
    """`(x_acc, theta_acc)` of a cart-pole in m/s^2 and rad/s^2; see `solve` for the arguments."""
    return solve(coefficients(p), x_dot, theta, theta_dot, force)


def energy(p: Parameters, state: npt.ArrayLike) -> Array:
    """Kinetic and potential energy together, J, shape (...,); the pole weighs nothing at the hinge.

    Constant where nothing pushes or brakes.

    Args:
        p: The cart-pole.
        state: Shape (..., 4).
    """
    k = coefficients(p)
    _, x_dot, theta, theta_dot = _split(state)
    cos = np.cos(theta)
    kinetic = (
        0.5 * k.slider_inertia * x_dot * x_dot
        + k.coupling * cos * x_dot * theta_dot
        + 0.5 * k.hinge_inertia * theta_dot * theta_dot
    )
    return np.asarray(kinetic + k.weight * cos)


def derivative(p: Parameters, state: npt.ArrayLike, force: npt.ArrayLike) -> Array:
    """Time derivative of the state, shape (..., 4).

    Args:
        p: The cart-pole.
        state: Shape (..., 4).
        force: F, N; broadcasts against the state's leading shape.
    """
    _, x_dot, theta, theta_dot = _split(state)
    x_acc, theta_acc = accelerations(p, x_dot, theta, theta_dot, np.asarray(force))
    return _join(x_dot, x_acc, theta_dot, theta_acc)


def step(
    p: Parameters,
    state: npt.ArrayLike,
    force: npt.ArrayLike,
    integrator: Integrator = "gym",
    h: float | None = None,
) -> Array:
    """The state one physics step later, shape (..., 4).

    Args:
        p: The cart-pole.
        state: Shape (..., 4).
        force: F, N, constant during the step; broadcasts against the state's leading shape.
        integrator: `gym`: explicit Euler, positions move by the old velocities. `mujoco`: MuJoCo's
            `Euler`, which is semi-implicit: positions move by the new velocities, and damping
            brakes the new ones.
        h: Seconds; the cart-pole's own timestep if None.

    Raises:
        ConfigError: The integrator is unknown.
    """
    check_integrator(integrator)
    h = p.timestep if h is None else h
    x, x_dot, theta, theta_dot = _split(state)
    explicit = integrator == "gym"
    k = coefficients(p, implicit_damping=0.0 if explicit else h)
    x_acc, theta_acc = solve(k, x_dot, theta, theta_dot, np.asarray(force))
    x_dot_next, theta_dot_next = x_dot + h * x_acc, theta_dot + h * theta_acc
    if explicit:
        return _join(x + h * x_dot, x_dot_next, theta + h * theta_dot, theta_dot_next)
    return _join(x + h * x_dot_next, x_dot_next, theta + h * theta_dot_next, theta_dot_next)


def rk4_step(
    p: Parameters, state: npt.ArrayLike, force: npt.ArrayLike, h: float | None = None
) -> Array:
    """The state one step of the classic Runge-Kutta method later, shape (..., 4).

    Args:
        p: The cart-pole.
        state: Shape (..., 4).
        force: F, N, constant during the step; broadcasts against the state's leading shape.
        h: Seconds; the cart-pole's own timestep if None.
    """
    h = p.timestep if h is None else h
    s = np.asarray(state)
    k1 = derivative(p, s, force)
    k2 = derivative(p, s + h / 2 * k1, force)
    k3 = derivative(p, s + h / 2 * k2, force)
    k4 = derivative(p, s + h * k3, force)
    return np.asarray(s + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4))


def linearisation(p: Parameters) -> tuple[Array, Array]:
    """A and B of `state_dot = A state + B force` near rest at angle 0.

    Returns:
        A, shape (4, 4), and B, shape (4, 1); SI units.
    """
    return _linear(coefficients(p))


def _linear(k: Coefficients) -> tuple[Array, Array]:
    mass = np.array([[k.slider_inertia, k.coupling], [k.coupling, k.hinge_inertia]])
    # Columns: what x_dot, theta, theta_dot and the force do to the two right-hand sides.
    right = np.array([[-k.slider_damping, 0.0, 0.0, 1.0], [0.0, k.weight, -k.hinge_damping, 0.0]])
    effect = np.linalg.solve(mass, right)
    a = np.zeros((4, 4))
    a[0, 1] = a[2, 3] = 1.0
    a[1, 1:], a[3, 1:] = effect[:, :3]
    b = np.zeros((4, 1))
    b[1::2, 0] = effect[:, 3]
    return a, b


def step_matrix(p: Parameters, integrator: Integrator = "gym", h: float | None = None) -> Array:
    """Jacobian of one `step` near rest at angle 0, shape (4, 4); see `step` for the arguments.

    Raises:
        ConfigError: The integrator is unknown.
    """
    check_integrator(integrator)
    h = p.timestep if h is None else h
    explicit = integrator == "gym"
    a, _ = _linear(coefficients(p, implicit_damping=0.0 if explicit else h))
    if explicit:
        return np.asarray(np.eye(4) + h * a)
    move, kick = np.eye(4), np.eye(4)
    move[0, 1] = move[2, 3] = h
    kick[1::2] += h * a[1::2]
    return np.asarray(move @ kick)


def spectral_radius(p: Parameters, integrator: Integrator = "gym", h: float | None = None) -> float:
    """How much one step multiplies a small error near rest at angle 0, in the long run.

    The largest absolute eigenvalue of `step_matrix`; see `step` for the arguments. The cart's
    position makes a double eigenvalue 1, so a pole that hangs, where nothing grows, gives 1 to
    about eight digits.

    Raises:
        ConfigError: The integrator is unknown.
    """
    return float(np.abs(np.linalg.eigvals(step_matrix(p, integrator, h))).max())


def _split(state: npt.ArrayLike) -> tuple[Array, Array, Array, Array]:
    """The four columns of states of shape (..., 4)."""
    values = np.asarray(state)
    if values.ndim == 0 or values.shape[-1] != 4:
        raise ConfigError(
            "a state has 4 values (x, x_dot, theta, theta_dot) in its last dimension, "
            f"not the shape {values.shape}"
        )
    return values[..., 0], values[..., 1], values[..., 2], values[..., 3]


def _join(x: Array, x_dot: Number, theta: Array, theta_dot: Number) -> Array:
    return np.stack(np.broadcast_arrays(x, x_dot, theta, theta_dot), axis=-1)
