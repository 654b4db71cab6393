"""Geoms as polygons in pixels: what a camera sees of a box, a capsule or a sphere.

Every round geom is convex, so its outline is the convex hull of a few projected points. Flat
faces get one colour each; round ones a few nested outlines that grow brighter towards the middle.
"""

import itertools
from dataclasses import dataclass
from typing import Any, Final, Self

import mujoco
import numpy as np
import numpy.typing as npt

from mjcartpole.media.scene import Scene

Points = npt.NDArray[np.float64]
Colour = tuple[int, int, int, int]
"""Red, green, blue, opacity; 0 to 255."""

_CORNERS: Final = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
# Corners of each face, going around it; face 2 i looks along minus, 2 i + 1 along plus axis i.
_FACES: Final = ((0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5))
_SQUARE: Final = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
_TURN: Final = np.linspace(0, 2 * np.pi, 32, endpoint=False)
_RING: Final = np.column_stack([np.cos(_TURN), np.sin(_TURN), np.zeros_like(_TURN)])
_DIRECTIONS: Final = _RING[:, :2].T

# Nested outlines of round geoms: size of each, and where in its band the surface is looked at.
_BANDS: Final = ((1.0, 0.93), (0.86, 0.8), (0.7, 0.6), (0.5, 0.3))
_MANY_POINTS: Final = 100


@dataclass(frozen=True)
class Outline:
    """A geom in the picture.

    Attributes:
        order: Outlines are drawn in ascending order.
        polygons: Colour and corners in pixels, shape (n, 2), each over the one before.
        bounds: Left, top, right, bottom, in pixels.
    """

    order: tuple[int, float]
    polygons: list[tuple[Colour, Points]]
    bounds: tuple[float, float, float, float]


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
    def of(cls, scene: Scene) -> Self:
        """The view of a scene's camera."""
        # The scene holds two eyes; the camera is in the middle between them.
        camera = mujoco.mjv_averageCamera(scene.abstract.camera[0], scene.abstract.camera[1])
        forward, up = np.array(camera.forward, float), np.array(camera.up, float)
        half_height = (camera.frustum_top - camera.frustum_bottom) / 2
        half_width = camera.frustum_width or half_height * scene.width / scene.height
        half = np.array([half_width, half_height])
        size = np.array([scene.width, scene.height])
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
            lights=[Light.of(scene.abstract.lights[i]) for i in range(scene.abstract.nlight)],
        )

    def towards(self, point: Points) -> Points:
        """Unit vector from a point to the camera, shape (3,)."""
        if self.orthographic:
            return -self.axes[:, 2]
        return _unit(self.position - point)

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
            direction=_unit(np.array(light.dir, float)),
        )

    def on(self, point: Points, normal: Points, share: float) -> Points:
        """Brightness of a surface, shape (3,); `share` scales what comes from the light itself."""
        towards = -self.direction if self.position is None else _unit(self.position - point)
        return self.ambient + self.diffuse * max(0.0, float(normal @ towards)) * share


def outline_of(geom: Any, scene: Scene, view: View) -> Outline:  # noqa: ANN401
    """What a view shows of a geom of MuJoCo's scene; no polygons if it shows nothing."""
    body = _Body(geom, view, scene)
    kind = mujoco.mjtGeom(geom.type)
    is_plane = kind == mujoco.mjtGeom.mjGEOM_PLANE
    draw = _DRAWERS.get(kind)
    if draw is not None:
        draw(body)
    nearest = 0.0 if is_plane else min(body.distances, default=0.0)
    # A plane is ground or wall: everything else stands in front of it. The farther one is first.
    far = -float((body.position - view.position) @ view.axes[:, 2]) if is_plane else -nearest
    corners = [points for _, points in body.polygons]
    bounds = (0.0, 0.0, 0.0, 0.0)
    if corners:
        low = np.min([points.min(axis=0) for points in corners], axis=0)
        high = np.max([points.max(axis=0) for points in corners], axis=0)
        bounds = (float(low[0]), float(low[1]), float(high[0]), float(high[1]))
    return Outline((0 if is_plane else 1, far), body.polygons, bounds)


