"""What is to be drawn: a cart-pole in a state, seen by one of its cameras.

MuJoCo's abstract scene (geoms in world coordinates, a camera, lights) needs no OpenGL. Every
renderer draws from it, so that all see the same things from the same place.
"""

import copy
import itertools
import math
import operator
from typing import Any, Final

import mujoco
import numpy as np
import numpy.typing as npt

from mjcartpole.errors import RenderError
from mjcartpole.media.angle_limits import Fan, Wedge, box_corners
from mjcartpole.media.quality import DEFAULT_QUALITY, Quality, level_of
from mjcartpole.media.track_limits import Posts
from mjcartpole.media.view import Points, View
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.structure import directions
from mjcartpole.task import CARTPOLE_V1, Task, state_names

Box = tuple[int, int, int, int]
"""Left, top, right, bottom, in pixels; right and bottom lie just outside."""

DEFAULT_CAMERA: Final = "side"
"""The camera of the reference model that sees the whole track."""

FREE_CAMERA: Final = "free"
"""Stands in for a camera where a model has none: it frames the track from the side."""

SMALLEST: Final = 16
LARGEST: Final = 8192
"""Bounds of a picture's width and height, in pixels."""

_EXTRA_GEOMS: Final = 1000
_TRIANGLE: Final = mujoco.mjtGeom.mjGEOM_TRIANGLE
_ONES: Final = np.ones(3)
_STRAIGHT: Final = 0.999
"""Share of a look that is up or down, beyond which its azimuth means nothing."""


