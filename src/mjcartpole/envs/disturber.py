"""Disturbances at work in one environment of plain Python."""

import contextlib
import copy
from collections.abc import Callable, Iterator
from typing import Any, Self

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from mjcartpole.disturbances.contexts import Chance, Context, Contexts
from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.disturbances.effects import QUEUE, actuate, forget, sense
from mjcartpole.envs.observations import Observation, Observed, with_cosines
from mjcartpole.errors import ResetNeededError
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.edit.edits import edits_of
from mjcartpole.physics.load import Edits
from mjcartpole.physics.simulation import Simulation, State
from mjcartpole.physics.variants import contexts_of, effects_on
from mjcartpole.task import Task, control_of


class Disturber:
    """What draws disturbances, and what an episode remembers of them.

    Attributes:
        disturbances: What is added.
        context: What this episode has drawn; empty where nothing varies.
    """

    def __init__(
        self, disturbances: Disturbances, cartpole: CartPole | None, task: Task, index: int = 0
    ) -> None:
        """Begin before the first episode of one environment, or of several with one generator.

        What moves, or what models are variants of, is a cart-pole; None on gymnasium's equations.

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

    @classmethod
    def where_needed(
        cls, disturbances: Disturbances, cartpole: CartPole | None, task: Task
    ) -> Self | None:
        """Return one; None where nothing is added."""
        return cls(disturbances, cartpole, task) if disturbances.are_some else None

    def __copy__(self) -> Self:
        """A copy that goes on by itself, for an environment with the same generator."""
        return copy.deepcopy(self, {id(self._source): self._source})

    def fit(self, cartpole: CartPole | None) -> None:
        """Let all times be those of a model, before an episode."""
        self.effects, self.memory = effects_on(cartpole, self.disturbances, self._task)

    def follow(
        self, np_random: np.random.Generator, chance: Chance | None = None, episode: int = 0
    ) -> None:
        """Draw as the environment with this generator does; where it has that already, go on.

        Disturbances are drawn by `chance`, made from the generator if left out; the episode is the
        next one, counted from 0.
        """
        if chance or np_random is not self._source:
            self._source, self._episode = np_random, episode
            self._chance = chance or Chance.of(np_random, self._index)

    @contextlib.contextmanager
    def undrawn(self) -> Iterator[None]:
        """Take back, in the end, what is drawn for steps meanwhile; contexts are drawn."""
        chance = self._chance
        before = chance.rng.bit_generator.state if chance else None
        yield
        if chance and before:
            chance.rng.bit_generator.state = before

    def draw(self, np_random: np.random.Generator, edits: Edits = None) -> Context:
        """Return the context of the next episode; what is edited for it is not drawn."""
        self.follow(np_random)
        if self._contexts and self._chance:
            drawn, fixed = (
                self._chance.context(self._contexts, self._episode),
                edits_of(edits or ()),
            )
            self.context = {name: float(fixed.get(name, drawn[name])) for name in drawn}  # type: ignore[arg-type]
        self._episode += 1
        return self.context

    def forget(self) -> None:
        """Leave nothing of the motion before."""
        forget(self.effects, self.memory)

    def actuate(self, push: float) -> tuple[float, float]:
        """Return what the motor makes of a push, and a force besides, N."""
        return actuate(self.effects, self.memory, push, self._rng)

    def wires(
        self, simulation: Simulation, see: Callable[[float], State], kind: Observation
    ) -> tuple[Callable[[float], State], Callable[[], Observed]]:
        """Return what moves a simulation by a push, and what observes it (see `observed`).

        To see is to move it by a control.
        """
        applied, slider = simulation.data.qfrc_applied, simulation.cartpole.slider
        controls = simulation.cartpole.controls

        def move(push: float) -> State:
            made, applied[slider] = self.actuate(push)
            return see(control_of(made, controls))

        return move, lambda: self.observe(self._task.seen(simulation.state), kind)

    def sense(self, state: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Return what is seen of a state as rules have it."""
        seen = [*state.tolist(), *[0.0] * self.effects.actions]
        sense(self.effects, self.memory, seen, self._rng)
        return np.array(seen[: self.effects.size])

    @property
    def seen_besides(self) -> list[float]:
        """What is seen besides the state: the last actions, and the context."""
        first = QUEUE + self.effects.delay
        actions = self.memory[first : first + self.effects.actions]
        return [*actions, *(self.context.values() if self.disturbances.observe_context else ())]

    def observe(self, state: npt.NDArray[np.float64], kind: Observation) -> Observed:
        """Return the observation of a state as rules have it; see `observed` for the kind."""
        seen = self.sense(state)
        seen = with_cosines(seen) if kind == "trig" else seen
        return np.array([*seen.tolist(), *self.seen_besides], dtype=np.float32)

    def first(
        self, state: npt.NDArray[np.float64], kind: Observation
    ) -> tuple[Observed, dict[str, Any]]:
        """Return what a reset does: the observation of a starting state, and what was drawn."""
        self.forget()
        return self.observe(state, kind), {"context": dict(self.context)} if self.varies else {}

    @property
    def varies(self) -> bool:
        """Whether each episode draws a model."""
        return self._contexts is not None

    @property
    def is_drawing(self) -> bool:
        """Whether a first episode has begun."""
        return self._chance is not None

    @property
    def _rng(self) -> np.random.Generator:
        if self._chance is None:
            raise ResetNeededError("Call reset before using step method.")
        return self._chance.rng

    def space(self, space: spaces.Box) -> spaces.Box:
        """Return the space of what is seen where undisturbed it is this one."""
        low, high = space.low, space.high
        if self.disturbances.blur_sensors:
            # A cosine stays one, however wrong its angle is.
            low, high = (np.where(np.abs(each) == 1.0, each, each * np.inf) for each in (low, high))
        ends = [(-1.0, 1.0)] * self.effects.actions
        if self.disturbances.observe_context:
            ends += [(min(each.bounds), max(each.bounds)) for each in self.disturbances.ranges]
        lows, highs = np.array(ends, np.float32).reshape(-1, 2).T
        return spaces.Box(
            np.concatenate([low, lows]), np.concatenate([high, highs]), dtype=np.float32
        )
