"""A learner: a method at work, with its parameters, its memory and its generator."""

import math
from typing import Any, Final

import gymnasium
import numpy as np
import numpy.typing as npt

from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.fitted import Fitted
from mjcartpole.learning.methods import method_named
from mjcartpole.learning.methods.experience import Dynamics
from mjcartpole.learning.methods.limits import check_limits
from mjcartpole.learning.methods.parameters import numbers_of
from mjcartpole.learning.tiles import tiles_of
from mjcartpole.task import N_ACTIONS

STREAM: Final = 1
"""Spawn key of the learner's generator: its draws are independent of the env's."""


class Learner:
    """What learns in a training.

    Attributes:
        discretizer: From observations to the method's states.
        method: The functions of the method.
        p: Its parameters as numbers.
        memory: A NamedTuple of flat arrays, which are changed in place.
        rng: The learner's own generator.
        visits: How often each action was taken in each state, flat, shape (bins times 2,); of
            several tilings in that which is not moved, of nodes in the nearest (see `tiles.home`).
        episodes: How many episodes the whole training has: schedules need it.
    """

    def __init__(self, config: TrainConfig, discretizer: Discretizer) -> None:
        """Begin with what has learned nothing, for the states of a grid."""
        self.method: Any = method_named(config.method)
        self.p = numbers_of(config, self.method.Numbers, tiles_of(discretizer))
        self.rng = np.random.default_rng(np.random.SeedSequence(config.seed, spawn_key=(STREAM,)))
        self.memory = self.method.make_memory(self.p, discretizer.n_rows, self.rng)
        self.visits = np.zeros(math.prod(discretizer.bins) * N_ACTIONS, np.int64)
        self.episodes = config.episodes
        self.discretizer = discretizer

    def check(self, memory: dict[str, npt.NDArray[Any]]) -> None:
        """Refuse a memory that no training can have come to (ValueError; names the field)."""
        found = type(self.memory)(**memory)
        check_limits(found, self.discretizer)
        if hasattr(self.method, "check_memory"):
            self.method.check_memory(self.p, found)

    @property
    def plans(self) -> bool:
        """Whether the method learns from equations before the first episode."""
        return hasattr(self.method, "plan")

    def plan(self, dynamics: Dynamics) -> None:
        """Learn from equations."""
        self.method.plan(self.p, self.memory, self.discretizer, dynamics)

    @property
    def dreams(self) -> bool:
        """Whether the method's episodes are played in a model that it fits to the world."""
        return hasattr(self.method, "imagine")

    @property
    def seen(self) -> tuple[int, int] | None:
        """How many episodes and steps of the world a model was fitted to; None without one."""
        if not self.dreams:
            return None
        episodes, steps = self.memory.seen.tolist()
        return episodes, steps

    def imagine(self, env: gymnasium.Env[Any, Any], h: float) -> Fitted:
        """Return the model of a world with a control step of h seconds, fitted if it was not."""
        fitted: Fitted = self.method.imagine(self.p, self.memory, env, h, self.rng)
        return fitted

    @property
    def greedy_values(self) -> npt.NDArray[np.float64]:
        """Values of both actions, shape (n_rows, 2), by which a policy decides."""
        values: npt.NDArray[np.float64] = self.method.greedy_values(self.memory)
        return values

    def quick_memory(self) -> Any:
        """Return views of the memory that Python reads several times faster than arrays."""
        return type(self.memory)(*(array.data for array in self.memory))
