"""One-step Q-learning on a table (Watkins, 1989; Sutton and Barto, 2018, section 6.5).

    Q(s, a)  <-  Q(s, a) + alpha (r + gamma max_a' Q(s', a') - Q(s, a))

A terminated episode has no future, so its last target is `r` alone. A truncated one would have
gone on, so it bootstraps like any other step.
"""

from collections.abc import Callable
from typing import Literal

import numpy as np
import numpy.typing as npt

from mjcartpole.learning.schedules import LinearSchedule
from mjcartpole.task import N_ACTIONS

Ties = Literal["first", "random"]
"""What to do between two actions of equal value: take action 0, or draw one."""


class TabularQ:
    """An epsilon-greedy Q-learner.

    Attributes:
        q_table: The table, shape (n_states, 2), float64.
        alpha: Step size in the current episode.
        epsilon: Probability of a random action in the current episode.
    """

    def __init__(
        self,
        q_table: npt.NDArray[np.float64],
        *,
        gamma: float,
        alpha: LinearSchedule,
        epsilon: LinearSchedule,
        ties: Ties,
        learn_last_step: bool,
        rng: np.random.Generator,
    ) -> None:
        """Take over a table; it is changed in place.

        Args:
            q_table: Initial values, shape (n_states, 2), C-ordered.
            gamma: Discount per step.
            alpha: Step size per episode.
            epsilon: Exploration per episode.
            ties: How to choose between equal values.
            learn_last_step: Whether the step that ends an episode is learned from at all. The
                article's code skips it, and with it the only sign of failure there is.
            rng: Draws explorations and ties; one number per step, one more per random action.
        """
        self.q_table = q_table
        self.gamma = gamma
        self.alpha = alpha(0)
        self.epsilon = epsilon(0)
        self.learn_last_step = learn_last_step
        self._alpha_schedule = alpha
        self._epsilon_schedule = epsilon
        self._draw_ties = ties == "random"
        self._random: Callable[[], float] = rng.random
        # A flat memory view reads one float several times faster than the array does.
        self._q: memoryview[float] = q_table.reshape(-1).data.cast("B").cast("d")

    def begin_episode(self, episode: int) -> None:
        """Set step size and exploration for an episode, counted from 0."""
        self.alpha = self._alpha_schedule(episode)
        self.epsilon = self._epsilon_schedule(episode)

    def act(self, s: int) -> int:
        """Choose an action in a state: random with probability epsilon, else the better one."""
        if self._random() < self.epsilon:
            return int(self._random() * N_ACTIONS)
        left, right = self._q[2 * s], self._q[2 * s + 1]
        if left == right and self._draw_ties:
            return int(self._random() * N_ACTIONS)
        return 1 if right > left else 0

    def update(self, s: int, a: int, r: float, s_next: int, terminated: bool) -> None:
        """Learn from one step."""
        q = self._q
        target = r
        if not terminated:
            target += self.gamma * max(q[2 * s_next], q[2 * s_next + 1])
        q[2 * s + a] += self.alpha * (target - q[2 * s + a])
