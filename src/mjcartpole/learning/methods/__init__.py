"""Learning methods: how a table learns, one file each.

A method is a module of plain functions over numbers and arrays. The Python engine calls them, the
compiled engine compiles them as they are, so they use what Numba knows: arithmetic, loops, other
functions of this package, and the draws of a `numpy.random.Generator`. `Method` says which.
"""

import importlib
from collections.abc import Callable
from typing import Any, Final, Protocol, cast

import gymnasium
import numpy as np
import numpy.typing as npt

from mjcartpole.errors import check_known
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.fitted import Fitted
from mjcartpole.learning.methods.experience import Dynamics, Rng, Trajectory, Transition
from mjcartpole.learning.methods.parameters import Parameters


class Method(Protocol):
    """What the module of a method has.

    In each function `p` is a `Numbers`, `memory` is what `make_memory` made, `rates` what
    `begin_episode` returned, and `rng` the learner's generator.
    """

    Parameters: type[Parameters]
    """A frozen dataclass: each field has a default, and a docstring that is the flag's help."""
    Numbers: Any
    """The same for the functions: `numbers_class(Parameters, __name__)`."""

    def make_memory(self, p: Any, n_rows: int, rng: Rng) -> Any:
        """Return a NamedTuple of flat arrays: all that learning changes."""

    plan: Callable[[Any, Any, Discretizer, Dynamics], None]
    """What a method has that learns before the first episode: from p, memory, the grid, and what
    a step does in any state. Others need not have it."""

    check_memory: Callable[[Any, Any], None]
    """What a method has whose memory could contradict itself: raises ValueError, and names the
    field. What each field may hold stands in its type (see `limits`). Others need not have it."""

    imagine: Callable[[Any, Any, gymnasium.Env[Any, Any], float, Rng], Fitted]
    """What a method has whose episodes are played in a model of the world: from p, memory, the
    world, the seconds of its control step and the learner's generator to that model, which memory
    keeps. Others need not have it."""

    def begin_episode(self, p: Any, memory: Any, number: int, episodes: int) -> Any:
        """Return a NamedTuple of what holds during one of so many episodes, counted from 0."""

    def act(self, p: Any, memory: Any, rates: Any, s: int, rng: Rng) -> int:
        """Return the action in a state, a row of the table."""

    def after_step(self, p: Any, memory: Any, rates: Any, step: Transition, rng: Rng) -> None:
        """Learn from one step."""

    def after_episode(self, p: Any, memory: Any, rates: Any, episode: Trajectory, rng: Rng) -> None:
        """Learn from a whole episode."""

    def greedy_values(self, memory: Any) -> npt.NDArray[np.float64]:
        """Return the values of both actions, shape (n_rows, 2), by which a policy decides."""


METHODS: Final = (
    "q-learning",
    "sarsa",
    "expected-sarsa",
    "n-step-sarsa",
    "double-q",
    "prioritized-replay",
    "prioritized-sweeping",
    "model",
    "reinforce",
    "actor-critic",
    "planning",
    "identify",
)
"""Every method by its name; its module, a `Method`, is called alike and imported when asked for."""


def method_named(name: str) -> Method:
    """Return the method of a name.

    Raises:
        ConfigError: There is none.
    """
    check_known("method", name, METHODS)
    return cast(Method, importlib.import_module(f"{__name__}.{name.replace('-', '_')}"))
