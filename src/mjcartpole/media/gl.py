"""Which OpenGL works here, found out before it can do harm.

MuJoCo draws into any OpenGL context that is current, and `mujoco.egl` or `mujoco.osmesa` make one
without a screen, whatever `MUJOCO_GL` said when mujoco was imported. So nothing has to be set
before that import; what has to be avoided is trying a backend that does not work:

- a broken driver can end the process, so each backend is first tried in a process of its own;
- PyOpenGL settles on one platform at its first import and cannot be talked out of it, so the
  backend that this process imports has to be the right one.
"""

import atexit
import ctypes
import ctypes.util
import functools
import importlib
import os
import subprocess
import sys
import weakref
from types import ModuleType
from typing import Final, Literal, Protocol, get_args

from mjcartpole.errors import RenderError

Backend = Literal["egl", "osmesa", "glfw"]
"""Who makes the context; `glfw` stands for the window system that MuJoCo uses by default."""

VARIABLE: Final = "MUJOCO_GL"
"""The environment variable by which MuJoCo's users choose; read here, never set."""

_OFF: Final = frozenset({"disable", "disabled", "off", "false", "0"})
_WINDOW_SYSTEMS: Final = frozenset({"glfw", "glx", "wgl", "cgl"})
_LIBRARIES: Final = {"egl": ("EGL", "libEGL.so.1"), "osmesa": ("OSMesa", "libOSMesa.so.8")}
_PROBE_SECONDS: Final = 20.0

# Makes a context, lets MuJoCo load OpenGL through it, and leaves without any clean-up, since
# only the exit code matters. MuJoCo reports failure by ending the process or by an exception.
_PROBE: Final = """
import importlib, os, mujoco
context = importlib.import_module("mujoco." + {module!r}).GLContext(16, 16)
context.make_current()
xml = '<mujoco><visual><quality shadowsize="0" offsamples="0"/></visual></mujoco>'
drawing = mujoco.MjrContext(mujoco.MjModel.from_xml_string(xml), 50)
mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, drawing)
os._exit(0 if drawing.currentBuffer == mujoco.mjtFramebuffer.mjFB_OFFSCREEN else 3)
"""


class Closeable(Protocol):
    """Something that frees what it holds when told to."""

    def close(self) -> None:
        """Free it; a second call does nothing."""


class Context:
    """An OpenGL context without a window, and the order in which it has to be handled."""

    def __init__(self, backend: Backend, width: int, height: int) -> None:
        self.backend = backend
        module = _import_backend(backend)
        self._module = module
        self._context = module.GLContext(width, height)

    def make_current(self) -> None:
        """Let the calling thread draw into this context."""
        self._context.make_current()

    def release(self) -> None:
        """Let go of this context, so that any other thread may draw into it or free it."""
        if self.backend == "egl":
            egl = self._module.EGL
            display = self._module.EGL_DISPLAY
            egl.eglMakeCurrent(display, egl.EGL_NO_SURFACE, egl.EGL_NO_SURFACE, egl.EGL_NO_CONTEXT)
        elif self.backend == "osmesa":
            self._module.osmesa.OSMesaMakeCurrent(None, None, self._module.GL.GL_FLOAT, 0, 0)
        elif hasattr(self._module, "glfw"):
            self._module.glfw.make_context_current(None)

    def free(self) -> None:
        """Free the context; a second call does nothing."""
        context, self._context = self._context, None
        if context is not None:
            context.free()


def find_backend() -> Backend | None:
    """The first backend that works in this process, or None if none does or OpenGL is off.

    What `MUJOCO_GL` names is tried first; if it does not work, the others are tried.
    """
    return next((backend for backend in candidates() if can_use(backend)), None)


