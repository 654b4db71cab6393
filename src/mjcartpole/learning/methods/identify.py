"""System identification: a model is fitted to a few random steps, and the table learned in it.

Before the first episode some random steps are played in the world, and a model is fitted to them by
least squares (see `fitted.py`; Ljung, 1999, "System Identification"). All episodes are played in
that model, and Q-learning learns from them as it does anywhere (Sutton, 1990, Dyna, with nothing
learned from the world itself).
"""

from dataclasses import dataclass
from typing import Any, ClassVar, Literal, NamedTuple

import gymnasium
import numpy as np

from mjcartpole.errors import ConfigError
from mjcartpole.learning.dream import look
from mjcartpole.learning.fitted import Fitted, Linear, Rod, fit_linear, fit_rod
from mjcartpole.learning.methods import q_learning
from mjcartpole.learning.methods.action_values import FloatMemory, draw_table, greedy_values
from mjcartpole.learning.methods.experience import Rng
from mjcartpole.learning.methods.limits import StepCounts
from mjcartpole.learning.methods.parameters import numbers_class
from mjcartpole.learning.methods.q_learning import act, after_episode, after_step, begin_episode
from mjcartpole.learning.tiles import Table
from mjcartpole.task import Task, in_words

__all__ = ["act", "after_episode", "after_step", "begin_episode", "greedy_values"]

Fit = Literal["rod", "linear"]
"""What is fitted: a rod's own equations, or a linear model without physics."""

ROD_STEPS = 3
"""Each gives two equations, for two unknowns and two."""


@dataclass(frozen=True, kw_only=True)
class Parameters(q_learning.Parameters):
    """Those of Q-learning, what is fitted, and to what."""

    episode: ClassVar[str] = "dreamt episode"

    # Nothing is random in a dream but what explores: the far future can be told, and last
    # episodes that are greedy show a cart that rolls away where exploring steps would stop it.
    gamma: float = 0.99
    """Discount per step."""
    alpha_final: float = 0.01
    """Step size once decayed."""
    td_lambda: float | None = 0.9
    """Learn after each episode from lambda-returns with this lambda; None: after each step."""
    epsilon_final: float = 0.0
    """Probability of a random action once decayed."""
    fit: Fit = "rod"
    """The model that is fitted: the equations of a cart with a rod, or a linear one."""
    fit_steps: int | None = None
    """Random steps in the world that it is fitted to, in as many episodes as that takes; left out:
    3 for a rod, one episode for a linear model."""

    def check_parameters(self) -> None:
        """Refuse values that make no sense (ConfigError)."""
        super().check_parameters()
        self._check_one_of("fit", ("rod", "linear"))
        if self.fit_steps is not None:
            self._check_whole("fit_steps", 1, 1_000_000)

    def check_world(self, poles: int, task: Task) -> None:
        """Refuse what the model cannot be one of (ConfigError)."""
        if poles != 1:
            raise ConfigError(
                f"method 'identify' fits a cart with 1 pole, and the model has {in_words(poles)}; "
                "take another method"
            )
        if self.fit == "linear" and task.theta_limit > np.pi / 4:
            limit = f"{task.theta_limit:.3g} rad" if np.isfinite(task.theta_limit) else "any angle"
            raise ConfigError(
                f"a linear model holds near upright only, and {task.name} lets the pole lean by "
                f"{limit}; take fit 'rod'"
            )


Numbers = numbers_class(Parameters, __name__)


class Memory(NamedTuple):
    """The table, and the model that it is learned in."""

    q_table: Table
    model: FloatMemory
    """Its numbers, one after the other."""
    seen: StepCounts
    """How many episodes and steps of the world it was fitted to; 0 as long as it was not."""


def make_memory(p: Any, n_rows: int, rng: Rng) -> Memory:
    """Return a table to begin with, and no model."""
    size = 6 if p.fit == 0 else 16
    return Memory(draw_table(p, n_rows, rng), np.zeros(size), np.zeros(2, np.int64))


def imagine(p: Any, memory: Memory, env: gymnasium.Env[Any, Any], h: float, rng: Rng) -> Fitted:
    """Return the model that episodes are played in; fit it, where that was not done yet."""
    model, is_rod = np.asarray(memory.model), p.fit == 0
    if not memory.seen[0]:
        steps = ROD_STEPS if p.fit_steps < 0 and is_rod else p.fit_steps
        seen, episodes = look(env, steps, rng)
        model[:] = np.ravel((fit_rod(seen, h) if is_rod else fit_linear(seen))[:-1])
        memory.seen[0], memory.seen[1] = episodes, len(seen.actions)
    if is_rod:
        return Rod(*model.tolist())
    a, b, c, d = map(tuple, model.reshape(4, 4).tolist())
    return Linear(a, b, c, d)
