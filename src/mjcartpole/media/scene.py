"""What is to be drawn: a cart-pole in a state, seen by one of its cameras.

MuJoCo's abstract scene (geoms in world coordinates, a camera, lights) needs no OpenGL. Every
renderer draws from it, so that all see the same things from the same place.
"""

import copy
import operator
from typing import Final

import mujoco
import numpy as np
import numpy.typing as npt

from mjcartpole import task
from mjcartpole.errors import RenderError
from mjcartpole.physics.model import CartPole

DEFAULT_CAMERA: Final = "side"
"""The camera of the reference model that sees the whole track."""

FREE_CAMERA: Final = "free"
"""Stands in for a camera where a model has none: it frames the track from the side."""

SMALLEST: Final = 16
LARGEST: Final = 8192
"""Bounds of a picture's width and height, in pixels."""

_EXTRA_GEOMS: Final = 1000


class Scene:
    """A cart-pole's geoms and camera in world coordinates, for one state after the other.

    Attributes:
        cartpole: What is shown.
        model: A copy of its model whose offscreen buffer has room for the picture.
        width: Pixels of a picture.
        height: Pixels of a picture.
        abstract: MuJoCo's scene, filled by `show`.
    """

    def __init__(self, cartpole: CartPole, width: int, height: int, camera: str) -> None:
        """Prepare a scene; it is empty until the first `show`.

        Raises:
            RenderError: The size makes no sense, or the model has no such camera.
        """
        self.width, self.height = _pixels("width", width), _pixels("height", height)
        self.cartpole = cartpole
        self.model = copy.copy(cartpole.model)
        self.model.vis.global_.offwidth = self.width
        self.model.vis.global_.offheight = self.height
        self._camera = _find_camera(self.model, cartpole.name, camera, self.width / self.height)
        self._data = mujoco.MjData(self.model)
        self._option = mujoco.MjvOption()
        self.abstract = mujoco.MjvScene(self.model, self.model.ngeom + _EXTRA_GEOMS)

    @property
    def is_camera_still(self) -> bool:
        """Whether the camera stays where it is, whatever the state."""
        camera = self._camera.fixedcamid
        if camera < 0:
            return True
        is_fixed = self.model.cam_mode[camera] == mujoco.mjtCamLight.mjCAMLIGHT_FIXED
        return bool(is_fixed and self.model.body_weldid[self.model.cam_bodyid[camera]] == 0)

    def show(self, state: npt.ArrayLike) -> None:
        """Put the cart-pole into a state `(x, x_dot, theta, theta_dot)`; m, m/s, rad, rad/s.

        Raises:
            RenderError: It is no state.
        """
        values = np.asarray(state, dtype=np.float64)
        if values.shape != (4,) or not np.isfinite(values).all():
            raise RenderError(
                "a picture needs a state of 4 finite numbers (x, x_dot, theta, theta_dot), "
                f"not {np.array2string(values, threshold=8)} of shape {values.shape}"
            )
        data = self._data
        data.qpos[self.cartpole.slider] = values[0]
        data.qpos[self.cartpole.hinge] = values[2]
        mujoco.mj_fwdPosition(self.model, data)
        mujoco.mjv_updateScene(
            self.model,
            data,
            self._option,
            None,
            self._camera,
            mujoco.mjtCatBit.mjCAT_ALL,
            self.abstract,
        )


def check_picture(cartpole: CartPole, width: int, height: int, camera: str) -> None:
    """Refuse a size or a camera before there is anything to draw.

    Raises:
        RenderError: The size makes no sense, or the model has no such camera.
    """
    size = _pixels("width", width) / _pixels("height", height)
    _find_camera(cartpole.model, cartpole.name, camera, size)


def _pixels(name: str, value: int) -> int:
    try:
        pixels = operator.index(value)
    except TypeError:
        pixels = -1
    if not SMALLEST <= pixels <= LARGEST:
        raise RenderError(
            f"{name} {value!r} is no size of a picture; "
            f"use a whole number of pixels from {SMALLEST} to {LARGEST}"
        )
    return pixels


def _find_camera(
    model: mujoco.MjModel, model_name: str, name: str, aspect: float
) -> mujoco.MjvCamera:
    names = [model.camera(index).name for index in range(model.ncam)]
    camera = mujoco.MjvCamera()
    if name in names:
        camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        camera.fixedcamid = names.index(name)
        return camera
    if not names and name in (DEFAULT_CAMERA, FREE_CAMERA):
        _frame_track(camera, model, aspect)
        return camera
    available = ", ".join(label or "(unnamed)" for label in names) or FREE_CAMERA
    raise RenderError(f"{model_name} has no camera {name!r}; available: {available}")


def _frame_track(camera: mujoco.MjvCamera, model: mujoco.MjModel, aspect: float) -> None:
    """Look along +y from where the whole track fits into the picture, x to the right."""
    camera.type = mujoco.mjtCamera.mjCAMERA_FREE
    camera.lookat[:] = 0.0, 0.0, 0.5
    camera.azimuth, camera.elevation = 90.0, 0.0
    half_view = aspect * np.tan(np.radians(model.vis.global_.fovy) / 2)
    camera.distance = 1.2 * task.X_LIMIT / half_view
