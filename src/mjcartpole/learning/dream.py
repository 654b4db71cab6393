"""Learning in a model of the world: what is seen of the world, and episodes in what was fitted."""

from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from mjcartpole.learning.fitted import Fitted, Linear, Seen, linear_step, rod_step
from mjcartpole.task import N_ACTIONS, Task

Observation = npt.NDArray[np.float32]


def look(env: gymnasium.Env[Any, Any], steps: int, rng: np.random.Generator) -> tuple[Seen, int]:
    """Play random actions in the world; returns what was seen, and in how many episodes.

    So many steps in as many episodes as that takes; below 0: the first episode.

    Raises:
        SimulationError: The physics diverged.
    """
    before, actions, after = list[Any](), list[int](), list[Any]()
    episodes, over = 0, True
    while len(actions) != steps and not (steps < 0 and episodes and over):
        if over:
            state, episodes = env.reset()[0].astype(np.float64), episodes + 1
        actions.append(int(rng.random() * N_ACTIONS))
        before.append(state)
        observation, _, terminated, truncated, _ = env.step(actions[-1])
        state, over = observation.astype(np.float64), terminated or truncated
        after.append(state)
    return Seen(np.array(before), np.array(actions), np.array(after)), episodes


class Dream(gymnasium.Env[Observation, np.int64]):
    """Episodes of a fitted model under the rules of a task, time limit included."""

    def __init__(self, fitted: Fitted, task: Task) -> None:
        self.observation_space = spaces.Box(-(b := task.observation_bound()), b, dtype=np.float32)
        self.action_space = spaces.Discrete(N_ACTIONS)
        self.x_threshold = task.x_limit
        self._fitted, self._task, self._steps = fitted, task, 0
        self._advance: Any = linear_step if isinstance(fitted, Linear) else rod_step

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode where the task does."""
        super().reset(seed=seed)
        self._steps = 0
        low, high = self._task.start_low, self._task.start_high
        x, x_dot, theta, theta_dot = self.np_random.uniform(low, high, 4).tolist()
        self.state = x, x_dot, theta + self._task.start_angle, theta_dot
        return self._seen().astype(np.float32), {}

    def step(self, action: np.int64) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Advance one control step."""
        self.state = self._advance(self._fitted, self.state, action)
        seen = self._seen()
        x, x_dot, theta, theta_dot = seen.tolist()
        terminated = self._task.has_ended(x, theta)
        reward = self._task.reward(x, x_dot, theta, theta_dot, terminated)
        self._steps += 1
        over = self._steps == self._task.time_limit
        return seen.astype(np.float32), reward, terminated, over, {}

    def _seen(self) -> npt.NDArray[np.float64]:
        """The state; of a pole that may turn right round, the angle counts from -pi to pi."""
        return self._task.seen(np.array(self.state))