class _Body:
    """A geom while it is being drawn."""

    def __init__(self, geom: Any, view: View, scene: Scene) -> None:  # noqa: ANN401
        self.view = view
        self.model = scene.model
        self.data_id = int(geom.dataid)
        self.position = np.array(geom.pos, float)
        self.turn = np.array(geom.mat, float).reshape(3, 3)
        self.size = np.array(geom.size, float)
        self.rgba = np.array(geom.rgba, float)
        self.emission = float(geom.emission)
        self.polygons: list[tuple[Colour, Points]] = []
        self.distances: list[float] = []

    def world(self, local: Points) -> Points:
        """Points of the geom's frame, shape (n, 3), in the world."""
        points: Points = local @ self.turn.T + self.position
        return points

    def face(self, local: Points, normal: Points, *, is_large: bool = False) -> None:
        """Draw a flat face, unless it looks away; of a large one only what is in the picture.

        A face has one colour, found in its middle. The middle of a ground that reaches past the
        camera may be anywhere; that of its visible part is where the eye is.
        """
        corners = self.world(local)
        outward = self.turn @ normal
        if outward @ self.view.towards(corners[0]) <= 0:
            return
        corners = _clip(
            corners, self.view, self.view.borders if is_large else self.view.borders[:1]
        )
        if len(corners) < 3:
            return
        points, distances = self.view.project(corners)
        self.distances.append(float(distances.min()))
        self.polygons.append((self.colour(corners.mean(axis=0), outward), points))

    def hull(self, local: Points, depth: float) -> None:
        """Draw the outline of points; `depth` in 0 to 1 is how far off its middle it is seen."""
        points, distances = self.view.project(self.world(local))
        if distances.min() < self.view.near:
            return
        towards = self.view.towards(self.position)
        self.distances.append(float(distances.min()))
        share = float(np.sqrt(1 - depth * depth))
        self.polygons.append((self.colour(self.position, towards, share), convex_hull(points)))

    def colour(self, point: Points, normal: Points, share: float = 1.0) -> Colour:
        """The geom's colour under all lights, as OpenGL mixes it (without gloss)."""
        light = np.full(3, self.emission)
        for lamp in self.view.lights:
            light = light + lamp.on(point, normal, share)
        shown = np.append(self.rgba[:3] * light, self.rgba[3])
        red, green, blue, opacity = (round(255 * min(max(v, 0.0), 1.0)) for v in shown.tolist())
        return red, green, blue, opacity

    def silhouette(self) -> Points:
        """The ring on the unit ball that the camera sees as its edge, shape (n, 3).

        The ball stands for an ellipsoid: seen in a space in which the ellipsoid is a ball, the
        edge is a circle, and straight lines stay straight on the way back.
        """
        if self.view.orthographic:
            eye = (self.turn.T @ -self.view.axes[:, 2]) / self.size
            return _ring_around(_unit(eye), 0.0, 1.0)
        eye = (self.turn.T @ (self.view.position - self.position)) / self.size
        distance = max(float(np.linalg.norm(eye)), 1.001)
        return _ring_around(eye / distance, 1 / distance, np.sqrt(1 - 1 / distance**2))


