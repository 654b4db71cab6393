"""Frames of a cart-pole: a state in, a picture out."""

from types import TracebackType
from typing import Final, Literal, Protocol, Self, get_args

import mujoco
import numpy as np
import numpy.typing as npt

from mjcartpole.errors import RenderError
from mjcartpole.media import gl
from mjcartpole.media.scene import DEFAULT_CAMERA, Scene
from mjcartpole.media.sketch import SketchRenderer
from mjcartpole.physics.model import CartPole

Kind = Literal["auto", "egl", "osmesa", "glfw", "sketch"]
"""Who draws: an OpenGL backend, the sketch renderer, or the best that works here."""

DEFAULT_WIDTH: Final = 640
DEFAULT_HEIGHT: Final = 480
"""Pixels of a picture, unless told otherwise."""


class Renderer(Protocol):
    """Draws states; a context manager that closes itself at the end.

    Attributes:
        kind: Who draws: `"egl"`, `"osmesa"`, `"glfw"` or `"sketch"`.
    """

    kind: str

    def render(self, state: npt.ArrayLike) -> npt.NDArray[np.uint8]:
        """Draw a state `(x, x_dot, theta, theta_dot)`; m, m/s, rad, rad/s.

        Returns:
            A new array of shape (height, width, 3), red, green, blue.
        """

    def close(self) -> None:
        """Free what it holds; a second call does nothing."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None: ...


def open_renderer(
    cartpole: CartPole,
    *,
    width: int = DEFAULT_WIDTH,
    height: int = DEFAULT_HEIGHT,
    camera: str = DEFAULT_CAMERA,
    kind: Kind = "auto",
) -> Renderer:
    """Open a renderer for a model.

    Args:
        cartpole: The model.
        width: Pixels.
        height: Pixels.
        camera: The name of one of the model's cameras. A model without any is seen by a free
            camera that frames the track.
        kind: `"auto"` takes OpenGL where it works and the sketch renderer where it does not.

    Raises:
        RenderError: An unknown camera or kind, a size that makes no sense, or an OpenGL backend
            that was asked for by name and does not work.
    """
    if kind not in get_args(Kind):
        raise RenderError(f"renderer {kind!r} is unknown; available: {', '.join(get_args(Kind))}")
    scene = Scene(cartpole, width, height, camera)
    if kind == "sketch":
        return SketchRenderer(scene)
    if kind != "auto":
        return _open_by_name(scene, kind)
    backend = gl.find_backend()
    if backend is None:
        return SketchRenderer(scene)
    try:
        return GLRenderer(scene, backend)
    except RenderError:
        return SketchRenderer(scene)


def _open_by_name(scene: Scene, backend: gl.Backend) -> "GLRenderer":
    if not gl.can_use(backend):
        raise RenderError(
            f"OpenGL by {backend} does not work here; use 'auto', which takes what does, "
            "or 'sketch', which needs no OpenGL"
        )
    return GLRenderer(scene, backend)


class GLRenderer:
    """Draws with MuJoCo's own OpenGL renderer.

    Attributes:
        kind: The OpenGL backend.
    """

    def __init__(self, scene: Scene, backend: gl.Backend) -> None:
        """Make a context and MuJoCo's resources in it.

        Raises:
            RenderError: The backend gives no context, or MuJoCo cannot draw into it.
        """
        self.kind: str = backend
        self._scene = scene
        self._rectangle = mujoco.MjrRect(0, 0, scene.width, scene.height)
        self._flipped = np.empty((scene.height, scene.width, 3), dtype=np.uint8)
        self._drawing: mujoco.MjrContext | None = None
        self._context = gl.make_context(backend, scene.width, scene.height)
        gl.close_at_exit(self)
        try:
            self._prepare()
        except (mujoco.FatalError, RuntimeError) as error:
            self.close()
            raise RenderError(f"MuJoCo cannot draw by {backend}: {error}") from error

    def _prepare(self) -> None:
        self._context.make_current()
        try:
            self._drawing = mujoco.MjrContext(
                self._scene.model, mujoco.mjtFontScale.mjFONTSCALE_100
            )
            mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._drawing)
        finally:
            self._context.release()

    def render(self, state: npt.ArrayLike) -> npt.NDArray[np.uint8]:
        """Draw a state `(x, x_dot, theta, theta_dot)`; m, m/s, rad, rad/s.

        Returns:
            A new array of shape (height, width, 3), red, green, blue.

        Raises:
            RenderError: The renderer is closed, or it is no state.
        """
        if self._drawing is None:
            raise RenderError("the renderer is closed; open another one")
        self._scene.show(state)
        self._context.make_current()
        try:
            mujoco.mjr_render(self._rectangle, self._scene.abstract, self._drawing)
            mujoco.mjr_readPixels(self._flipped, None, self._rectangle, self._drawing)
        finally:
            self._context.release()
        # OpenGL's first row is the lowest; the copy also makes the frame the caller's own.
        return self._flipped[::-1].copy()

    def close(self) -> None:
        """Free MuJoCo's resources, then the context; a second call does nothing."""
        drawing, self._drawing = self._drawing, None
        if drawing is not None:
            self._context.make_current()
            drawing.free()
            self._context.release()
        self._context.free()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def __del__(self) -> None:
        # Frees in order where nobody has; __init__ may have failed before there was anything.
        if hasattr(self, "_context"):
            self.close()