class Scene:
    """A cart-pole's geoms and camera in world coordinates, for one state after the other.

    Attributes:
        cartpole: What is shown.
        model: A copy of its model, with the visual settings that size and quality ask for.
        width: Pixels of a picture.
        height: Pixels of a picture.
        level: How much work goes into it.
        abstract: MuJoCo's scene, filled by `show`: the model's own geoms first, then the fans.
        n_geoms: How many of the geoms in it are the model's own.
        wedges: The parts of the fans, one for each pole, and the posts at the track's limits.
    """

    def __init__(
        self,
        cartpole: CartPole,
        width: int,
        height: int,
        camera: str,
        quality: Quality = DEFAULT_QUALITY,
        task: Task = CARTPOLE_V1,
    ) -> None:
        """Prepare a scene of a task; it is empty until the first `show`.

        Raises:
            RenderError: The size makes no sense, the model has no such camera, or there is no
                such quality.
        """
        self.width, self.height = _pixels("width", width), _pixels("height", height)
        self.cartpole = cartpole
        self.level = level_of(quality).fit(self.width, self.height)
        self.model = copy.copy(cartpole.model)
        self.model.vis.global_.offwidth = self.width * self.level.enlargement
        self.model.vis.global_.offheight = self.height * self.level.enlargement
        self.level.prepare(self.model)
        self._camera = _find_camera(cartpole, camera, self.width / self.height, task)
        self._data = mujoco.MjData(self.model)
        self._option = mujoco.MjvOption()
        self.abstract = mujoco.MjvScene(self.model, self.model.ngeom + _EXTRA_GEOMS)
        if self.level.plain:
            self.abstract.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0
            self.abstract.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = 0
        self.n_geoms = 0
        self.wedges: list[Wedge] = []
        self._joints = list(cartpole.joints)
        fans = [Fan(cartpole, pole, task) for pole in range(cartpole.poles)]
        self._limits: list[Fan | Posts] = [*fans, Posts(cartpole, task)]
        self._view: View | None = None
        self._moving = np.flatnonzero(~_is_fixed(self.model, self.model.geom_bodyid))
        self.is_still = _is_view_still(self.model, self._camera)

    @property
    def is_local(self) -> bool:
        """Whether a thing that moves changes nothing but the pixels that it covers."""
        model, flags = self.model, self.abstract.flags
        reflects = flags[mujoco.mjtRndFlag.mjRND_REFLECTION] and model.mat_reflectance.any()
        shades = model.vis.quality.shadowsize > 0 and model.light_castshadow.any()
        has_sky = (model.tex_type == int(mujoco.mjtTexture.mjTEXTURE_SKYBOX)).any()
        others = model.nflex or model.nskin or model.ntendon
        sites_move = not _is_fixed(model, model.site_bodyid).all()
        return not (reflects or shades or has_sky or others or sites_move)

    def is_fixed(self, geom: Any) -> bool:  # noqa: ANN401
        """Whether a geom of MuJoCo's scene is the same in every state."""
        is_geom = geom.objtype == mujoco.mjtObj.mjOBJ_GEOM and geom.objid >= 0
        return bool(is_geom and _is_fixed(self.model, self.model.geom_bodyid[geom.objid]))

    def show(self, state: npt.ArrayLike) -> None:
        """Put the cart-pole into a state `(x, x_dot, theta, theta_dot, …)`; m, m/s, rad, rad/s.

        Raises:
            RenderError: It is no state.
        """
        values, names = np.asarray(state, dtype=np.float64), state_names(self.cartpole.poles)
        if values.shape != (len(names),) or not np.isfinite(values).all():
            raise RenderError(
                f"a picture needs a state of {len(names)} finite numbers ({', '.join(names)}), "
                f"not {np.array2string(values, threshold=8)} of shape {values.shape}"
            )
        data = self._data
        data.qpos[self._joints] = values[0::2]
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
        if self._view is None or not self.is_still:
            self._view = View.of(self.abstract, self.width, self.height)
        self.n_geoms = self.abstract.ngeom
        self.wedges = [wedge for limit in self._limits for wedge in limit.wedges(data)]
        for wedge in self.wedges:
            _add_wedge(self.abstract, wedge, self.view)

    def hide_moving(self) -> None:
        """Leave in MuJoCo's scene, until the next `show`, only what is the same in every state."""
        geoms = self.abstract.geoms
        self.abstract.ngeom = self.n_geoms
        for index in range(self.n_geoms):
            if not self.is_fixed(geoms[index]):
                geoms[index].type = mujoco.mjtGeom.mjGEOM_NONE

    @property
    def view(self) -> View:
        """The camera as it sees the shown state."""
        assert self._view is not None, "nothing has been shown yet"
        return self._view

    def moving_box(self) -> Box | None:
        """The part of the picture that holds all that moves; None if no box can tell."""
        corners = self._corners(self._moving).reshape(-1, 3)
        points = np.concatenate([corners, *(wedge.corners for wedge in self.wedges)])
        return self._bounds(points, margin=2)

    def cart_box(self) -> Box | None:
        """The part of the picture that holds the cart; None if it is behind the camera."""
        body = self.model.jnt_bodyid[self.cartpole.slider]
        geoms = np.flatnonzero(self.model.geom_bodyid == body)
        points = self._corners(geoms).reshape(-1, 3) if len(geoms) else self._data.xpos[[body]]
        return self._bounds(points, margin=0)

    def push_direction(self) -> Points:
        """Where a push along the slider's positive axis points to in the picture, shape (2,)."""
        joint = self.cartpole.slider
        start = self._data.xanchor[joint]
        pixels, _ = self.view.project(np.array([start, start + 0.1 * self._data.xaxis[joint]]))
        direction: Points = pixels[1] - pixels[0]
        return direction

    def _corners(self, geoms: npt.NDArray[np.int64]) -> Points:
        data = self._data
        return box_corners(
            self.model.geom_aabb[geoms], data.geom_xpos[geoms], data.geom_xmat[geoms]
        )

    def _bounds(self, points: Points, margin: int) -> Box | None:
        pixels, distances = self.view.project(points)
        if distances.min(initial=np.inf) < self.view.near or not np.isfinite(pixels).all():
            return None
        # A box that lies outside is one of a few pixels at the edge, not a negative one.
        size = np.array([self.width, self.height])
        (left, top), (right, bottom) = (
            np.clip(corner, 0, size).tolist() for corner in (pixels.min(axis=0), pixels.max(axis=0))
        )
        left, top = math.floor(left) - margin, math.floor(top) - margin
        right, bottom = math.ceil(right) + margin, math.ceil(bottom) + margin
        return max(left, 0), max(top, 0), min(right, self.width), min(bottom, self.height)


