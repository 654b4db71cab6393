r"""The cart-pole in closed form, for any rigid pole on a rail: what the engine is held against.

The state is `(x, x_dot, theta, theta_dot)`: m, m/s, rad, rad/s. Seen along the hinge's axis, the
pole's centre of mass stands at `l (sin(theta + phi), cos(theta + phi))` from the hinge, the second
number upwards, with phi the angle by which it leans at theta = 0. A push along the rail moves the
hinge by `(lambda, nu)` in that plane: `(s, 0)` where rail and axis are level and square to each
other, with `s = 1` where a positive angle leans to +x. With

    C(theta) = m l (lambda cos(theta + phi) - nu sin(theta + phi))

and armatures J_c and J_p, the kinetic and potential energy

    T = 1/2 (M + m + J_c) x_dot^2 + C x_dot theta_dot + 1/2 (I + m l^2 + J_p) theta_dot^2
    V = (M + m) g sin(tau) x + m g cos(eta) l cos(theta + phi)

with tau and eta the tilts of rail and axis, give by Lagrange's equations, with the push F, viscous
damping b_c, b_p, and dry friction R_c, R_p, the motor's own b_m counted in b_c,

    (M + m + J_c) x_acc + C theta_acc = F + R_c - b_c x_dot - C' theta_dot^2 - (M + m) g sin(tau)
    C x_acc + (I + m l^2 + J_p) theta_acc = m g cos(eta) l sin(theta + phi) + R_p - b_p theta_dot

which Cramer's rule solves. With I = m l^2 / 3, a uniform thin rod of length 2 l, and nothing else,
this is what CartPole-v1 computes: Barto, Sutton and Anderson (1983), doi:10.1109/TSMC.1983.6313077,
without friction; corrected by Florian (2007), "Correct equations for the dynamics of the cart-pole
system", https://coneural.org/florian/papers/05_cart_pole.pdf.

Every function takes one state, shape (4,), or many, shape (..., 4); forces broadcast against the
leading shape. Scalars and arrays pass through the same lines.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from mjcartpole import task
from mjcartpole.errors import ConfigError
from mjcartpole.integrator import Integrator, check_integrator
from mjcartpole.physics.dry_friction import DryFriction, friction_forces

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
        com_distance: l, m, from the hinge's axis to the pole's centre of mass; negative for a pole
            that hangs at angle 0.
        inertia: I, kg m^2, of the pole about its centre of mass.
        gravity: g, m/s^2; up is against it.
        slider_damping: b_c, N s/m.
        hinge_damping: b_p, N m s/rad.
        motor_damping: b_m, N s/m: how much the motor brakes the cart, by feeding back its velocity.
        slider_armature: J_c, kg: inertia that resists x_dot and has no weight.
        hinge_armature: J_p, kg m^2: inertia that resists theta_dot and has no weight.
        forces: Push on the cart along +x in N, by action 0 and by action 1.
        timestep: h, s: one physics step.
        hinge_sign: s: 1 if a positive angle leans the pole to +x, -1 if to -x.
        rail_tilt: tau, rad: how much the rail rises towards +x.
        hinge_tilt: eta, rad: how much the hinge's axis rises from the horizontal.
        skew: rad: how far the rail leaves the plane in which the pole turns.
        lean: phi, rad: how far the pole's centre of mass leans, as a positive angle does, at
            angle 0.
        slider_friction: Of the cart's joint, N; None without.
        hinge_friction: Of the pole's joint, N m; None without.
    """

    cart_mass: float
    pole_mass: float
    com_distance: float
    inertia: float
    gravity: float
    slider_damping: float = 0.0
    hinge_damping: float = 0.0
    motor_damping: float = 0.0
    slider_armature: float = 0.0
    hinge_armature: float = 0.0
    forces: tuple[float, float] = (-10.0, 10.0)
    timestep: float = task.CONTROL_STEP
    hinge_sign: int = 1
    rail_tilt: float = 0.0
    hinge_tilt: float = 0.0
    skew: float = 0.0
    lean: float = 0.0
    slider_friction: DryFriction | None = None
    hinge_friction: DryFriction | None = None

    def __post_init__(self) -> None:
        """Refuse numbers that no cart-pole has.

        Raises:
            ConfigError: A value is not finite, a mass, inertia, armature or damping is negative,
                the pole or the timestep is nothing, the sign is neither 1 nor -1, or no push
                along the rail could turn the pole.
        """
        for names, wanted, holds in _WANTED:
            for name in names:
                _check(name, getattr(self, name), holds(getattr(self, name)), wanted)
        within = abs(self._rise) < math.cos(self.skew)
        _check("rail tilt", self.rail_tilt, within, "an angle at which a push turns the pole")
        for force in self.forces:
            _check("forces", force, True, "finite")
        _check("hinge_sign", self.hinge_sign, self.hinge_sign in {-1, 1}, "1 or -1")

    @property
    def _rise(self) -> float:
        """Nu: how much of a push goes up in the plane in which the pole turns."""
        rise = math.sin(self.rail_tilt) - math.sin(self.hinge_tilt) * math.sin(self.skew)
        return rise / math.cos(self.hinge_tilt)

    @property
    def directions(self) -> tuple[float, float]:
        """Lambda and nu: a push along the rail in the plane of the pole, horizontal and up."""
        level = math.sqrt(math.cos(self.skew) ** 2 - self._rise**2)
        return self.hinge_sign * level, self._rise