def candidates() -> tuple[Backend, ...]:
    """The backends worth trying, best first."""
    wish = os.environ.get(VARIABLE, "").strip().lower()
    if wish in _OFF:
        return ()
    order: tuple[Backend, ...] = ("egl", "osmesa") if sys.platform == "linux" else ("glfw",)
    if wish in _WINDOW_SYSTEMS:
        wish = "glfw"
    for backend in get_args(Backend):
        if backend == wish and _is_for_this_system(backend):
            order = (backend, *(other for other in order if other != backend))
    return order


def can_use(backend: Backend) -> bool:
    """Whether a backend works here and fits what this process has already imported."""
    return _fits_loaded_platform(backend) and works(backend)


@functools.cache
def works(backend: Backend) -> bool:
    """Whether MuJoCo can draw with a backend here; found out once, in a process of its own."""
    if not _has_library(backend):
        return False
    code = _PROBE.format(module=_module_name(backend))
    # MuJoCo's import must not fail on the user's setting: the probe names its module itself.
    environment = {**os.environ, VARIABLE: "disable"}
    try:
        probe = subprocess.run(
            [sys.executable, "-P", "-c", code],
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            timeout=_PROBE_SECONDS,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return False
    return probe.returncode == 0


def make_context(backend: Backend, width: int, height: int) -> Context:
    """Make an OpenGL context; its maker frees it, in the order MuJoCo's context, then this one.

    Args:
        backend: One that `works`.
        width: Pixels of the largest picture.
        height: Pixels of the largest picture.

    Raises:
        RenderError: There is no such backend, or it gives no context.
    """
    if backend not in get_args(Backend):
        raise RenderError(
            f"OpenGL backend {backend!r} is unknown; available: {', '.join(get_args(Backend))}"
        )
    try:
        return Context(backend, width, height)
    except Exception as error:  # PyOpenGL and the drivers raise about everything here.
        raise RenderError(f"OpenGL by {backend} gives no context: {error}") from error


_open: "weakref.WeakSet[Closeable]" = weakref.WeakSet()


def close_at_exit(renderer: Closeable) -> None:
    """Have a renderer closed when the interpreter exits, if nobody has closed it before.

    Call it after the renderer's context is made: functions registered last run first, and MuJoCo
    registers the end of EGL itself when the first context is made. A context freed later than
    that fails, with a message nobody can act on.
    """
    _open.add(renderer)
    _register_once()


@functools.cache
def _register_once() -> None:
    atexit.register(_close_all)


def _close_all() -> None:
    for renderer in list(_open):
        renderer.close()


def _is_for_this_system(backend: Backend) -> bool:
    return backend == "glfw" or sys.platform == "linux"


def _fits_loaded_platform(backend: Backend) -> bool:
    """Whether PyOpenGL, if this process has imported it, has settled on this backend."""
    loaded = getattr(sys.modules.get("OpenGL.platform"), "PLATFORM", None)
    if loaded is None or backend == "glfw":
        return True
    return type(loaded).__name__.lower().startswith(backend)


def _has_library(backend: Backend) -> bool:
    """Whether the backend's library can be loaded at all; a cheap look before the probe."""
    if backend not in _LIBRARIES:
        return True
    name, file = _LIBRARIES[backend]
    return _can_load(file) or _can_load(ctypes.util.find_library(name))


def _can_load(library: str | None) -> bool:
    try:
        return library is not None and bool(ctypes.CDLL(library))
    except OSError:
        return False


def _module_name(backend: Backend) -> str:
    return "cgl" if backend == "glfw" and sys.platform == "darwin" else backend


def _import_backend(backend: Backend) -> ModuleType:
    """Import MuJoCo's module for a backend without leaving a trace in the environment.

    The module sets PYOPENGL_PLATFORM, which processes started later would inherit; one that
    wants another backend could then not even import mujoco.
    """
    before = os.environ.get("PYOPENGL_PLATFORM")
    try:
        return importlib.import_module(f"mujoco.{_module_name(backend)}")
    finally:
        if before is None:
            os.environ.pop("PYOPENGL_PLATFORM", None)
