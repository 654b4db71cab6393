"""Disturbances at work in one environment of plain Python."""

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from mjcartpole.disturbances.contexts import Chance, Context, Contexts
from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.disturbances.effects import Effects, actuate, forget, sense
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.variants import contexts_of
from mjcartpole.task import CONTROL_STEP, Task, control_of

Observation = npt.NDArray[np.float32]


class Disturber:
    """What draws disturbances, and what an episode remembers of them.

    Attributes:
        disturbances: What is added.
        context: What this episode has drawn; empty where nothing varies.
    """

    def __init__(
        self, disturbances: Disturbances, cartpole: CartPole | None, task: Task, index: int = 0
    ) -> None:
        """Begin before the first episode.

        Args:
            disturbances: What is added.
            cartpole: What moves, or what models are variants of; None on gymnasium's equations.
            task: The rules.
            index: Which of several environments with one generator.

        Raises:
            ConfigError: Some of it makes no sense for this model and these rules.
        """
        self.disturbances, self.context = disturbances, Context()
        self._task, self._index = task, index
        self._contexts: Contexts | None = None
        if disturbances.vary and cartpole:
            self._contexts = contexts_of(cartpole, disturbances)
        self._source: np.random.Generator | None = None
        self._episode = 0
        self._chance: Chance | None = None
        self.fit(cartpole)

    def fit(self, cartpole: CartPole | None) -> None:
        """Let all times be those of a model."""
        poles, step = (cartpole.poles, cartpole.control_step) if cartpole else (1, CONTROL_STEP)
        made: tuple[Effects, list[float]] = self.disturbances.effects(poles, step, self._task)
        self.effects, self.memory = made

    def follow(
        self, np_random: np.random.Generator, chance: Chance | None = None, episode: int = 0
    ) -> None:
        """Draw as the environment with this generator does; where it has that already, go on.

        Args:
            np_random: The environment's own.
            chance: Draws the disturbances; made from the generator if left out.
            episode: The next one, counted from 0.
        """
        if chance or np_random is not self._source:
            self._source, self._episode = np_random, episode
            self._chance = chance or Chance.of(np_random, self._index)

    def begin(self, np_random: np.random.Generator) -> Context:
        """Begin an episode; returns its context."""
        self.follow(np_random)
        if self._contexts and self._chance:
            self.context = self._chance.context(self._contexts, self._episode)
        self._episode += 1
        forget(self.effects, self.memory)
        return self.context

    def actuate(self, push: float) -> tuple[float, float]:
        """Return what the motor makes of a push, and a force besides, N."""
        assert self._chance
        return actuate(self.effects, self.memory, push, self._chance.rng)

    def sense(self, state: npt.NDArray[np.float64]) -> Observation:
        """Return what is seen of a state as rules have it."""
        assert self._chance
        seen = [*state.tolist(), *[0.0] * self.effects.actions]
        sense(self.effects, self.memory, seen, self._chance.rng)
        return np.array([*seen, *self.seen_context], dtype=np.float32)

    @property
    def seen_context(self) -> list[float]:
        """What is seen of the context."""
        return list(self.context.values()) if self.disturbances.observe_context else []

    @property
    def info(self) -> dict[str, Any]:
        """What a reset tells."""
        return {"context": dict(self.context)} if self._contexts else {}

    def space(self, space: spaces.Box) -> spaces.Box:
        """Return the space of what is seen where undisturbed it is this one."""
        high = np.full_like(space.high, np.inf) if self.disturbances.blur_sensors else space.high
        low = np.full_like(space.low, -np.inf) if self.disturbances.blur_sensors else space.low
        ends = [(-1.0, 1.0)] * self.effects.actions
        if self.disturbances.observe_context:
            ends += [(min(each.bounds), max(each.bounds)) for each in self.disturbances.ranges]
        lows, highs = np.array(ends, np.float32).reshape(-1, 2).T
        return spaces.Box(
            np.concatenate([low, lows]), np.concatenate([high, highs]), dtype=np.float32
        )


def pushed(
    disturber: Disturber, see: Callable[[float], Any], applied: Any, slider: int, controls: Any  # noqa: ANN401
) -> Callable[[float], Any]:
    """Return what moves a simulation by a push, through the motor as it is disturbed.

    Args:
        disturber: Disturbs.
        see: Moves it by a control.
        applied: Its forces beside the motor's, by joint.
        slider: The cart's joint.
        controls: Those of the two actions.
    """

    def move(push: float) -> Any:  # noqa: ANN401
        made, applied[slider] = disturber.actuate(push)
        return see(control_of(made, controls))

    return move