_RESISTING: Final = "slider_damping hinge_damping motor_damping slider_armature hinge_armature"

_WANTED: Final[tuple[tuple[list[str], str, Callable[[float], bool]], ...]] = (
    (["cart_mass", "inertia", *_RESISTING.split()], "0 or more", lambda value: value >= 0),
    (["pole_mass", "timestep"], "more than 0", lambda value: value > 0),
    (["com_distance", "gravity"], "finite", lambda value: True),
    (["rail_tilt", "hinge_tilt", "skew", "lean"], "at most pi/2", lambda v: abs(v) <= math.pi / 2),
)
"""Which parameters must be what, in words and by a test."""


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
    """Return CartPole-v1's kind of cart-pole: a uniform rod without friction, by default its own.

    SI units; `length` is the whole rod's, gymnasium's `length` is half of it; `force` acts to
    either side.

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
    """What the two equations are made of: C = coupling cos(theta) - crossing sin(theta).

    Attributes:
        slider_inertia: M + m + J_c, kg.
        coupling: kg m; s m l where nothing is tilted.
        crossing: kg m; 0 where nothing is tilted.
        hinge_inertia: I + m l^2 + J_p, kg m^2.
        weight: N m, by the sine of theta: m g l where nothing is tilted.
        leaning: N m, by the cosine of theta: 0 where nothing is tilted.
        pull: Gravity's along the rail, N.
        slider_damping: b_c + b_m, N s/m.
        hinge_damping: b_p, N m s/rad.
    """

    slider_inertia: float
    coupling: float
    crossing: float
    hinge_inertia: float
    weight: float
    leaning: float
    pull: float
    slider_damping: float
    hinge_damping: float


def coefficients(p: Parameters, implicit_damping: float = 0.0) -> Coefficients:
    """Return the coefficients of a cart-pole's two equations.

    Args:
        p: The cart-pole.
        implicit_damping: h, s, when damping shall act on the velocities *after* a step of h:
            (M + h D) v_next = M v + h f, D on the diagonal, is the same as a mass matrix
            M + h D with the damping force of the old velocities. MuJoCo's Euler does that.
    """
    moment, mass = p.pole_mass * p.com_distance, p.cart_mass + p.pole_mass
    level, rise = p.directions
    sin, cos = math.sin(p.lean), math.cos(p.lean)
    torque = moment * p.gravity * math.cos(p.hinge_tilt)
    return Coefficients(
        slider_inertia=mass + p.slider_armature + implicit_damping * p.slider_damping,
        coupling=moment * (level * cos - rise * sin),
        crossing=moment * (level * sin + rise * cos),
        hinge_inertia=p.inertia
        + moment * p.com_distance
        + p.hinge_armature
        + implicit_damping * p.hinge_damping,
        weight=torque * cos,
        leaning=torque * sin,
        pull=-mass * p.gravity * math.sin(p.rail_tilt),
        slider_damping=p.slider_damping + p.motor_damping,
        hinge_damping=p.hinge_damping,
    )


def solve(
    k: Coefficients,
    x_dot: Number,
    theta: Number,
    theta_dot: Number,
    force: Number,
    torque: Number = 0.0,
) -> tuple[Number, Number]:
    """Return both accelerations, by Cramer's rule (equations and source: see the module).

    The arguments are in m/s, rad, rad/s; force and torque are what acts on rail and hinge beside
    damping and gravity, N and N m. All broadcast. The result is `(x_acc, theta_acc)` in m/s^2 and
    rad/s^2.
    """
    sin, cos = np.sin(theta), np.cos(theta)
    coupled = k.coupling * cos - k.crossing * sin
    swing = (k.coupling * sin + k.crossing * cos) * theta_dot * theta_dot
    push = force + k.pull - k.slider_damping * x_dot + swing
    turn = k.weight * sin + k.leaning * cos - k.hinge_damping * theta_dot + torque
    determinant = k.slider_inertia * k.hinge_inertia - coupled * coupled
    x_acc = (k.hinge_inertia * push - coupled * turn) / determinant
    theta_acc = (k.slider_inertia * turn - coupled * push) / determinant
    return x_acc, theta_acc


def _pushes(
    p: Parameters, x_dot: Number, theta: Number, theta_dot: Number, force: Number
) -> tuple[Number, Number]:
    """Return what acts on slider and hinge beside damping and gravity, friction included."""
    if p.slider_friction is None and p.hinge_friction is None:
        return force, 0.0
    k = coefficients(p)
    smooth = solve(k, x_dot, theta, theta_dot, force)
    coupled = k.coupling * np.cos(theta) - k.crossing * np.sin(theta)
    slider, hinge = friction_forces(
        (p.slider_friction, p.hinge_friction),
        (k.slider_inertia, coupled, k.hinge_inertia),
        (x_dot, theta_dot),
        smooth,
    )
    return force + slider, hinge


def accelerations(
    p: Parameters, x_dot: Number, theta: Number, theta_dot: Number, force: Number
) -> tuple[Number, Number]:
    """Return `(x_acc, theta_acc)` in m/s^2 and rad/s^2; see `solve` for the arguments."""
    pushes = _pushes(p, x_dot, theta, theta_dot, force)
    return solve(coefficients(p), x_dot, theta, theta_dot, *pushes)


def energy(p: Parameters, state: npt.ArrayLike) -> Array:
    """Return kinetic and potential energy together, J, shape (...,).

    Constant where nothing pushes or brakes. The cart has none of its own at x = 0.
    """
    k = coefficients(p)
    x, x_dot, theta, theta_dot = _split(state)
    sin, cos = np.sin(theta), np.cos(theta)
    kinetic = (
        0.5 * k.slider_inertia * x_dot * x_dot
        + (k.coupling * cos - k.crossing * sin) * x_dot * theta_dot
        + 0.5 * k.hinge_inertia * theta_dot * theta_dot
    )
    return np.asarray(kinetic + k.weight * cos - k.leaning * sin - k.pull * x)


def derivative(p: Parameters, state: npt.ArrayLike, force: npt.ArrayLike) -> Array:
    """Return the time derivative of the state, shape (..., 4), under a force in N."""
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
    """Return the state one physics step later, shape (..., 4).

    Args:
        p: The cart-pole.
        state: Before the step.
        force: F, N, constant during the step.
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
    # MuJoCo finds dry friction before it makes damping implicit.
    pushes = _pushes(p, x_dot, theta, theta_dot, np.asarray(force))
    x_acc, theta_acc = solve(k, x_dot, theta, theta_dot, *pushes)
    x_dot_next, theta_dot_next = x_dot + h * x_acc, theta_dot + h * theta_acc
    if explicit:
        return _join(x + h * x_dot, x_dot_next, theta + h * theta_dot, theta_dot_next)
    return _join(x + h * x_dot_next, x_dot_next, theta + h * theta_dot_next, theta_dot_next)


def rk4_step(
    p: Parameters, state: npt.ArrayLike, force: npt.ArrayLike, h: float | None = None
) -> Array:
    """Return the state one step of the classic Runge-Kutta method later; arguments as `step`'s."""
    h = p.timestep if h is None else h
    s = np.asarray(state)
    k1 = derivative(p, s, force)
    k2 = derivative(p, s + h / 2 * k1, force)
    k3 = derivative(p, s + h / 2 * k2, force)
    k4 = derivative(p, s + h * k3, force)
    return np.asarray(s + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4))


def _split(state: npt.ArrayLike) -> tuple[Array, Array, Array, Array]:
    """Return the four columns of states of shape (..., 4)."""
    values = np.asarray(state)
    if values.ndim == 0 or values.shape[-1] != 4:
        raise ConfigError(
            "a state has 4 values (x, x_dot, theta, theta_dot) in its last dimension, "
            f"not the shape {values.shape}"
        )
    return values[..., 0], values[..., 1], values[..., 2], values[..., 3]


def _join(x: Array, x_dot: Number, theta: Array, theta_dot: Number) -> Array:
    return np.stack(np.broadcast_arrays(x, x_dot, theta, theta_dot), axis=-1)
