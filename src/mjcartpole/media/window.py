"""A window that shows a cart-pole as it moves: MuJoCo's own viewer."""

import logging
import sys
import threading
import time
from typing import Protocol

import mujoco
import numpy as np
import numpy.typing as npt

from mjcartpole.media.backend_probe import try_backend
from mjcartpole.media.scene import DEFAULT_CAMERA
from mjcartpole.physics.cartpole import CartPole

_PATIENCE = 5.0
"""Seconds to wait for the viewer's thread."""

_log = logging.getLogger("mjcartpole")


class Window(Protocol):
    """Shows states, one per control step."""

    def show(self, state: npt.NDArray[np.float64]) -> None:
        """Show a state `(x, x_dot, theta, theta_dot, …)`."""

    def close(self) -> None:
        """Close the window."""


def open_window(cartpole: CartPole, camera: str = DEFAULT_CAMERA) -> Window:
    """Open a window, or say why there is none and go on without.

    A program that was written for a desk should still run on a server. Without a camera of that
    name the window starts with the viewer's own.
    """
    # MuJoCo's viewer ends the whole process where GLFW does not work. On macOS MuJoCo draws
    # without GLFW, so that a trial would say nothing; its viewer refuses by itself there.
    if sys.platform != "darwin" and not (trial := try_backend("glfw")).works:
        return NoWindow(trial.reason)
    try:
        return ViewerWindow(cartpole, camera)
    except (RuntimeError, mujoco.FatalError, ImportError, OSError) as error:
        return NoWindow(f"MuJoCo's viewer does not start: {error}")


class ViewerWindow:
    """MuJoCo's passive viewer, in real time."""

    def __init__(self, cartpole: CartPole, camera: str) -> None:
        """Open the window.

        Raises:
            RuntimeError: The viewer does not start (on macOS it needs `mjpython`).
        """
        import mujoco.viewer  # noqa: PLC0415 - it looks for a window system when imported

        self._cartpole = cartpole
        self._data = mujoco.MjData(cartpole.model)
        before = set(threading.enumerate())
        self._viewer = mujoco.viewer.launch_passive(
            cartpole.model, self._data, show_left_ui=False, show_right_ui=False
        )
        self._threads = set(threading.enumerate()) - before
        index = mujoco.mj_name2id(cartpole.model, mujoco.mjtObj.mjOBJ_CAMERA, camera)
        if index >= 0:
            self._viewer.cam.type = mujoco.mjtCamera.mjCAMERA_FIXED
            self._viewer.cam.fixedcamid = index
        self._next_frame = time.monotonic()

    def show(self, state: npt.NDArray[np.float64]) -> None:
        """Show a state when its time has come; nothing, once a person has closed the window."""
        if not self._viewer.is_running():
            return
        time.sleep(max(0.0, self._next_frame - time.monotonic()))
        self._next_frame = time.monotonic() + self._cartpole.control_step
        with self._viewer.lock():
            self._data.qpos[list(self._cartpole.joints)] = state[0::2]
            mujoco.mj_kinematics(self._cartpole.model, self._data)
        self._viewer.sync()

    def close(self) -> None:
        """Close the window, and wait until its thread has gone: it must not outlive Python."""
        self._viewer.close()
        for thread in self._threads:
            thread.join(timeout=_PATIENCE)


class NoWindow:
    """Stands where no window can be opened."""

    def __init__(self, why: str) -> None:
        """Say so, once."""
        _log.warning(
            'render_mode="human" shows nothing: %s; use render_mode="rgb_array", '
            "or `mjcartpole render` for a video",
            why,
        )

    def show(self, state: npt.NDArray[np.float64]) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""
