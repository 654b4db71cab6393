"""A camera as a map from points in the world to pixels, and the lights that it sees by."""

from dataclasses import dataclass
from typing import Any, Self

import mujoco
import numpy as np
import numpy.typing as npt

Points = npt.NDArray[np.float64]
"""Points as rows, shape (n, 2) or (n, 3), or a single one."""


@dataclass(frozen=True)
class View:
    """A camera as a map from points in the world to pixels.

    Attributes:
        position: Of the camera in the world, m, shape (3,).
        axes: Columns: right, up, forward, in the world, shape (3, 3).
        scale: Pixels per unit of the image plane, (right, down).
        offset: Pixel of the optical axis, (right, down).
        near: Distance of the image plane, m; nothing nearer is seen.
        orthographic: Whether distance does not make things smaller.
        borders: What can be seen: points whose camera coordinates (right, up, forward, 1) have
            no negative product with a row. The first row is the near plane, then left, right,
            top and bottom of the picture; shape (5, 4).
        lights: The lights as they are while this camera looks.
    """

    position: Points
    axes: Points
    scale: Points
    offset: Points
    near: float
    orthographic: bool
    borders: Points
    lights: "list[Light]"

    @classmethod
    def of(cls, scene: mujoco.MjvScene, width: int, height: int) -> Self:
        """The view of the camera of MuJoCo's scene, in a picture of some pixels."""
        # The scene holds two eyes; the camera is in the middle between them.
        camera = mujoco.mjv_averageCamera(scene.camera[0], scene.camera[1])
        forward, up = np.array(camera.forward, float), np.array(camera.up, float)
        half_height = (camera.frustum_top - camera.frustum_bottom) / 2
        half_width = camera.frustum_width or half_height * width / height
        half = np.array([half_width, half_height])
        size = np.array([width, height])
        centre = np.array([camera.frustum_center, (camera.frustum_top + camera.frustum_bottom) / 2])
        scale = size / 2 / half * (1, -1)
        offset = size / 2 - centre * scale
        near = float(camera.frustum_near)
        return cls(
            position=np.array(camera.pos, float),
            axes=np.column_stack([np.cross(forward, up), up, forward]),
            scale=scale,
            offset=offset,
            near=near,
            orthographic=bool(camera.orthographic),
            borders=_borders(size, scale, offset, near, bool(camera.orthographic)),
            lights=[Light.of(scene.lights[i]) for i in range(scene.nlight)],
        )

    def towards(self, point: Points) -> Points:
        """Unit vector from a point to the camera, shape (3,)."""
        if self.orthographic:
            return -self.axes[:, 2]
        return unit(self.position - point)

    def project(self, points: Points) -> tuple[Points, Points]:
        """Pixels, shape (n, 2), and distances from the camera, shape (n,), of points (n, 3)."""
        seen = (points - self.position) @ self.axes
        distances = seen[:, 2]
        plane = seen[:, :2]
        if not self.orthographic:
            plane = plane * (self.near / np.maximum(distances, 1e-9))[:, None]
        return plane * self.scale + self.offset, distances


@dataclass(frozen=True)
class Light:
    """A light of a scene.

    Attributes:
        ambient: Its colour from everywhere, shape (3,).
        diffuse: Its colour from where it is, shape (3,).
        position: In the world, shape (3,), or None if it is as far away as the sun.
        direction: Where it shines to, shape (3,).
    """

    ambient: Points
    diffuse: Points
    position: Points | None
    direction: Points

    @classmethod
    def of(cls, light: Any) -> Self:  # noqa: ANN401
        """A light from MuJoCo's scene."""
        is_far = light.type == mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
        return cls(
            ambient=np.array(light.ambient, float),
            diffuse=np.array(light.diffuse, float),
            position=None if is_far else np.array(light.pos, float),
            direction=unit(np.array(light.dir, float)),
        )

    def on(self, point: Points, normal: Points, share: float) -> Points:
        """Brightness of a surface, shape (3,); `share` scales what comes from the light itself."""
        towards = -self.direction if self.position is None else unit(self.position - point)
        return self.ambient + self.diffuse * max(0.0, float(normal @ towards)) * share


def unit(vector: Points) -> Points:
    """A vector of length 1 in the same direction; zero stays zero."""
    return vector / max(float(np.linalg.norm(vector)), 1e-12)


def _borders(
    size: npt.NDArray[np.int64], scale: Points, offset: Points, near: float, orthographic: bool
) -> Points:
    """The rows of `View.borders`: 0 <= pixel <= size, written for camera coordinates."""
    rows = np.zeros((5, 4))
    rows[0, 2:] = 1.0, -near
    # A pixel is plane * scale + offset; in perspective both sides are multiplied by distance.
    constant = 3 if orthographic else 2
    slope = scale if orthographic else scale * near
    for axis in (0, 1):
        rows[1 + 2 * axis, axis], rows[1 + 2 * axis, constant] = slope[axis], offset[axis]
        rows[2 + 2 * axis, axis] = -slope[axis]
        rows[2 + 2 * axis, constant] = size[axis] - offset[axis]
    return rows
