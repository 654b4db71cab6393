"""Geoms as polygons in pixels: what a camera sees of a box, a capsule or a sphere.

Every round geom is convex, so its outline is the convex hull of a few projected points. Flat
faces get one colour each; round ones a few nested outlines that grow brighter towards the middle.
"""

import itertools
import math
from dataclasses import dataclass
from typing import Any, Final

import mujoco
import numpy as np
import numpy.typing as npt

from mjcartpole.media.angle_limits import Wedge
from mjcartpole.media.scene import Scene
from mjcartpole.media.view import Points, View, unit

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


def outline_of(geom: Any, scene: Scene) -> Outline:  # noqa: ANN401
    """What a scene's camera shows of one of its geoms; no polygons if it shows nothing."""
    view = scene.view
    body = _Body(geom, view, scene)
    kind = mujoco.mjtGeom(geom.type)
    is_plane = kind == mujoco.mjtGeom.mjGEOM_PLANE
    draw = _DRAWERS.get(kind)
    if draw is not None:
        draw(body)
    nearest = 0.0 if is_plane else min(body.distances, default=0.0)
    # A plane is ground or wall: everything else stands in front of it. The farther one is first.
    far = -float((body.position - view.position) @ view.axes[:, 2]) if is_plane else -nearest
    return _outline((0 if is_plane else 1, far), body.polygons)


def outline_of_wedge(wedge: Wedge, view: View) -> Outline:
    """What a view shows of a part of the fan."""
    corners = _clip(wedge.corners, view, view.borders[:1])
    if len(corners) < 3:
        return _outline((1, 0.0), [])
    points, distances = view.project(corners)
    faces_camera = wedge.normal @ view.towards(wedge.corners[0]) > 0
    normal = wedge.normal if faces_camera else -wedge.normal
    colour = _lit(wedge.rgba, 0.0, view, corners[0], normal)
    # By its farthest corner: the pole, which moves in the same plane, is drawn over it.
    return _outline((1, -float(distances.max())), [(colour, points)])


def _outline(order: tuple[int, float], polygons: list[tuple[Colour, Points]]) -> Outline:
    """An outline and its bounds, without what no number can place."""
    kept = [(colour, points) for colour, points in polygons if np.isfinite(points).all()]
    if not kept:
        return Outline(order, [], (0.0, 0.0, 0.0, 0.0))
    corners = np.concatenate([points for _, points in kept])
    left, top = corners.min(axis=0).tolist()
    right, bottom = corners.max(axis=0).tolist()
    return Outline(order, kept, (left, top, right, bottom))


def _lit(
    rgba: npt.NDArray[Any],
    emission: float,
    view: View,
    point: Points,
    normal: Points,
    share: float = 1.0,
) -> Colour:
    """A colour under all lights, as OpenGL mixes it (without gloss)."""
    light = np.full(3, emission)
    for lamp in view.lights:
        light = light + lamp.on(point, normal, share)
    shown = [*(rgba[:3] * light).tolist(), float(rgba[3])]
    red, green, blue, opacity = (round(255 * min(max(v, 0.0), 1.0)) for v in shown)
    return red, green, blue, opacity


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

    def bands(self, ring: Points, ends: Points) -> None:
        """Draw what a ring sweeps over between its places: a few times, narrower and brighter.

        The ring, shape (n, 3), is around the geom's middle, and put at each of its ends, (k, 3).
        """
        # One blend of a see-through geom is enough.
        bands = _BANDS if self.rgba[3] >= 1 else _BANDS[1:2]
        order: list[int] = []
        for size, depth in bands:
            scale = size if len(bands) > 1 else 1.0
            points = self._project((ring * scale + ends[:, None]).reshape(-1, 3))
            if len(points) < 3:
                return
            if len(points) != len(ring) * len(ends):
                self._add(convex_hull(points), depth)
                continue
            # Inner bands have the corners of the outermost one.
            order = order or hull_indices(points)
            self._add(points[order], depth)

    def hull(self, local: Points, depth: float) -> None:
        """Draw the outline of points; `depth` in 0 to 1 is how far off its middle it is seen."""
        points = self._project(local)
        if len(points) >= 3:
            self._add(points[hull_indices(points)], depth)

    def _project(self, local: Points) -> Points:
        """Pixels, shape (n, 2), of what of the points' hull is before the camera."""
        seen = _in_front(self.world(local), self.view)
        if not len(seen) or not np.isfinite(seen).all():
            return np.empty((0, 2))
        points, distances = self.view.project(seen)
        self.distances.append(float(distances.min()))
        return points

    def _add(self, points: Points, depth: float) -> None:
        share = math.sqrt(1 - depth * depth)
        towards = self.view.towards(self.position)
        self.polygons.append((self.colour(self.position, towards, share), points))

    def colour(self, point: Points, normal: Points, share: float = 1.0) -> Colour:
        """The geom's colour at a point."""
        return _lit(self.rgba, self.emission, self.view, point, normal, share)

    def silhouette(self) -> Points:
        """The ring on the unit ball that the camera sees as its edge, shape (n, 3).

        The ball stands for an ellipsoid: seen in a space in which the ellipsoid is a ball, the
        edge is a circle, and straight lines stay straight on the way back.
        """
        if self.view.orthographic:
            eye = (self.turn.T @ -self.view.axes[:, 2]) / self.size
            return _ring_around(unit(eye), 0.0, 1.0)
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
    # A size of 0 stands for a plane without end: as far as the camera sees.
    endless = 2 * body.model.vis.map.zfar * body.model.stat.extent
    size = np.where(body.size > 0, body.size, endless) * (1, 1, 0)
    body.face(_SQUARE * size, np.array([0.0, 0.0, 1.0]), is_large=True)


