"""Cases: the model under examination, and what it is held against."""

import dataclasses
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, NamedTuple

import gymnasium
import numpy as np
import numpy.typing as npt

from mjcartpole.envs.backend import GYM_ID
from mjcartpole.envs.registration import ENV_ID
from mjcartpole.integrator import Integrator
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.policy import Policy
from mjcartpole.learning.training import Training
from mjcartpole.physics.bodies import farthest_from_origin
from mjcartpole.physics.cartpole import CartPole, with_options
from mjcartpole.physics.deviations import Deviation, deviations
from mjcartpole.physics.equations import CARTPOLE_V1, Parameters
from mjcartpole.physics.file_steps import method_of
from mjcartpole.physics.free_region import FreeRegion, free_region
from mjcartpole.physics.parameters import read_parameters
from mjcartpole.physics.simulation import Simulation
from mjcartpole.physics.unmodelled_effects import beyond_equations, beyond_step, idle_numbers

Against = Literal["cartpole-v1", "itself"]

KINEMATICS: dict[Integrator, str] = {"gym": "euler", "mujoco": "semi-implicit"}
"""What gymnasium calls our integrators."""

Vector = npt.NDArray[np.float64]


class Batch(NamedTuple):
    """States, shape (n, 4), and the action taken in each, shape (n,)."""

    states: Vector
    actions: npt.NDArray[np.intp]


# Enough to stay up for a while, not always: episodes then differ in length and ending.
_POLICY = TrainConfig.preset("tuned", episodes=60, seed=1)


@dataclass(frozen=True)
class Subject:
    """A model, the question asked of it, and the witnesses.

    Attributes:
        cartpole: The model. One action is one physics step here, however long it is: parity is a
            question of single steps.
        against: Which question: see the package.
        quick: Whether to take fewer samples.
        seed: Seeds every draw.
    """

    cartpole: CartPole
    against: Against = "cartpole-v1"
    quick: bool = False
    seed: int = 0

    def __post_init__(self) -> None:
        if self.cartpole.substeps != 1:
            object.__setattr__(self, "cartpole", with_options(self.cartpole))

    @cached_property
    def own(self) -> Parameters:
        """The model's own parameters."""
        return read_parameters(self.cartpole)

    @cached_property
    def reference(self) -> Parameters:
        """The parameters that the answers are held against."""
        return CARTPOLE_V1 if self.against == "cartpole-v1" else self.own

    @cached_property
    def _free(self) -> FreeRegion:
        return free_region(self.cartpole)

    @cached_property
    def region(self) -> FreeRegion:
        """Where states are drawn and compared.

        A model that is asked about itself is tested where it moves freely. Of one that shall be
        CartPole-v1, only that is left out which no episode meets.
        """
        region = self._free
        return region if region.covers_task or self.against == "itself" else FreeRegion()

    @cached_property
    def beyond(self) -> list[str]:
        """What the model has that the equations do not cover."""
        met = [] if self.region.bounds else self._free.bounds
        return list(dict.fromkeys([*met, *beyond_equations(self.cartpole)]))

    @property
    def method(self) -> str:
        """By which method of the equations the file's own integrator shall step."""
        return "Euler" if self.against == "cartpole-v1" else method_of(self.cartpole)

    @cached_property
    def beyond_step(self) -> list[str]:
        """Why one step of the file's own integrator is not what it is held against."""
        return beyond_step(self.cartpole, self.method)

    def uncovered(self, integrator: Integrator = "gym") -> list[str]:
        """Return why the equations cannot answer for the model, asked about itself."""
        return self.acting(integrator) if self.against == "itself" else []

    def acting(self, integrator: Integrator) -> list[str]:
        """Return what acts in a step of an integrator and is not in the equations."""
        return self.beyond + (self.beyond_step if integrator == "mujoco" else [])

    @cached_property
    def deviations(self) -> list[Deviation]:
        """By what the model's parameters differ from the reference's."""
        return deviations(self.cartpole, self.reference)

    @cached_property
    def causes(self) -> list[str]:
        """Everything by which the model may move differently from what it is held against."""
        found = [deviation.phrase for deviation in self.deviations] + self.beyond
        return found + (self.beyond_step if self.against == "cartpole-v1" else [])

    @property
    def story(self) -> tuple[str, ...]:
        """The causes as lines of a result."""
        return tuple(f"differs: {cause}" for cause in self.causes)

    @cached_property
    def numbers(self) -> list[str]:
        """Everything by which the model's numbers differ from CartPole-v1's, felt or not."""
        return self.causes + idle_numbers(self.cartpole) if self.against == "cartpole-v1" else []

    @cached_property
    def offset(self) -> float:
        """How far from the world's origin the model stands at x = 0, m."""
        return farthest_from_origin(self.cartpole)

    def rng(self, rung: int) -> np.random.Generator:
        """Return a rung's own generator, so that rungs can be run alone with the same result."""
        return np.random.default_rng([self.seed, rung])

    def simulation(self, integrator: Integrator) -> Simulation:
        """Return the model in motion; asked about itself, with dry friction solved to the end."""
        simulation = Simulation(self.cartpole, integrator)
        if self.solves_to_the_end:
            simulation.model.opt.tolerance = 0.0
        return simulation

    @property
    def solves_to_the_end(self) -> bool:
        """Whether MuJoCo's solver is kept from stopping at its tolerance.

        With friction that grips, that is now and then more than rounding.
        """
        rubs = self.own.slider_friction or self.own.hinge_friction
        return self.against == "itself" and rubs is not None

    def ours(self, integrator: Integrator = "gym", **options: Any) -> gymnasium.Env[Any, Any]:  # noqa: ANN401
        """Return our environment with this model."""
        arguments = {"model": self.cartpole, "integrator": integrator, **options}
        return gymnasium.make(ENV_ID, disable_env_checker=True, **arguments)

    def gyms(self, integrator: Integrator = "gym", **options: Any) -> gymnasium.Env[Any, Any]:  # noqa: ANN401
        """Return gymnasium's environment with the reference's parameters.

        Raises:
            ValueError: Its formula cannot express them; see `gym_cannot`.
        """
        env = gymnasium.make(GYM_ID, disable_env_checker=True, **options)
        set_parameters(env, self.reference)
        env.unwrapped.kinematics_integrator = KINEMATICS[integrator]  # type: ignore[attr-defined]
        return env

    def gyms_as_is(self) -> gymnasium.Env[Any, Any]:
        """Return gymnasium's environment with nothing changed."""
        return gymnasium.make(GYM_ID, disable_env_checker=True)

    @cached_property
    def gym_cannot(self) -> str:
        """Why gymnasium's formula cannot express the reference; empty if it can."""
        if not (self.region.covers_task or self.against == "cartpole-v1"):
            return f"it has no stops, and here an episode meets {'; '.join(self.region.bounds)}"
        return why_not_gymnasiums(self.reference)

    @cached_property
    def policy(self) -> Policy:
        """A policy that has learned a little on this model."""
        training = Training(_POLICY, env=self.ours())
        for _ in training.run():
            pass
        return training.result().policy

    def random_batch(self, rung: int, n: int, box: npt.ArrayLike) -> Batch:
        """Return n random states within ±box, and actions."""
        rng, (low, high) = self.rng(rung), self.region.box(box)
        states, actions = rng.uniform(low, high, size=(n, 4)), rng.integers(2, size=n)
        if not self.region.bounds:
            return Batch(states, actions)
        stays = self.region.holds_for_a_step(states, self.own)
        return Batch(states[stays], actions[stays])

    def forces(self, batch: Batch) -> Vector:
        """Return the reference's push for each action of a batch, N."""
        return np.array(self.reference.forces)[batch.actions]

    def controls(self, batch: Batch) -> Vector:
        """Return the model's control for each action of a batch."""
        return np.array(self.cartpole.controls)[batch.actions]


