"""Rung 9: what each integrator does as the step shrinks, and to the energy."""

import math

import numpy as np

from mjcartpole.integrator import Integrator
from mjcartpole.physics import equations
from mjcartpole.physics.cartpole import with_options
from mjcartpole.physics.equations import Parameters, coefficients
from mjcartpole.physics.free_region import FreeRegion
from mjcartpole.physics.simulation import Simulation
from mjcartpole.studies.parity.case import Subject, Vector
from mjcartpole.studies.parity.result import Figure, Question, Result

QUESTION = Question(
    9,
    "convergence: each integrator against extrapolation, and its energy",
    "theory: halving the step halves Euler's error (order 1) and makes RK4's 16 times less",
)

METHODS: dict[str, tuple[Integrator, str, int]] = {
    "explicit Euler": ("gym", "Euler", 1),
    "semi-implicit Euler": ("mujoco", "Euler", 1),
    "RK4": ("mujoco", "RK4", 4),
}
"""Our integrator, the file's, and the order that theory gives it."""

START = np.array([0.0, 0.3, 0.4, -0.5])
"""Where the model moves freely; where its stops are near, a part of that."""

_TOO_FAR = 0.5
"""Of the way to the nearest stop."""

COARSEST, FINEST = 2, 13
"""Steps are 1/4 to 1/4096 of the duration, in powers of two."""

ROUNDING = 1e-10
"""An error below this has too much rounding in it to tell an order."""

STRIDES, COLUMNS = 32, 8
"""Of the reference: how far it goes at once, and how often it is extrapolated there."""

ORDER_TOLERANCE = 0.1
"""Relative: it tells 4 from 3 and 5, and leaves room for steps that rounding keeps coarse."""

ENERGY_SECONDS = 10.0


def convergence(subject: Subject) -> Result:
    """Rung 9: measured order against extrapolation on the equations; energy gained or lost."""
    if uncovered := subject.uncovered():
        return QUESTION.leave(uncovered)
    if subject.reference.slider_friction or subject.reference.hinge_friction:
        return QUESTION.skip(
            "dry friction jumps where the motion turns: no method keeps its order across that"
        )
    duration, exact = _exact(subject)
    figures: list[Figure] = []
    for name, (integrator, option, order) in METHODS.items():
        errors = _errors(subject, integrator, option, duration, exact)
        figures.extend(_order_figures(name, order, errors))
    swings = FreeRegion(subject.region.x, subject.region.theta) == FreeRegion()
    if coefficients(subject.reference).weight and swings:
        for name, (integrator, option, _) in METHODS.items():
            gain = energy_gain(subject, integrator, option)
            figures.append(
                Figure(f"{name}: energy gained in {ENERGY_SECONDS:g} s", gain, None, "m g l")
            )
    bad = any(not figure.holds for figure in figures)
    return QUESTION.answer(figures, story=subject.story if bad else ())


def _order_figures(name: str, order: int, errors: list[float]) -> list[Figure]:
    """Return how far a measured order is from theory's, or that rounding hides it."""
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


def _start(subject: Subject) -> Vector:
    """Return a state at rest in none of its values, from which no stop is reached."""
    region = subject.region
    room = min(-region.theta[0], region.theta[1]) / abs(START[2])
    along = min(-region.x[0], region.x[1]) / abs(START[1])
    start: Vector = START * min(1.0, _TOO_FAR * room, _TOO_FAR * along)
    return start


def _duration(subject: Subject) -> float:
    """Return a time, s, in which the pole moves well but does not spin, by weight, push, brakes."""
    p, k = subject.reference, coefficients(subject.reference)
    _, falling = equations.accelerations(p, 0.0, 1.0, 0.0, 0.0)
    _, pushed = equations.accelerations(p, 0.0, START[2], START[3], p.forces[1])
    fastest = max(abs(float(falling)), abs(float(pushed)), 1e-2)
    inertia = np.array([[k.slider_inertia, k.coupling], [k.coupling, k.hinge_inertia]])
    braking = np.linalg.solve(inertia, np.diag([k.slider_damping, k.hinge_damping]))
    # Beyond a time constant of the strongest brake, coarse steps overshoot instead of converging.
    return 1 / max(math.sqrt(fastest), float(np.abs(np.linalg.eigvals(braking)).max()))


def _exact(subject: Subject) -> tuple[float, Vector]:
    """Return a time within which no stop is reached, s, and the state after it."""
    p, force, duration = subject.reference, subject.reference.forces[1], _duration(subject)
    while True:
        states = [_start(subject)]
        for _ in range(STRIDES):
            states.append(_extrapolated(p, states[-1], force, duration / STRIDES))
        if subject.region.holds(np.array(states)).all():
            return duration, states[-1]
        duration /= 2


def _extrapolated(p: Parameters, state: Vector, force: float, h: float) -> Vector:
    """Return the state a time h, s, later, by Gragg's method with ever more steps, extrapolated.

    Hairer, Nørsett and Wanner (1993), section II.9, doi:10.1007/978-3-540-78862-1: its error has
    even powers of the step only, and each column cancels one more; here 8 columns, order 16.
    """
    row: list[Vector] = []
    for k in range(1, COLUMNS + 1):
        step = h / (2 * k)
        before, now = state, state + step * equations.derivative(p, state, force)
        for _ in range(2 * k - 1):
            before, now = now, before + 2 * step * equations.derivative(p, now, force)
        new = [(before + now + step * equations.derivative(p, now, force)) / 2]
        for j, coarser in enumerate(row):
            new.append(new[j] + (new[j] - coarser) / ((k / (k - j - 1)) ** 2 - 1))
        row = new
    return row[-1]


def _errors(
    subject: Subject, integrator: Integrator, option: str, duration: float, exact: Vector
) -> list[float]:
    """Return the error at the end with steps that are halved until rounding shows."""
    errors: list[float] = []
    for halving in range(COARSEST, FINEST):
        count = 2**halving
        cartpole = with_options(subject.cartpole, timestep=duration / count, integrator=option)
        simulation = Simulation(cartpole, integrator)
        simulation.state = _start(subject)
        for _ in range(count):
            simulation.step(subject.cartpole.controls[1])
        errors.append(float(np.abs(simulation.state - exact).max()))
        if errors[-1] < ROUNDING:
            break
    return errors


def energy_gain(subject: Subject, integrator: Integrator, option: str) -> float:
    """Return the energy gained by a free swing at the model's own timestep, over m g l.

    Infinite where the swing diverges, as explicit Euler's does with strong damping.
    """
    energies = energy_track(subject, integrator, option)
    p = subject.reference
    gain = float((energies[-1] - energies[0]) / (p.pole_mass * abs(p.gravity * p.com_distance)))
    return gain if math.isfinite(gain) else math.inf


def energy_track(subject: Subject, integrator: Integrator, option: str) -> Vector:
    """Return the energy after each step of a free swing that starts hanging aside, J."""
    cartpole = with_options(subject.cartpole, timestep=subject.cartpole.timestep, integrator=option)
    simulation = Simulation(cartpole, integrator)
    simulation.state = [0.0, 0.0, np.pi - 0.5, 0.0]
    states = [simulation.state]
    for _ in range(round(ENERGY_SECONDS / cartpole.timestep)):
        simulation.step(0.0)
        states.append(simulation.state)
    return equations.energy(subject.own, np.array(states))