def _draw_ellipsoid(body: _Body) -> None:
    body.bands(body.silhouette() * body.size, np.zeros((1, 3)))


def _draw_capsule(body: _Body) -> None:
    radius, half = body.size[0], body.size[2]
    body.size = np.full(3, radius)
    body.bands(body.silhouette() * radius, np.array([[0.0, 0, half], [0, 0, -half]]))


def _draw_cylinder(body: _Body) -> None:
    ring, half = _RING * body.size[0], body.size[2]
    body.bands(ring, np.array([[0.0, 0, half], [0, 0, -half]]))
    for end in (-1.0, 1.0):
        normal = np.array([0.0, 0.0, end])
        body.face(ring + half * normal, normal)


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
    """The corners of the convex hull of points, shape (n, 2), going around it."""
    return points[hull_indices(points)]


def hull_indices(points: Points) -> list[int]:
    """Which of some points, shape (n, 2), are the corners of their hull, going around it.

    Andrew's monotone chain (1979, doi:10.1016/0020-0190(79)90072-3). Of very many points only
    those that lie farthest in one of some directions are looked at.
    """
    rows = np.arange(len(points))
    if len(points) > _MANY_POINTS:
        rows = np.unique(np.argmax(points @ _DIRECTIONS, axis=0))
    ordered = sorted(zip(*points[rows].T.tolist(), rows.tolist(), strict=True))
    return _half_hull(ordered) + _half_hull(ordered[::-1])


def _half_hull(ordered: list[tuple[float, float, int]]) -> list[int]:
    """The chain from the first to the last point, without the last."""
    chain: list[tuple[float, float, int]] = []
    for x, y, row in ordered:
        while len(chain) >= 2:
            (x0, y0, _), (x1, y1, _) = chain[-2], chain[-1]
            if (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0) > 0:
                break
            chain.pop()
        chain.append((x, y, row))
    return [row for _, _, row in chain[:-1] or chain]


def _in_front(points: Points, view: View) -> Points:
    """Points, shape (n, 3), whose hull is the part before the near plane of their own hull."""
    ahead = (points - view.position) @ view.axes[:, 2] - view.near
    if ahead.min() >= 0 or ahead.max() < 0:
        return points if ahead.max() >= 0 else points[:0]
    near, far = points[ahead < 0], points[ahead >= 0]
    share = ahead[ahead >= 0][:, None] / (ahead[ahead >= 0][:, None] - ahead[ahead < 0])
    cuts = far[:, None] + share[..., None] * (near[None] - far[:, None])
    return np.concatenate([far, cuts.reshape(-1, 3)])


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
    first = unit(np.cross(axis, helper))
    second = np.cross(axis, first)
    return along * axis + radius * (_RING[:, :1] * first + _RING[:, 1:2] * second)