def why_not_gymnasiums(p: Parameters) -> str:
    """Return why gymnasium's formula cannot express a cart-pole; empty if it can."""
    uniform = p.pole_mass * p.com_distance**2 / 3
    if abs(p.inertia - uniform) > 1e-12 * uniform or p.com_distance <= 0:
        return "its pole is a uniform thin rod, and this one is not"
    if dataclasses.replace(p, **_WITHOUT) != p:
        return "it knows neither damping, friction nor armature, and nothing that is tilted"
    if p.forces[0] != -p.forces[1] or p.hinge_sign != 1:
        return (
            "it pushes as hard to the left as to the right, and positive angles lean to the right"
        )
    return ""


_WITHOUT: dict[str, Any] = {
    field.name: field.default
    for field in dataclasses.fields(Parameters)
    if field.default is not dataclasses.MISSING
    and field.name not in {"forces", "timestep", "hinge_sign"}
}
"""What a plain cart-pole does not have: none of it acts."""


def set_parameters(env: gymnasium.Env[Any, Any], p: Parameters) -> None:
    """Give gymnasium's CartPole-v1 other parameters, derived values included.

    Gymnasium computes `total_mass` and `polemass_length` once, in its constructor: setting
    `masscart` alone changes nothing.

    Raises:
        ValueError: Its formula cannot express them.
    """
    if why := why_not_gymnasiums(p):
        raise ValueError(f"gymnasium's formula cannot express this cart-pole: {why}")
    cartpole: Any = env.unwrapped
    cartpole.gravity = p.gravity
    cartpole.masscart, cartpole.masspole = p.cart_mass, p.pole_mass
    cartpole.length = p.com_distance
    cartpole.force_mag = p.forces[1]
    cartpole.tau = p.timestep
    cartpole.total_mass = cartpole.masspole + cartpole.masscart
    cartpole.polemass_length = cartpole.masspole * cartpole.length
