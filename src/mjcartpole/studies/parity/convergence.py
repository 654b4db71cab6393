"""Rung 9: what each integrator does as the step shrinks, and to the energy."""

import math

import numpy as np
from scipy.integrate import solve_ivp

from mjcartpole.integrator import Integrator
from mjcartpole.physics import equations
from mjcartpole.physics.equations import coefficients
from mjcartpole.physics.model import with_options
from mjcartpole.physics.simulation import Simulation
from mjcartpole.studies.parity.dynamics import beyond_result
from mjcartpole.studies.parity.result import Figure, Result
from mjcartpole.studies.parity.subject import Subject, Vector

METHODS: dict[str, tuple[Integrator, str, int]] = {
    "explicit Euler": ("gym", "Euler", 1),
    "semi-implicit Euler": ("mujoco", "Euler", 1),
    "RK4": ("mujoco", "RK4", 4),
}
"""Our integrator, the file's, and the order that theory gives it."""

START = np.array([0.0, 0.3, 0.4, -0.5])
COARSEST, FINEST = 2, 13
"""Steps are 1/4 to 1/4096 of the duration, in powers of two."""

ROUNDING = 1e-10
"""An error below this has too much rounding in it to tell an order."""

ORDER_TOLERANCE = 0.1
"""Relative: it tells 4 from 3 and 5, and leaves room for steps that rounding keeps coarse."""

ENERGY_SECONDS = 10.0


def convergence(subject: Subject) -> Result:
    """Rung 9: measured order against SciPy's DOP853 on the equations; energy gained or lost."""
    title = "convergence: each integrator against DOP853, and its energy"
    reason = "theory: halving the step halves Euler's error (order 1) and makes RK4's 16 times less"
    if subject.against == "itself" and subject.beyond:
        return beyond_result(9, title, reason, subject.beyond)
    exact = _exact(subject, _duration(subject))
    figures: list[Figure] = []
    for name, (integrator, option, order) in METHODS.items():
        errors = _errors(subject, integrator, option, exact)
        figures.extend(_order_figures(name, order, errors))
    if coefficients(subject.reference).weight:
        for name, (integrator, option, _) in METHODS.items():
            gain = energy_gain(subject, integrator, option)
            figures.append(
                Figure(f"{name}: energy gained in {ENERGY_SECONDS:g} s", gain, None, "m g l")
            )
    bad = any(not figure.holds for figure in figures)
    return Result(9, title, reason, tuple(figures), (), tuple(subject.causes) if bad else ())


def _order_figures(name: str, order: int, errors: list[float]) -> list[Figure]:
    """How far a measured order is from theory's, or that rounding hides it."""
    usable = [error for error in errors if error >= ROUNDING]
    if len(usable) < 2:
        # It cannot fall faster than its order lets it.
        most = ROUNDING * 2 ** (order + 1)
        return [Figure(f"{name}: error, too small to tell an order", max(errors), most, "")]
    measured = math.log2(usable[-2] / usable[-1])
    tolerance = order * ORDER_TOLERANCE
    return [
        Figure(f"{name}: |order - {order}|", abs(measured - order), tolerance, ""),
        Figure(f"{name}: order", measured),
    ]


def _duration(subject: Subject) -> float:
    """A time in which the pole moves well but does not spin, s: set by weight, push and brakes."""
    p, k = subject.reference, coefficients(subject.reference)
    _, falling = equations.accelerations(p, 0.0, 1.0, 0.0, 0.0)
    _, pushed = equations.accelerations(p, 0.0, START[2], START[3], p.forces[1])
    fastest = max(abs(float(falling)), abs(float(pushed)), 1e-6)
    inertia = np.array([[k.slider_inertia, k.coupling], [k.coupling, k.hinge_inertia]])
    braking = np.linalg.solve(inertia, np.diag([k.slider_damping, k.hinge_damping]))
    # Beyond a time constant of the strongest brake, coarse steps overshoot instead of converging.
    return 1 / max(math.sqrt(fastest), float(np.abs(np.linalg.eigvals(braking)).max()))


def _exact(subject: Subject, duration: float) -> Vector:
    p, force = subject.reference, subject.reference.forces[1]
    solution = solve_ivp(
        lambda _, state: equations.derivative(p, state, force),
        (0.0, duration),
        START,
        method="DOP853",
        rtol=1e-13,
        atol=1e-13,
    )
    return np.array(solution.y[:, -1])


def _errors(subject: Subject, integrator: Integrator, option: str, exact: Vector) -> list[float]:
    """The error at the end with steps that are halved again and again, until rounding shows."""
    errors: list[float] = []
    for halving in range(COARSEST, FINEST):
        count = 2**halving
        step = _duration(subject) / count
        cartpole = with_options(subject.cartpole, timestep=step, integrator=option)
        simulation = Simulation(cartpole, integrator)
        simulation.state = START
        for _ in range(count):
            simulation.step(subject.cartpole.controls[1])
        errors.append(float(np.abs(simulation.state - exact).max()))
        if errors[-1] < ROUNDING:
            break
    return errors


def energy_gain(subject: Subject, integrator: Integrator, option: str) -> float:
    """Energy gained by a free swing at the model's own timestep, over m g l.

    Infinite where the swing diverges, as explicit Euler's does with strong damping.
    """
    energies = energy_track(subject, integrator, option)
    p = subject.reference
    gain = float((energies[-1] - energies[0]) / (p.pole_mass * abs(p.gravity * p.com_distance)))
    return gain if math.isfinite(gain) else math.inf


def energy_track(subject: Subject, integrator: Integrator, option: str) -> Vector:
    """Energy after each step of a free swing that starts hanging aside, J."""
    cartpole = with_options(subject.cartpole, timestep=subject.cartpole.timestep, integrator=option)
    simulation = Simulation(cartpole, integrator)
    simulation.state = [0.0, 0.0, np.pi - 0.5, 0.0]
    states = [simulation.state]
    for _ in range(round(ENERGY_SECONDS / cartpole.timestep)):
        simulation.step(0.0)
        states.append(simulation.state)
    return equations.energy(subject.own, np.array(states))
