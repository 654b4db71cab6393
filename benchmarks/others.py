"""The same cart-pole behind the environments of other libraries."""

from typing import Any

import gymnasium
import mujoco
import numpy as np
from gymnasium.envs.mujoco import MujocoEnv

from mjcartpole.physics.load import find_model, load_model
from mjcartpole.task import CARTPOLE_V1, CONTROL_STEP


class GymnasiumMujoco(MujocoEnv):
    """Gymnasium's base class for MuJoCo environments, as its own tasks use it."""

    metadata = {  # noqa: RUF012 - gymnasium's own declaration
        "render_modes": ["human", "rgb_array", "depth_array", "rgbd_tuple"],
        "render_fps": round(1 / CONTROL_STEP),
    }

    def __init__(self) -> None:
        """Load the reference model."""
        space = gymnasium.spaces.Box(-np.inf, np.inf, (4,), np.float64)
        super().__init__(str(find_model("cartpole")), 1, space)

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:  # noqa: ANN401
        """Advance 0.02 s."""
        self.do_simulation(np.array([1.0 if action == 1 else -1.0]), self.frame_skip)
        observation = self._observe()
        over = CARTPOLE_V1.has_ended(observation[0], observation[2])
        return observation, 1.0, over, False, {}

    def reset_model(self) -> Any:  # noqa: ANN401 - gymnasium's own signature
        """Draw a starting state."""
        low, high = CARTPOLE_V1.start_low, CARTPOLE_V1.start_high
        qpos, qvel = (self.np_random.uniform(low, high, 2) for _ in range(2))
        self.set_state(qpos, qvel)  # type: ignore[no-untyped-call]
        return self._observe()

    def _observe(self) -> Any:  # noqa: ANN401
        qpos, qvel = self.data.qpos, self.data.qvel
        return np.array([qpos[0], qvel[0], qpos[1], qvel[1]])


def raw_steps(steps: int) -> Any:  # noqa: ANN401
    """A function that calls MuJoCo's `mj_step(nstep=steps)` once, on the model as it is shipped."""
    model = load_model().model
    data = mujoco.MjData(model)

    def run() -> None:
        mujoco.mj_resetData(model, data)
        data.qpos[1] = 0.01
        mujoco.mj_step(model, data, nstep=steps)

    return run
