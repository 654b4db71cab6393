"""The same cart-pole behind dm_control's environment; an ImportError where that does not load."""

import warnings
from typing import Any

import numpy as np

# It says why, and does so before the first model is opened.
import mjcartpole.envs.dm  # noqa: F401
from mjcartpole.physics.load import load_model
from mjcartpole.task import CARTPOLE_V1

with warnings.catch_warnings():
    # dm_control opens a window library, which complains where there is no screen.
    warnings.simplefilter("ignore")
    from dm_control import mujoco
    from dm_control.rl import control


class Balance(control.Task):  # type: ignore[misc]
    """CartPole-v1's rules as a task of dm_control."""

    def __init__(self) -> None:
        """Seed the starting states."""
        self._random = np.random.default_rng(0)

    def initialize_episode(self, physics: Any) -> None:  # noqa: ANN401
        """Draw a starting state."""
        low, high = CARTPOLE_V1.start_low, CARTPOLE_V1.start_high
        physics.data.qpos[:] = self._random.uniform(low, high, 2)
        physics.data.qvel[:] = self._random.uniform(low, high, 2)

    def before_step(self, action: Any, physics: Any) -> None:  # noqa: ANN401
        """Push."""
        physics.set_control(action)

    def action_spec(self, physics: Any) -> Any:  # noqa: ANN401
        """One control."""
        return mujoco.action_spec(physics)

    def get_observation(self, physics: Any) -> dict[str, Any]:  # noqa: ANN401
        """The state."""
        return {"position": physics.position(), "velocity": physics.velocity()}

    def get_reward(self, physics: Any) -> float:  # noqa: ANN401
        """1 for every step."""
        return 1.0

    def get_termination(self, physics: Any) -> float | None:  # noqa: ANN401
        """0 where the rules end the episode, else None."""
        x, theta = physics.data.qpos
        return 0.0 if CARTPOLE_V1.has_ended(x, theta) else None


def dm_control_environment() -> control.Environment:
    """The reference model behind dm_control's Environment."""
    physics = mujoco.Physics.from_xml_string(load_model().xml)
    return control.Environment(physics, Balance(), time_limit=10.0)
