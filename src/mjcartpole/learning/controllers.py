"""Controllers: policies that nobody trained, for engineers to compare a table with.

`lqr`: the linear-quadratic regulator (Kalman, 1960) of one control step, as the simulation itself
makes it near upright rest, so that delay, sub-steps and integrator are in it. States are weighed
by Bryson's rule: one over the square of the limit that ends an episode; the push by 1.

`energy`: pumps the pole's energy up to that of standing still upright (Astrom and Furuta, 2000,
doi:10.1016/S0005-1098(99)00140-5), holds the cart back from the track's ends, and leaves the rest
to `lqr`.
"""

import hashlib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, Final

import numpy as np
import numpy.typing as npt

from mjcartpole.errors import ConfigError, check_known
from mjcartpole.integrator import Integrator
from mjcartpole.packages import check_installed
from mjcartpole.task import CARTPOLE_V1, in_words

if TYPE_CHECKING:
    from mjcartpole.physics.cartpole import CartPole
    from mjcartpole.physics.simulation import Simulation

Effort = Callable[[Sequence[float]], float]
"""From an observation to a push: -1 is all there is to the left, 1 to the right; it may exceed."""

_SMALL: Final = 1e-4
"""How far a state is moved to see what becomes of it, m, m/s, rad, rad/s: of the error that
rounding and curvature leave, both parts are about 1e-9."""

_CATCH: Final = 0.44
"""A pole that leans less, rad, is for the regulator."""

_PUMP, _HOLD, _BRAKE = 0.7, 1.1, 0.23
"""Push per energy that is missing (of m g l), per m and per m/s of the cart."""


@dataclass(frozen=True, eq=False)
class Controller:
    """A policy by a formula.

    Attributes:
        name: What it is called.
        poles: For how many poles it is; None for any.
        effort: How hard it pushes; see `Effort`.
    """

    name: str
    poles: int | None
    effort: Effort = field(repr=False)

    actions: ClassVar[int] = 0
    """How many actions before it looks at."""

    def __call__(self, observation: npt.NDArray[np.float32]) -> int:
        """Return the action on whose side the push is: 0 to the left, 1 to the right."""
        return 1 if self.effort(observation.tolist()) > 0 else 0

    def push(self, observation: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
        """Return the action of a task that takes any force between the ends, shape (1,)."""
        return np.array([min(max(self.effort(observation.tolist()), -1.0), 1.0)], np.float32)

    def check_fits(self, poles: int, where: str) -> None:
        """Refuse to play with another number of poles than it is for (ConfigError)."""
        if self.poles not in (None, poles):
            raise ConfigError(
                f"{self.name} is for {in_words(self.poles or 0)}, and {where} has {in_words(poles)}"
            )


def gains(cartpole: "CartPole", integrator: Integrator = "gym") -> npt.NDArray[np.float64]:
    """Return the regulator's gains K, shape (2 + 2 poles,): it pushes by -K state.

    Raises:
        ConfigError: Nothing can be regulated: what is pushed does not answer, or not enough; or
            SciPy is not installed.
    """
    check_installed("policy lqr or energy", "scipy")
    from scipy.linalg import solve_discrete_are  # noqa: PLC0415 - slow to import, as is MuJoCo

    from mjcartpole.physics.simulation import Simulation  # noqa: PLC0415

    by_state, by_push = _one_step(Simulation(cartpole, integrator))
    limits = [CARTPOLE_V1.x_limit, math.inf, *[CARTPOLE_V1.theta_limit, math.inf] * cartpole.poles]
    weights = np.diag(1.0 / np.square(limits))
    try:
        cost = solve_discrete_are(by_state, by_push, weights, np.eye(1))
    except (np.linalg.LinAlgError, ValueError) as error:
        raise ConfigError(
            f"no regulator holds {cartpole.name} upright: near there its pushes do not reach all "
            "that moves"
        ) from error
    grip = by_push.T @ cost
    found: npt.NDArray[np.float64] = np.linalg.solve(1.0 + grip @ by_push, grip @ by_state)[0]
    return found


def _one_step(simulation: "Simulation") -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return A, shape (n, n), and B, shape (n, 1): a control step near upright rest is A s + B u.

    By central differences; the push u is -1 at the left end of the controls and 1 at the right.
    """
    n, (left, right) = simulation.size, simulation.cartpole.controls
    moves = np.concatenate([np.eye(n), -np.eye(n)]) * _SMALL
    after = simulation.steps(moves, np.full(2 * n, (left + right) / 2))
    pushed = simulation.steps(np.zeros((2, n)), np.array([right, left]))
    by_state = (after[:n] - after[n:]).T / (2 * _SMALL)
    return by_state, (pushed[:1] - pushed[1:]).T / 2


def lqr(cartpole: "CartPole", integrator: Integrator = "gym") -> Controller:
    """Return the linear-quadratic regulator of a model (ConfigError: see `gains`)."""
    k = gains(cartpole, integrator).tolist()
    return Controller(
        "lqr", cartpole.poles, lambda seen: -sum(a * b for a, b in zip(k, seen, strict=True))
    )


def energy(cartpole: "CartPole", integrator: Integrator = "gym") -> Controller:
    """Return the swing-up by energy of a model with one pole.

    Raises:
        ConfigError: See `gains`.
        ModelError: There are several poles.
    """
    from mjcartpole.physics.parameters import read_parameters  # noqa: PLC0415

    p, regulate = read_parameters(cartpole), lqr(cartpole, integrator).effort
    weight = p.pole_mass * p.gravity * p.com_distance
    inertia = p.inertia + p.pole_mass * p.com_distance**2

    def effort(seen: Sequence[float]) -> float:
        x, x_dot, theta, theta_dot = seen
        if abs(theta) < _CATCH:
            return regulate(seen)
        missing = 1.0 - math.cos(theta) - inertia * theta_dot**2 / (2.0 * weight)
        # A cart that is pulled away under a pole lifts it.
        side = math.copysign(1.0, theta_dot * math.cos(theta))
        return -_PUMP * missing * side - _HOLD * x - _BRAKE * x_dot

    return Controller("energy", 1, effort)


def random(cartpole: "CartPole | None" = None, integrator: Integrator = "gym") -> Controller:
    """Return a policy that pushes anyhow: the same observation the same way, in films as well."""

    def effort(seen: Sequence[float]) -> float:
        drawn = hashlib.blake2b(np.array(seen).tobytes(), digest_size=8).digest()
        return int.from_bytes(drawn, "little") / 2**63 - 1.0

    return Controller("random", None, effort)


def constant(cartpole: "CartPole | None" = None, integrator: Integrator = "gym") -> Controller:
    """Return a policy that always pushes to the right."""
    return Controller("constant", None, lambda seen: 1.0)


CONTROLLERS: Final[dict[str, Callable[..., Controller]]] = {
    "lqr": lqr,
    "energy": energy,
    "random": random,
    "constant": constant,
}
"""What makes each, by its name, for a model and its integrator."""


def controller(
    name: str, cartpole: "CartPole | None" = None, integrator: Integrator = "gym"
) -> Controller:
    """Return the controller of a name, for a model.

    Raises:
        ConfigError: There is none, or none for this model.
        ModelError: The model is not for it.
    """
    check_known("policy", name, CONTROLLERS)
    return CONTROLLERS[name](cartpole, integrator)
