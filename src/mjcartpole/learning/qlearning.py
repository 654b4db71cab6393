"""Q-learning on a table: after each step, or after each episode from lambda-returns.

One-step Q-learning (Watkins, 1989; Sutton and Barto, 2018, section 6.5):

    Q(s, a)  <-  Q(s, a) + alpha (G - Q(s, a)),    G = r + gamma max_a' Q(s', a')

With a lambda, an episode is learned when it is over, backwards, so that its end reaches its
beginning at once (Peng and Williams, 1996, doi:10.1007/BF00114731, in its forward view):

    G_t = r_t + gamma ((1 - lambda) max_a' Q(s_t+1, a') + lambda G_t+1)

A terminated episode has no future, so its last target is `r` alone. A truncated one would have
gone on, so it bootstraps like any other step.
"""

from collections.abc import Sequence
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from mjcartpole.learning.discretizer import Floats, Ints
from mjcartpole.learning.schedules import LinearSchedule
from mjcartpole.task import N_ACTIONS

Ties = Literal["first", "random"]
"""What to do between two actions of equal value: take action 0, or draw one."""

Table: TypeAlias = "memoryview[float] | npt.NDArray[np.float64]"
"""A flat table, shape (2 n_states,): the compiled loop has the array, Python a quicker view."""


class TabularQ:
    """An epsilon-greedy Q-learner.

    Attributes:
        q_table: The table, shape (n_states, 2), float64.
        alpha: Step size in the current episode.
        epsilon: Probability of a random action in the current episode.
        alpha_schedule: Step size per episode.
        epsilon_schedule: Exploration per episode.
        rng: The learner's own generator.
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
        td_lambda: float | None,
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
            td_lambda: Lambda of the returns; None learns after each step.
            rng: Draws explorations and ties; one number per step, one more per random action.
        """
        self.q_table = q_table
        self.gamma = gamma
        self.alpha = alpha(0)
        self.epsilon = epsilon(0)
        self.learn_last_step = learn_last_step
        self.td_lambda = td_lambda
        self.alpha_schedule = alpha
        self.epsilon_schedule = epsilon
        self.draw_ties = ties == "random"
        self.rng = rng
        # A flat memory view reads one float several times faster than the array does.
        self._q: Table = q_table.reshape(-1).data.cast("B").cast("d")

    def begin_episode(self, episode: int) -> None:
        """Set step size and exploration for an episode, counted from 0."""
        self.alpha = self.alpha_schedule(episode)
        self.epsilon = self.epsilon_schedule(episode)

    def act(self, s: int) -> int:
        """Choose an action in a state: random with probability epsilon, else the better one."""
        return choose(self._q, s, self.epsilon, self.draw_ties, self.rng)

    def update(self, s: int, a: int, r: float, s_next: int, terminated: bool) -> None:
        """Learn from one step."""
        learn_step(self._q, s, a, r, s_next, terminated, self.alpha, self.gamma)

    def replay(
        self, states: Sequence[int], actions: Sequence[int], rewards: Sequence[float], over: bool
    ) -> None:
        """Learn from an episode, backwards, by lambda-returns.

        Args:
            states: From the first to the last, one more than actions.
            actions: What was done in each but the last.
            rewards: What it gave.
            over: Whether nothing comes after the last state, because the episode terminated.
        """
        assert self.td_lambda is not None
        steps = len(actions)
        learn_episode(
            self._q, states, actions, rewards, steps, over, self.alpha, self.gamma, self.td_lambda
        )


# The method itself. Numba compiles these as they are, so the compiled loop learns the same.


def choose(q: Table, s: int, epsilon: float, draw_ties: bool, rng: np.random.Generator) -> int:
    """An action in a state: random with probability epsilon, else the better one.

    Args:
        q: Action values, flat: those of state s at 2 s and 2 s + 1.
        s: The state.
        epsilon: Probability of a random action.
        draw_ties: Draw one of two equal actions, instead of taking the first.
        rng: Gives one number, and one more for a random action.
    """
    if rng.random() < epsilon:
        return int(rng.random() * N_ACTIONS)
    left, right = q[2 * s], q[2 * s + 1]
    if left == right and draw_ties:
        return int(rng.random() * N_ACTIONS)
    return 1 if right > left else 0


def learn_step(
    q: Table,
    s: int,
    a: int,
    r: float,
    s_next: int,
    terminated: bool,
    alpha: float,
    gamma: float,
) -> None:
    """Move the value of one step towards its target (see the module)."""
    target = r
    if not terminated:
        target += gamma * max(q[2 * s_next], q[2 * s_next + 1])
    q[2 * s + a] += alpha * (target - q[2 * s + a])


def learn_episode(
    q: Table,
    states: Ints,
    actions: Ints,
    rewards: Floats,
    steps: int,
    over: bool,
    alpha: float,
    gamma: float,
    lam: float,
) -> None:
    """Move the values of the first `steps` steps, last one first, to their lambda-returns."""
    s = states[steps]
    future = 0.0 if over else max(q[2 * s], q[2 * s + 1])
    for t in range(steps - 1, -1, -1):
        s, a = states[t], actions[t]
        target = rewards[t] + gamma * future
        q[2 * s + a] += alpha * (target - q[2 * s + a])
        future = (1 - lam) * max(q[2 * s], q[2 * s + 1]) + lam * target
