"""Frames of a cart-pole: a state in, a picture out."""

import sys
from collections.abc import Callable
from typing import Final, Literal, get_args

import mujoco
import numpy as np
import numpy.typing as npt

from mjcartpole.errors import RenderError, check_known
from mjcartpole.media import gl
from mjcartpole.media.backend_probe import Backend
from mjcartpole.media.quality import DEFAULT_QUALITY, Quality
from mjcartpole.media.scene import DEFAULT_CAMERA, Box, Scene
from mjcartpole.media.turns import Renderer, drawing
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.task import CARTPOLE_V1, Task

Kind = Literal["auto", "egl", "osmesa", "glfw", "sketch"]
"""Who draws: an OpenGL backend, the sketch renderer, or the best that works here."""

DEFAULT_WIDTH: Final = 640
DEFAULT_HEIGHT: Final = 480
"""Pixels of a picture, unless told otherwise."""


def open_renderer(
    cartpole: CartPole,
    *,
    width: int = DEFAULT_WIDTH,
    height: int = DEFAULT_HEIGHT,
    camera: str = DEFAULT_CAMERA,
    quality: Quality = DEFAULT_QUALITY,
    kind: Kind = "auto",
    task: Task = CARTPOLE_V1,
) -> Renderer:
    """Open a renderer for a model.

    Args:
        cartpole: The model.
        width: Pixels.
        height: Pixels.
        camera: The name of one of the model's cameras. A model without any is seen by a free
            camera that frames the track.
        quality: `"normal"` draws as the model's `<visual><quality>` says, `"draft"` without
            multisampling, shadows and reflections, `"high"` at twice the width and height, which
            is then reduced.
        kind: `"auto"` takes OpenGL where it works and the sketch renderer where it does not.
        task: Whose limits are shown: the fan at the hinge, and as far as a free camera sees.

    Raises:
        RenderError: An unknown camera, quality or kind, a size that makes no sense, or an OpenGL
            backend that was asked for by name and does not work.
    """
    check_known("renderer", kind, get_args(Kind), RenderError)
    with drawing():
        return _open(Scene(cartpole, width, height, camera, quality, task), kind)


def _open(scene: Scene, kind: Kind) -> Renderer:
    if kind == "sketch":
        return _sketch(scene)
    if kind != "auto":
        return _open_by_name(scene, kind)
    backend = gl.find_backend()
    if backend is None:
        return _sketch(scene)
    try:
        return GLRenderer(scene, backend)
    except RenderError:
        return _sketch(scene)


def _sketch(scene: Scene) -> Renderer:
    from mjcartpole.media.sketch import SketchRenderer  # noqa: PLC0415 - OpenGL needs no Pillow

    return SketchRenderer(scene)


def _open_by_name(scene: Scene, backend: Backend) -> "GLRenderer":
    if not gl.can_use(backend):
        raise RenderError(
            f"OpenGL by {backend} does not work here; use 'auto', which takes what does, "
            "or 'sketch', which needs no OpenGL"
        )
    return GLRenderer(scene, backend)


class GLRenderer(Renderer):
    """Draws with MuJoCo's own OpenGL renderer.

    On a CPU, time goes with pixels. Where camera and lights stand still, only the box around what
    moves is drawn for each frame, through a part of the camera's window; the rest comes from a
    picture made once.
    """

    def __init__(self, scene: Scene, backend: Backend) -> None:
        """Make a context and MuJoCo's resources in it.

        Raises:
            RenderError: The backend gives no context, or MuJoCo cannot draw into it.
        """
        super().__init__(backend, scene)
        self._whole: Box = (0, 0, scene.width, scene.height)
        self._has_background = scene.is_still and scene.is_local
        self._background: npt.NDArray[np.uint8] | None = None
        self._drawing: mujoco.MjrContext | None = None
        enlargement = scene.level.enlargement
        self._context = gl.make_context(
            backend, scene.width * enlargement, scene.height * enlargement
        )
        gl.close_at_exit(self)
        try:
            self._prepare()
        except (mujoco.FatalError, RuntimeError) as error:
            self.close()
            raise RenderError(f"MuJoCo cannot draw by {backend}: {error}") from error

    def _prepare(self) -> None:
        self._context.make_current()
        try:
            self._drawing = mujoco.MjrContext(self.scene.model, mujoco.mjtFontScale.mjFONTSCALE_100)
            mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._drawing)
        finally:
            self._context.release()

    def _render(self, state: npt.ArrayLike) -> npt.NDArray[np.uint8]:
        if self._drawing is None:
            raise RenderError("the renderer is closed; open another one")
        if self._has_background and self._background is None:
            self.scene.show(state)
            self.scene.hide_moving()
            self._background = self._draw(self._whole)
        self.scene.show(state)
        box = None if self._background is None else self.scene.moving_box()
        if box is None or self._background is None:
            return self._draw(self._whole)
        frame = self._background.copy()
        left, top, right, bottom = box
        if left < right and top < bottom:
            frame[top:bottom, left:right] = self._draw(box)
        return frame

    def _draw(self, box: Box) -> npt.NDArray[np.uint8]:
        """Draw what lies in a box of the picture; shape (bottom - top, right - left, 3)."""
        left, top, right, bottom = box
        if box != self._whole:
            _look_through(self.scene, box)
        factor = self.scene.level.enlargement
        width, height = (right - left) * factor, (bottom - top) * factor
        rectangle = mujoco.MjrRect(0, 0, width, height)
        flipped = np.empty((height, width, 3), dtype=np.uint8)
        assert self._drawing is not None  # `_render` has refused a closed one.
        self._context.make_current()
        try:
            mujoco.mjr_render(rectangle, self.scene.abstract, self._drawing)
            mujoco.mjr_readPixels(flipped, None, rectangle, self._drawing)
        finally:
            self._context.release()
        # OpenGL's first row is the lowest.
        pixels = flipped[::-1]
        if factor == 1:
            return pixels.copy() if box == self._whole else pixels
        from mjcartpole.media.pillow import Image  # noqa: PLC0415 - other qualities need none

        return np.array(Image.fromarray(pixels).reduce(factor))

    def close(self) -> None:
        """Free MuJoCo's resources, then the context; a second call does nothing."""
        if self._context.is_lost:
            return  # A fork's copy: it belongs to the process that made it.
        with self.taking_turns():
            resources, self._drawing = self._drawing, None
            if resources is not None:
                self._context.make_current()
                resources.free()
                self._context.release()
            self._context.free()

    def __del__(self, is_exiting: Callable[[], bool] = sys.is_finalizing) -> None:
        # Frees in order where nobody has; __init__ may have failed before there was anything. At
        # the very end modules are gone, and all goes with the process.
        if hasattr(self, "_context") and not is_exiting():
            self.close()


def _look_through(scene: Scene, box: Box) -> None:
    """Narrow the camera's window, until the scene's next `show`, to a box of the picture."""
    left, top, right, bottom = box
    for camera in scene.abstract.camera:
        middle = (camera.frustum_top + camera.frustum_bottom) / 2
        half_height = (camera.frustum_top - camera.frustum_bottom) / 2
        half_width = camera.frustum_width or half_height * scene.width / scene.height
        low, high = (
            camera.frustum_center + half_width * (2 * column / scene.width - 1)
            for column in (left, right)
        )
        camera.frustum_center, camera.frustum_width = (low + high) / 2, (high - low) / 2
        camera.frustum_top, camera.frustum_bottom = (
            middle + half_height * (1 - 2 * row / scene.height) for row in (top, bottom)
        )