def _draw_box(body: _Body) -> None:
    corners = _CORNERS * body.size
    for index, face in enumerate(_FACES):
        normal = np.zeros(3)
        normal[index // 2] = 1.0 if index % 2 else -1.0
        body.face(corners[list(face)], normal)


def _draw_plane(body: _Body) -> None:
    size = np.array([body.size[0], body.size[1], 0.0])
    body.face(_SQUARE * size, np.array([0.0, 0.0, 1.0]), is_large=True)


def _draw_ellipsoid(body: _Body) -> None:
    ring = body.silhouette() * body.size
    for size, depth in _BANDS:
        body.hull(ring * size, depth)


def _draw_capsule(body: _Body) -> None:
    radius, half = body.size[0], np.array([0.0, 0.0, body.size[2]])
    body.size = np.full(3, radius)
    ring = body.silhouette() * radius
    for size, depth in _BANDS:
        body.hull(np.concatenate([ring * size + half, ring * size - half]), depth)


def _draw_cylinder(body: _Body) -> None:
    radius, half = body.size[0], np.array([0.0, 0.0, body.size[2]])
    for size, depth in _BANDS:
        ring = _RING * (radius * size)
        body.hull(np.concatenate([ring + half, ring - half]), depth)
    for end in (-1.0, 1.0):
        body.face(_RING * radius + end * half, np.array([0.0, 0.0, end]))


def _draw_mesh(body: _Body) -> None:
    mesh = body.data_id // 2
    if not 0 <= mesh < body.model.nmesh:
        return
    start, amount = body.model.mesh_vertadr[mesh], body.model.mesh_vertnum[mesh]
    body.hull(np.array(body.model.mesh_vert[start : start + amount], float), 0.3)


_DRAWERS: Final = {
    mujoco.mjtGeom.mjGEOM_BOX: _draw_box,
    mujoco.mjtGeom.mjGEOM_PLANE: _draw_plane,
    mujoco.mjtGeom.mjGEOM_SPHERE: _draw_ellipsoid,
    mujoco.mjtGeom.mjGEOM_ELLIPSOID: _draw_ellipsoid,
    mujoco.mjtGeom.mjGEOM_CAPSULE: _draw_capsule,
    mujoco.mjtGeom.mjGEOM_CYLINDER: _draw_cylinder,
    mujoco.mjtGeom.mjGEOM_MESH: _draw_mesh,
}


def convex_hull(points: Points) -> Points:
    """The corners of the convex hull of points, shape (n, 2), going around it.

    Andrew's monotone chain (1979, doi:10.1016/0020-0190(79)90072-3). Of very many points only
    those that lie farthest in one of some directions are looked at.
    """
    if len(points) > _MANY_POINTS:
        points = points[np.unique(np.argmax(points @ _DIRECTIONS, axis=0))]
    ordered = sorted(map(tuple, points.tolist()))
    return np.array(_half_hull(ordered) + _half_hull(ordered[::-1]))


def _half_hull(ordered: list[tuple[float, ...]]) -> list[tuple[float, ...]]:
    """The chain from the first to the last point, without the last."""
    chain: list[tuple[float, ...]] = []
    for x, y in ordered:
        while len(chain) >= 2:
            (x0, y0), (x1, y1) = chain[-2], chain[-1]
            if (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0) > 0:
                break
            chain.pop()
        chain.append((x, y))
    return chain[:-1] or chain


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


def _clip(corners: Points, view: View, borders: Points) -> Points:
    """The part of a polygon, shape (n, 3), on the seen side of all borders.

    Sutherland and Hodgman (1974, doi:10.1145/360767.360802).
    """
    for border in borders:
        ahead = (corners - view.position) @ view.axes @ border[:3] + border[3]
        if ahead.min() >= 0:
            continue
        kept = []
        for index in range(len(corners)):
            before, here = ahead[index - 1], ahead[index]
            if (before < 0) != (here < 0):
                share = before / (before - here)
                kept.append(corners[index - 1] + share * (corners[index] - corners[index - 1]))
            if here >= 0:
                kept.append(corners[index])
        if not kept:
            return np.empty((0, 3))
        corners = np.array(kept)
    return corners


def _ring_around(axis: Points, along: float, radius: float) -> Points:
    """A circle around a unit axis, `along` from the origin, shape (n, 3)."""
    helper = np.eye(3)[int(np.argmin(np.abs(axis)))]
    first = _unit(np.cross(axis, helper))
    second = np.cross(axis, first)
    return along * axis + radius * (_RING[:, :1] * first + _RING[:, 1:2] * second)


def _unit(vector: Points) -> Points:
    return vector / max(float(np.linalg.norm(vector)), 1e-12)
