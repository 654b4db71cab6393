"""Gymnasium's own CartPole-v1 under the rules of another task."""

from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from mjcartpole.disturbances.disturbances import NONE, Disturbances
from mjcartpole.envs.actions import action_space, invalid, push_of
from mjcartpole.task import Task, control_of

if TYPE_CHECKING:
    from mjcartpole.envs.disturber import Disturber

Observation = npt.NDArray[np.float32]


class GymTask(gymnasium.Wrapper[Observation, np.int64, Observation, np.int64]):
    """CartPole-v1's equations with the limits, starting states and rewards of a task.

    The wrapped environment has the task's time limit. `disturber` adds the disturbances; it is None
    where nothing is added.
    """

    def __init__(
        self,
        env: gymnasium.Env[Observation, np.int64],
        task: Task,
        disturbances: Disturbances = NONE,
    ) -> None:
        super().__init__(env)
        self.disturber = _disturber(disturbances, task) if disturbances.are_some else None
        self._task, self._cartpole = task, env.unwrapped
        self._force: float = self._cartpole.force_mag  # type: ignore[attr-defined]
        self._cartpole.x_threshold = task.x_limit  # type: ignore[attr-defined]
        self._cartpole.theta_threshold_radians = task.theta_limit  # type: ignore[attr-defined]
        bound = task.observation_bound()
        self.action_space = action_space(task)
        space = spaces.Box(-bound, bound, dtype=np.float32)
        seen: Any = self.disturber.space(space) if self.disturber else space
        self.observation_space = seen

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode where the task does, unless the options say otherwise."""
        bounds = {"low": self._task.start_low, "high": self._task.start_high}
        _, info = self.env.reset(seed=seed, options=bounds | (options or {}))
        if self._task.start_angle:
            x, x_dot, theta, theta_dot = self._cartpole.state  # type: ignore[attr-defined]
            state = np.array([x, x_dot, theta + self._task.start_angle, theta_dot])
            self._cartpole.state = state  # type: ignore[attr-defined]
        if self.disturber:
            self.disturber.draw(self._cartpole.np_random)
            self.disturber.forget()
        return self._observed(self._seen()), info

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:  # noqa: ANN401
        """Advance one control step; the reward is the task's.

        Raises:
            InvalidActionError: A push is none.
        """
        if self._task.continuous or self.disturber:
            # Action 1 has the force of this step.
            self._cartpole.force_mag = self._force_of(action)  # type: ignore[attr-defined]
            action = 1
        _, _, terminated, truncated, info = self.env.step(action)
        seen = self._seen()
        x, x_dot, theta, theta_dot = seen.tolist()
        reward = self._task.reward(x, x_dot, theta, theta_dot, terminated)
        return self._observed(seen), reward, terminated, truncated, info

    def _force_of(self, action: Any) -> float:  # noqa: ANN401
        """The force that an action comes to, N."""
        known = self._task.continuous or self.action_space.contains(action)
        if not known:
            raise invalid(action)
        push, force = push_of(action) if self._task.continuous else 2.0 * action - 1.0, 0.0
        if self.disturber:
            push, force = self.disturber.actuate(float(push))
        return control_of(push, (-self._force, self._force)) + force

    def _observed(self, seen: npt.NDArray[np.float64]) -> Observation:
        return self.disturber.observe(seen, "state") if self.disturber else seen.astype(np.float32)

    def _seen(self) -> npt.NDArray[np.float64]:
        """The state as the rules have it."""
        state = np.array(self._cartpole.state, dtype=np.float64)  # type: ignore[attr-defined]
        return self._task.seen(state)


def _disturber(disturbances: Disturbances, task: Task) -> "Disturber":
    from mjcartpole.envs.disturber import Disturber  # noqa: PLC0415 - it imports MuJoCo

    return Disturber(disturbances, None, task)