def check_picture(cartpole: CartPole, width: int, height: int, camera: str) -> None:
    """Refuse a size or a camera before there is anything to draw.

    Raises:
        RenderError: The size makes no sense, or the model has no such camera.
    """
    size = _pixels("width", width) / _pixels("height", height)
    _find_camera(cartpole, camera, size, CARTPOLE_V1)


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


def _find_camera(cartpole: CartPole, name: str, aspect: float, task: Task) -> mujoco.MjvCamera:
    model = cartpole.model
    names = [model.camera(index).name for index in range(model.ncam)]
    camera = mujoco.MjvCamera()
    if name in names:
        camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        camera.fixedcamid = names.index(name)
        return camera
    if name in (DEFAULT_CAMERA, FREE_CAMERA):
        # A track without an end is seen as far as CartPole-v1's goes.
        extent = task.x_limit if math.isfinite(task.x_limit) else CARTPOLE_V1.x_limit
        _frame_track(camera, cartpole, aspect, extent)
        return camera
    available = ", ".join(label for label in [*names, FREE_CAMERA] if label)
    raise RenderError(f"{cartpole.name} has no camera {name!r}; available: {available}")


def _frame_track(
    camera: mujoco.MjvCamera, cartpole: CartPole, aspect: float, extent: float
) -> None:
    """Look from where the track to +-extent (m) fits, +x to the right, up to the top."""
    model, towards = cartpole.model, directions(cartpole)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    up, forward = towards.up, np.cross(towards.up, towards.rail)
    camera.type = mujoco.mjtCamera.mjCAMERA_FREE
    camera.lookat[:] = data.xpos[model.jnt_bodyid[cartpole.slider]] + 0.5 * up
    camera.elevation = np.degrees(np.arcsin(np.clip(forward[2], -1.0, 1.0)))
    # Looking straight down or up, the azimuth says where the top of the picture is.
    across = forward if abs(forward[2]) < _STRAIGHT else -np.sign(forward[2]) * up
    camera.azimuth = np.degrees(np.arctan2(across[1], across[0]))
    half_view = aspect * np.tan(np.radians(model.vis.global_.fovy) / 2)
    camera.distance = 1.2 * extent / half_view


def _is_fixed(model: mujoco.MjModel, bodies: npt.NDArray[np.int32]) -> npt.NDArray[np.bool_]:
    """Whether bodies do not move, whatever the state."""
    fixed: npt.NDArray[np.bool_] = model.body_weldid[bodies] == 0
    return fixed


def _is_view_still(model: mujoco.MjModel, camera: mujoco.MjvCamera) -> bool:
    """Whether camera and lights stay where they are, whatever the state."""
    still = int(mujoco.mjtCamLight.mjCAMLIGHT_FIXED)
    lights = _is_fixed(model, model.light_bodyid) & (model.light_mode == still)
    if not lights.all():
        return False
    index = camera.fixedcamid
    if index < 0:
        return True
    return bool(model.cam_mode[index] == still and _is_fixed(model, model.cam_bodyid[index]))


def _add_wedge(scene: mujoco.MjvScene, wedge: Wedge, view: View) -> None:
    """Add a wedge's triangles to MuJoCo's scene, as many as there is room for."""
    apex, rim = wedge.corners[0], wedge.corners[1:] - wedge.corners[0]
    faces_camera = wedge.normal @ view.towards(apex) > 0
    # A triangle's corners are its origin and its frame's first two columns; it is lit from the
    # side that its third column points to.
    normal = wedge.normal if faces_camera else -wedge.normal
    frame = np.empty((3, 3))
    frame[:, 2] = normal
    # MuJoCo blends each triangle twice, once for either side.
    rgba = np.array([*wedge.rgba[:3], 1 - math.sqrt(1 - wedge.rgba[3])], dtype=np.float32)
    for pair in itertools.pairwise(rim):
        if scene.ngeom == scene.maxgeom:
            return
        frame[:, 0], frame[:, 1] = pair if faces_camera else reversed(pair)
        geom = scene.geoms[scene.ngeom]
        mujoco.mjv_initGeom(geom, _TRIANGLE, _ONES, apex, frame.ravel(), rgba)
        geom.category = mujoco.mjtCatBit.mjCAT_DECOR
        scene.ngeom += 1
