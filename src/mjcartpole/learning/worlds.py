"""What compiled episodes are played in: one physics, or another one for each where models vary."""

from collections.abc import Iterator
from typing import Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from mjcartpole.disturbances.contexts import Chance
from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.learning.fitted import Fitted
from mjcartpole.learning.kinds import Disturbed, GymPhysics, MujocoPhysics, Physics
from mjcartpole.physics.bare import bare
from mjcartpole.physics.bodies import starting_state
from mjcartpole.physics.cartpole import CartPole, own_copy
from mjcartpole.physics.cartpole_v1 import FORCE
from mjcartpole.physics.simulation import Simulation
from mjcartpole.physics.variants import contexts_of, effects_on, variant
from mjcartpole.task import Task, state_names


class Worlds:
    """The physics of episodes.

    Attributes:
        cartpole: The model, or that of which others are variants; None on gymnasium's equations.
        vary: Whether each episode may have another.
        size: How many values a state has.
    """

    def __init__(
        self,
        cartpole: CartPole | None,
        integrator: str,
        task: Task,
        disturbances: Disturbances,
        fitted: Fitted | None = None,
    ) -> None:
        """Make the first one; what was fitted takes the place of the world.

        Raises:
            ConfigError: A disturbance makes no sense here.
        """
        self.cartpole, self._fitted = cartpole, fitted
        self._settings: Any = integrator, task, disturbances
        self.vary = bool(disturbances.vary) and cartpole is not None
        self._contexts = contexts_of(cartpole, disturbances) if cartpole and self.vary else None
        self.size = len(state_names(cartpole.poles if cartpole else 1))
        self._most = max(1, disturbances.pool or 0)
        self._made: dict[int, tuple[CartPole | None, _World]] = {}
        self._first = self._make(bare(cartpole) if cartpole and not self.vary else cartpole)

    def physics(self, chance: Chance | None, number: int) -> Physics:
        """Return that of an episode; where there are disturbances, `chance` draws them."""
        world = self._first
        if self._contexts and chance and self.cartpole:
            world = self._kept(variant(self.cartpole, chance.context(self._contexts, number)))
        physics = world.physics
        if isinstance(physics, Disturbed) and chance:
            return physics._replace(rng=chance.rng)
        return physics

    def prepare(self) -> None:
        """Make all there are, where they come from a pool."""
        if self._contexts and self._contexts.pool and self.cartpole:
            for context in self._contexts.models():
                self._kept(variant(self.cartpole, context))

    def parts(self, start: int, stop: int) -> Iterator[tuple[int, int]]:
        """Yield which episodes have the same physics: all of them, or each its own."""
        if not self.vary or start == stop:
            yield start, stop
        else:
            yield from ((number, number + 1) for number in range(start, stop))

    def _kept(self, cartpole: CartPole) -> "_World":
        found = self._made.get(id(cartpole))
        if found is None:
            while len(self._made) >= self._most:
                del self._made[next(iter(self._made))]
            # What is kept beside it keeps its id.
            found = self._made[id(cartpole)] = cartpole, self._make(cartpole)
        return found[1]

    def _make(self, cartpole: CartPole | None) -> "_World":
        integrator, task, disturbances = self._settings
        simulation = Simulation(own_copy(cartpole), integrator) if cartpole else None
        arrays = _Arrays.of(simulation, task, disturbances)
        inner = _physics(simulation, arrays, task, self._fitted)
        if not disturbances.are_some:
            return _World(inner, simulation, arrays)
        effects, memory = effects_on(cartpole, disturbances, task)
        arrays = arrays._replace(memory=np.array(memory))
        physics = Disturbed(
            inner=inner,
            effects=effects,
            memory=arrays.memory.ctypes.data,
            seen=arrays.seen.ctypes.data,
            rng=np.random.default_rng(0),
        )
        return _World(physics, simulation, arrays)


class _Arrays(NamedTuple):
    """Arrays that compiled code is given the addresses of; see `MujocoPhysics`."""

    joints: npt.NDArray[np.int64]
    seen: npt.NDArray[np.float64]
    moved: npt.NDArray[np.float64]
    start: npt.NDArray[np.float64]
    memory: npt.NDArray[np.float64]

    @classmethod
    def of(cls, simulation: Simulation | None, task: Task, disturbances: Disturbances) -> Self:
        joints, start = np.zeros(2, np.int64), np.zeros(2)
        if simulation is not None:
            joints = np.array(simulation.cartpole.joints, np.int64)
            start = starting_state(simulation.cartpole, task)[0::2].copy()
        seen = np.zeros(2 * joints.size + disturbances.observe_actions)
        return cls(joints, seen, np.zeros(joints.size), start, np.zeros(0))


class _World(NamedTuple):
    """A physics, and what it has addresses of: these must live as long."""

    physics: Physics
    simulation: Simulation | None
    arrays: _Arrays


def _physics(
    simulation: Simulation | None, arrays: _Arrays, task: Task, fitted: Fitted | None
) -> MujocoPhysics | GymPhysics | Fitted:
    if fitted is not None:
        return fitted._replace(start=float(task.start_angle))
    if simulation is None:
        return GymPhysics(-FORCE, FORCE, float(task.start_angle))
    cartpole, model, data = simulation.cartpole, simulation.model, simulation.data
    left, right = cartpole.controls
    return MujocoPhysics(
        model=model._address,
        data=data._address,
        qpos=data.qpos.ctypes.data,
        qvel=data.qvel.ctypes.data,
        ctrl=data.ctrl.ctypes.data,
        applied=data.qfrc_applied.ctypes.data,
        joints=arrays.joints.ctypes.data,
        n_joints=len(arrays.joints),
        left=left,
        right=right,
        timestep=float(model.opt.timestep),
        substeps=cartpole.substeps,
        explicit=simulation.integrator == "gym",
        seen=arrays.seen.ctypes.data,
        moved=arrays.moved.ctypes.data,
        start=arrays.start.ctypes.data,
    )
