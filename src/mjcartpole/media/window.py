"""A window that shows a cart-pole as it moves: MuJoCo's own viewer."""

import os
import sys
import time

import mujoco
import numpy as np
import numpy.typing as npt

from mjcartpole import task
from mjcartpole.errors import RenderError
from mjcartpole.physics.model import CartPole


class Window:
    """MuJoCo's passive viewer, shown in real time: one picture per control step."""

    def __init__(self, cartpole: CartPole) -> None:
        """Open the window.

        Raises:
            RenderError: There is no screen, or the viewer does not start.
        """
        if sys.platform == "linux" and not _has_screen():
            raise RenderError(
                'render_mode="human" needs a screen, and neither DISPLAY nor WAYLAND_DISPLAY is '
                'set; use render_mode="rgb_array", or `mjcartpole render` for a video'
            )
        import mujoco.viewer  # noqa: PLC0415 - it looks for a window system when imported

        self._cartpole = cartpole
        self._data = mujoco.MjData(cartpole.model)
        try:
            self._viewer = mujoco.viewer.launch_passive(
                cartpole.model, self._data, show_left_ui=False, show_right_ui=False
            )
        except RuntimeError as error:
            raise RenderError(f"MuJoCo's viewer does not start: {error}") from error
        self._next_frame = time.monotonic()

    def show(self, state: npt.NDArray[np.float64]) -> None:
        """Show a state `(x, x_dot, theta, theta_dot)` when its time has come."""
        time.sleep(max(0.0, self._next_frame - time.monotonic()))
        self._next_frame = time.monotonic() + task.CONTROL_STEP
        with self._viewer.lock():
            self._data.qpos[self._cartpole.slider] = state[0]
            self._data.qpos[self._cartpole.hinge] = state[2]
            mujoco.mj_kinematics(self._cartpole.model, self._data)
        self._viewer.sync()

    def close(self) -> None:
        """Close the window."""
        self._viewer.close()


def _has_screen() -> bool:
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
