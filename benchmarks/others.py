"""The same cart-pole behind the environments of other libraries."""

import warnings
from typing import Any

import gymnasium
import mujoco
import numpy as np
from gymnasium.envs.mujoco import MujocoEnv

from mjcartpole import task
from mjcartpole.physics.model import find_model, load_model

with warnings.catch_warnings():
    # dm_control opens a window library, which complains where there is no screen.
    warnings.simplefilter("ignore")
    from dm_control import mujoco as dm_mujoco
    from dm_control.rl import control


class GymnasiumMujoco(MujocoEnv):
    """Gymnasium's base class for MuJoCo environments, as its own tasks use it."""

    metadata = {  # noqa: RUF012 - gymnasium's own declaration
        "render_modes": ["human", "rgb_array", "depth_array", "rgbd_tuple"],
        "render_fps": round(1 / task.CONTROL_STEP),
    }

    def __init__(self) -> None:
        """Load the reference model."""
        space = gymnasium.spaces.Box(-np.inf, np.inf, (4,), np.float64)
        super().__init__(str(find_model("cartpole")), 1, space)

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:  # noqa: ANN401
        """Advance 0.02 s."""
        self.do_simulation(np.array([1.0 if action == 1 else -1.0]), self.frame_skip)
        observation = self._observe()
        over = task.has_terminated(observation[0], observation[2])
        return observation, 1.0, over, False, {}

    def reset_model(self) -> Any:  # noqa: ANN401 - gymnasium's own signature
        """Draw a starting state."""
        low, high = task.RESET_LOW, task.RESET_HIGH
        qpos, qvel = (self.np_random.uniform(low, high, 2) for _ in range(2))
        self.set_state(qpos, qvel)  # type: ignore[no-untyped-call]
        return self._observe()

    def _observe(self) -> Any:  # noqa: ANN401
        qpos, qvel = self.data.qpos, self.data.qvel
        return np.array([qpos[0], qvel[0], qpos[1], qvel[1]])


class Balance(control.Task):  # type: ignore[misc]
    """CartPole-v1's rules as a task of dm_control."""

    def __init__(self) -> None:
        """Seed the starting states."""
        self._random = np.random.default_rng(0)

    def initialize_episode(self, physics: Any) -> None:  # noqa: ANN401
        """Draw a starting state."""
        low, high = task.RESET_LOW, task.RESET_HIGH
        physics.data.qpos[:] = self._random.uniform(low, high, 2)
        physics.data.qvel[:] = self._random.uniform(low, high, 2)

    def before_step(self, action: Any, physics: Any) -> None:  # noqa: ANN401
        """Push."""
        physics.set_control(action)

    def action_spec(self, physics: Any) -> Any:  # noqa: ANN401
        """One control."""
        return dm_mujoco.action_spec(physics)

    def get_observation(self, physics: Any) -> dict[str, Any]:  # noqa: ANN401
        """The state."""
        return {"position": physics.position(), "velocity": physics.velocity()}

    def get_reward(self, physics: Any) -> float:  # noqa: ANN401
        """1 for every step."""
        return 1.0

    def get_termination(self, physics: Any) -> float | None:  # noqa: ANN401
        """0 where the rules end the episode, else None."""
        x, theta = physics.data.qpos
        return 0.0 if task.has_terminated(x, theta) else None


def dm_control_environment() -> control.Environment:
    """The reference model behind dm_control's Environment."""
    physics = dm_mujoco.Physics.from_xml_string(load_model().xml)
    return control.Environment(physics, Balance(), time_limit=10.0)


def raw_steps(steps: int) -> Any:  # noqa: ANN401
    """A function that calls MuJoCo's `mj_step(nstep=steps)` once, on the model as it is shipped."""
    model = load_model().model
    data = mujoco.MjData(model)

    def run() -> None:
        mujoco.mj_resetData(model, data)
        data.qpos[1] = 0.01
        mujoco.mj_step(model, data, nstep=steps)

    return run
