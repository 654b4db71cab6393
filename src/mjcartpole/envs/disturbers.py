"""Disturbances at work in many environments that move as one."""

from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.envs.disturber import Disturber
from mjcartpole.envs.observations import Observation, Observed
from mjcartpole.errors import ConfigError
from mjcartpole.physics.batch_simulation import BatchSimulation
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.variants import variant
from mjcartpole.task import Task, control_of

Ids = npt.NDArray[np.intp]


class Disturbers:
    """A `Disturber` for each of many environments; one draws as a single environment does.

    Attributes:
        members: They themselves.
        cartpoles: What each environment moves.
    """

    def __init__(
        self, disturbances: Disturbances, cartpole: CartPole, task: Task, count: int
    ) -> None:
        """Begin before the first episodes.

        Raises:
            ConfigError: Some of it makes no sense for this model and these rules.
        """
        first = Disturber(disturbances, cartpole, task)
        others = (Disturber(disturbances, cartpole, task, index) for index in range(1, count))
        self.members = [first, *others]
        self.cartpoles = [cartpole] * count
        self._base, self._task = cartpole, task

    @property
    def vary(self) -> bool:
        """Whether each episode draws a model."""
        return self.members[0].varies

    def begin(
        self, who: Iterable[int], simulation: BatchSimulation, np_random: np.random.Generator
    ) -> None:
        """Begin episodes of some, before they are put into their starting states.

        Raises:
            ConfigError: Two models step by other timesteps.
        """
        for index in who:
            member = self.members[index]
            context = member.draw(np_random)
            if self.vary:
                self.cartpoles[index] = in_step(variant(self._base, context), self._base)
                member.fit(self.cartpoles[index])
            member.forget()
        if self.vary:
            simulation.set_models(self.cartpoles)

    def act(
        self, pushes: npt.NDArray[np.float64], resting: Ids, simulation: BatchSimulation
    ) -> npt.NDArray[np.float64]:
        """Return the controls that motors make of pushes from -1 to 1; forces besides are applied.

        The step of those that rest does not count.
        """
        controls, forces = np.zeros(len(pushes)), np.zeros(len(pushes))
        idle = set(resting.tolist())
        for index, (member, push) in enumerate(zip(self.members, pushes.tolist(), strict=True)):
            if index not in idle:
                made, forces[index] = member.actuate(push)
                controls[index] = control_of(made, self.cartpoles[index].controls)
        simulation.apply(forces)
        return controls

    def observe(
        self, who: Iterable[int], states: npt.NDArray[np.float64], kind: Observation
    ) -> Observed:
        """Return what some see of their states, one row each; see `observed`."""
        seen = self._task.seen(states)
        return np.array([self.members[index].observe(seen[index], kind) for index in who])

    def forget(self) -> None:
        """Leave nothing of the motion before."""
        for member in self.members:
            member.forget()

    def infos(self, who: Iterable[int]) -> list[tuple[int, dict[str, Any]]]:
        """What the resets of some tell."""
        return [(index, {"context": dict(self.members[index].context)}) for index in who]


def in_step(cartpole: CartPole, base: CartPole) -> CartPole:
    """Return a variant that steps as its base does.

    Raises:
        ConfigError: It does not.
    """
    if (cartpole.timestep, cartpole.substeps) != (base.timestep, base.substeps):
        raise ConfigError(
            "these environments keep one timestep; where it is to vary, take those of "
            'gymnasium.make, or make_vec(..., vectorization_mode="sync")'
        )
    return cartpole
