"""Frames without OpenGL: MuJoCo's geoms as shaded polygons, drawn by Pillow.

Each geom becomes a few flat polygons in pixels (`outlines.py`), drawn from the farthest to the
nearest. Only the box around what moves is drawn again for each frame, at several times the size
and then reduced, which smooths the edges; the rest comes from a picture made once.
"""

import math
from typing import Final

import mujoco
import numpy as np
import numpy.typing as npt

from mjcartpole.errors import RenderError
from mjcartpole.media.outlines import Outline, outline_of, outline_of_wedge
from mjcartpole.media.pillow import Image, ImageDraw
from mjcartpole.media.scene import Box, Scene
from mjcartpole.media.turns import Renderer

_BLACK: Final = (0, 0, 0)
_OPAQUE: Final = 255


class SketchRenderer(Renderer):
    """Draws any cart-pole on any machine.

    It knows boxes, capsules, cylinders, spheres, ellipsoids, planes and (by their outline)
    meshes, the model's cameras, colours and lights; no shadows, reflections or textures.
    """

    def __init__(self, scene: Scene) -> None:
        super().__init__("sketch", scene)
        self._is_closed = False
        self._static: dict[int, Outline] = {}
        self._background: npt.NDArray[np.uint8] | None = None
        self._backdrop = _backdrop(scene.model)

    def _render(self, state: npt.ArrayLike) -> npt.NDArray[np.uint8]:
        scene = self.scene
        if self._is_closed:
            raise RenderError("the renderer is closed; open another one")
        scene.show(state)
        whole = (0, 0, scene.width, scene.height)
        if self._background is None:
            self._static = self._outline_static()
            self._background = self._draw(list(self._static.values()), whole)
        moving = self._outline_moving()
        frame = self._background.copy()
        box = _bounds(moving, whole)
        if box is not None:
            left, top, right, bottom = box
            outlines = [*self._static.values(), *moving]
            frame[top:bottom, left:right] = self._draw(outlines, box)
        return frame

    def _outline_static(self) -> dict[int, Outline]:
        """Outlines, by place in the scene, of geoms that look the same in every frame."""
        scene, geoms = self.scene, self.scene.abstract.geoms
        if not scene.is_still:
            return {}
        return {
            index: outline_of(geoms[index], scene)
            for index in range(scene.n_geoms)
            if scene.is_fixed(geoms[index])
        }

    def _outline_moving(self) -> list[Outline]:
        scene, geoms = self.scene, self.scene.abstract.geoms
        indices = [index for index in range(scene.n_geoms) if index not in self._static]
        wedges = [outline_of_wedge(wedge, scene.view) for wedge in scene.wedges]
        return [outline_of(geoms[index], scene) for index in indices] + wedges

    def _draw(self, outlines: list[Outline], box: Box) -> npt.NDArray[np.uint8]:
        """Draw what lies in a box of the picture; shape (bottom - top, right - left, 3)."""
        left, top, right, bottom = box
        factor = self.scene.level.oversampling
        size = ((right - left) * factor, (bottom - top) * factor)
        canvas = Image.new("RGB", size, self._backdrop)
        # The pen that blends is slower than the one that covers.
        pen, blending = ImageDraw.Draw(canvas), ImageDraw.Draw(canvas, "RGBA")
        for outline in sorted(outlines, key=lambda outline: outline.order):
            if not _meet(outline.bounds, box):
                continue
            for colour, points in outline.polygons:
                corners = (points - (left, top)) * factor
                if colour[3] == _OPAQUE:
                    pen.polygon(corners.ravel().tolist(), fill=colour[:3])
                else:
                    blending.polygon(corners.ravel().tolist(), fill=colour)
        return np.asarray(canvas.reduce(factor))

    def close(self) -> None:
        """Let go of the pictures; a second call does nothing."""
        self._is_closed = True
        self._background = None
        self._static = {}


def _bounds(outlines: list[Outline], whole: Box) -> Box | None:
    """The box around outlines, cut to the picture; None if nothing lies in it."""
    boxes = [outline.bounds for outline in outlines if outline.polygons]
    if not boxes:
        return None
    left = max(whole[0], math.floor(min(box[0] for box in boxes)) - 1)
    top = max(whole[1], math.floor(min(box[1] for box in boxes)) - 1)
    right = min(whole[2], math.ceil(max(box[2] for box in boxes)) + 1)
    bottom = min(whole[3], math.ceil(max(box[3] for box in boxes)) + 1)
    return (left, top, right, bottom) if left < right and top < bottom else None


def _meet(bounds: tuple[float, float, float, float], box: Box) -> bool:
    left, top, right, bottom = bounds
    return left < box[2] and right > box[0] and top < box[3] and bottom > box[1]


def _backdrop(model: mujoco.MjModel) -> tuple[int, int, int]:
    """What is seen past all geoms: the mean colour of the sky, or black, as OpenGL shows it."""
    skies = np.flatnonzero(model.tex_type == int(mujoco.mjtTexture.mjTEXTURE_SKYBOX))
    if not len(skies):
        return _BLACK
    sky = skies[0]
    channels = int(model.tex_nchannel[sky])
    start = int(model.tex_adr[sky])
    amount = int(model.tex_width[sky]) * int(model.tex_height[sky]) * channels
    pixels = model.tex_data[start : start + amount].reshape(-1, channels)
    red, green, blue = (int(value) for value in pixels[:, :3].mean(axis=0))
    return red, green, blue
