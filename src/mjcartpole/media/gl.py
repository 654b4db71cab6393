"""Which OpenGL works here, found out before it can do harm, and contexts to draw into.

MuJoCo draws into any OpenGL context that is current, and `mujoco.egl` or `mujoco.osmesa` make one
without a screen, whatever `MUJOCO_GL` said when mujoco was imported. So nothing has to be set
before that import; what has to be avoided is trying a backend that does not work (see
`backend_probe.py`), and one that does not go with what this process has done before:

- PyOpenGL settles on one platform at its first import and cannot be talked out of it, unless that
  platform is not there, so that nothing can have been done with it;
- a fork copies a driver without its threads, and the copy waits for them forever;
- MuJoCo's C library asks `MUJOCO_GL` itself which library has OpenGL's functions, when its first
  context is made, and otherwise prefers EGL's to OSMesa's where both are loaded.
"""

import atexit
import functools
import importlib
import logging
import os
import sys
import threading
import weakref
from types import ModuleType
from typing import Final, get_args

from mjcartpole.errors import RenderError, check_known
from mjcartpole.media import backend_probe
from mjcartpole.media.backend_probe import PLATFORM_VARIABLE, try_backend
from mjcartpole.media.turns import Renderer, end_drawing

Backend = backend_probe.Backend

VARIABLE: Final = "MUJOCO_GL"
"""The environment variable by which MuJoCo's users choose; it is left as it was found."""

OFF: Final = frozenset({"disable", "disabled", "off", "false", "0"})
"""Values of the variable that mean: no OpenGL."""

_DEFAULT: Final = frozenset({"", "enable", "enabled", "on", "true", "1"})
_WINDOW_SYSTEMS: Final = frozenset({"glfw", "glx", "wgl", "cgl"})

_FORKED: Final = "this process was forked from one that had used OpenGL (spawn it instead)"
_BY_PYOPENGL: Final[dict[str, Backend]] = {"egl": "egl", "osmesa": "osmesa"}
"""The backends that go through PyOpenGL, by its names for their platforms."""

_log = logging.getLogger("mjcartpole")
_lock = threading.RLock()
_used = False
_forked = False


class Context:
    """An OpenGL context without a window, and the order in which it has to be handled.

    It belongs to the process that made it: a fork leaves the copy without the driver's threads.
    """

    def __init__(self, backend: Backend, width: int, height: int) -> None:
        global _used  # noqa: PLW0603 - a fork has to know
        self.backend = backend
        self._process = os.getpid()
        self._setting: _Setting | None = None
        self._is_new = True
        # mujoco.egl opens its display with the first context; two threads would open it twice.
        with _lock:
            _used = True
            self._module = _import_backend(backend)
            self._context = self._module.GLContext(width, height)
            _contexts.add(self)

    @property
    def is_lost(self) -> bool:
        """Whether this is a fork's copy, which can neither be drawn into nor freed."""
        return self._process != os.getpid()

    def make_current(self) -> None:
        """Let the calling thread draw into this context, until `release`.

        The first time is for MuJoCo to load OpenGL, which threads do one after the other.

        Raises:
            RenderError: This process was forked from the one that made the context.
        """
        if self.is_lost:
            raise RenderError(
                "a renderer cannot be used in a process forked from the one that opened it; "
                "open it in the new process, or start processes by 'spawn'"
            )
        if self._is_new:
            self._is_new = False
            self._setting = _Setting(self.backend)
        try:
            self._context.make_current()
        except BaseException:
            self._restore()
            raise

    def release(self) -> None:
        """Let go of this context, so that any other thread may draw into it or free it."""
        if self.is_lost:
            return
        self._restore()
        if self.backend == "egl":
            egl = self._module.EGL
            display = self._module.EGL_DISPLAY
            egl.eglMakeCurrent(display, egl.EGL_NO_SURFACE, egl.EGL_NO_SURFACE, egl.EGL_NO_CONTEXT)
        elif self.backend == "osmesa":
            self._module.osmesa.OSMesaMakeCurrent(None, None, self._module.GL.GL_FLOAT, 0, 0)
        elif hasattr(self._module, "glfw"):
            self._module.glfw.make_context_current(None)

    def _restore(self) -> None:
        setting, self._setting = self._setting, None
        if setting is not None:
            setting.undo()

    def free(self) -> None:
        """Free the context; a second call does nothing."""
        context, self._context = self._context, None
        if context is not None and not self.is_lost:
            with _lock:
                context.free()

    def abandon(self) -> None:
        """Forget what a fork has copied; even MuJoCo's __del__ must not hand it to the driver."""
        context, self._context = self._context, None
        if context is not None:
            context._context = None


class _Setting:
    """`MUJOCO_GL` as MuJoCo's C library has to find it; one thread at a time."""

    def __init__(self, backend: Backend) -> None:
        _lock.acquire()
        self._lock = _lock
        self._before = os.environ.get(VARIABLE)
        os.environ[VARIABLE] = backend

    def undo(self) -> None:
        """Have it as it was."""
        if self._before is None:
            del os.environ[VARIABLE]
        else:
            os.environ[VARIABLE] = self._before
        self._lock.release()


def find_backend() -> Backend | None:
    """The first backend that works in this process, or None if none does or OpenGL is off.

    What `MUJOCO_GL` names is tried first; if it does not work, one line of the log says why, and
    the others are tried.
    """
    found = next((backend for backend in candidates() if can_use(backend)), None)
    _explain_wish(_wish(), found)
    return found


def candidates() -> tuple[Backend, ...]:
    """The backends worth trying, best first."""
    if _wish() in OFF:
        return ()
    order: tuple[Backend, ...] = ("egl", "osmesa") if sys.platform == "linux" else ("glfw",)
    named = _named(_wish())
    if named is None or not _is_for_this_system(named):
        return order
    return (named, *(other for other in order if other != named))


def can_use(backend: Backend) -> bool:
    """Whether a backend works here and fits what this process has already done."""
    return not why_not(backend)


def why_not(backend: Backend) -> str:
    """Why a backend cannot be used in this process, in one clause; empty if it can."""
    if _forked:
        return _FORKED
    loaded = _loaded_platform()
    if backend not in ("glfw", loaded) and _is_alive(loaded):
        return f"this process has imported PyOpenGL for {loaded}"
    return try_backend(backend).reason


def why_not_as_wished() -> str:
    """What is wrong with the value of `MUJOCO_GL`, in one clause; empty if nothing is."""
    wish = _wish()
    if wish in OFF | _DEFAULT:
        return ""
    named = _named(wish)
    if named is None:
        return f"names no OpenGL backend (there are {', '.join(get_args(Backend))})"
    if not _is_for_this_system(named):
        return "is for Linux only"
    why = why_not(named)
    return f"does not work here: {why}" if why else ""


def works(backend: Backend) -> bool:
    """Whether MuJoCo can draw with a backend here, in a process of its own."""
    return try_backend(backend).works


def make_context(backend: Backend, width: int, height: int) -> Context:
    """Make an OpenGL context; its maker frees it, in the order MuJoCo's context, then this one.

    The backend is one that `works`; pixels are those of the largest picture.

    Raises:
        RenderError: There is no such backend, or it gives no context.
    """
    check_known("OpenGL backend", backend, get_args(Backend), RenderError)
    try:
        return Context(backend, width, height)
    except Exception as error:  # PyOpenGL and the drivers raise about everything here.
        raise RenderError(f"OpenGL by {backend} gives no context: {error}") from error


_contexts: "weakref.WeakSet[Context]" = weakref.WeakSet()
_open: "weakref.WeakSet[Renderer]" = weakref.WeakSet()


def close_at_exit(renderer: Renderer) -> None:
    """Have a renderer closed when the interpreter exits, if nobody has closed it before.

    Call it after the renderer's context is made: functions registered last run first, and MuJoCo
    registers the end of EGL itself when the first context is made. A context freed later than
    that fails, with a message nobody can act on.
    """
    with _lock:
        _open.add(renderer)
        _register_once()


@functools.cache
def _register_once() -> None:
    atexit.register(_close_all)


def _close_all() -> None:
    end_drawing()
    for renderer in list(_open):
        renderer.close()


def _after_fork() -> None:
    """Have a forked process leave the OpenGL of its parent alone, also when it exits."""
    global _lock, _forked  # noqa: PLW0603 - the parent's must not be used
    _lock = threading.RLock()
    _forked = _forked or _used
    _open.clear()
    for context in list(_contexts):
        context.abandon()
    egl = sys.modules.get("mujoco.egl")
    if egl is not None:
        atexit.unregister(egl.EGL.eglTerminate)


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)


def _wish() -> str:
    return os.environ.get(VARIABLE, "").strip().lower()


def _named(wish: str) -> Backend | None:
    """The backend that a value of `MUJOCO_GL` names, if it names one."""
    if wish in _WINDOW_SYSTEMS:
        return "glfw"
    return next((backend for backend in get_args(Backend) if backend == wish), None)


@functools.cache
def _explain_wish(wish: str, found: Backend | None) -> None:
    """Say once why it is not what the user wished, if that is so."""
    why = why_not_as_wished()
    instead = found or "the sketch renderer, which needs no OpenGL"
    if why and _named(wish) != found:
        _log.warning("%s=%s %s; pictures are drawn by %s", VARIABLE, wish, why, instead)
    elif _forked and wish not in OFF:
        _log.warning("%s; pictures are drawn by %s", _FORKED, instead)


def _is_for_this_system(backend: Backend) -> bool:
    return backend == "glfw" or sys.platform == "linux"


def _loaded_platform() -> str:
    """The platform that PyOpenGL has settled on in this process: egl, osmesa, glx…; or empty."""
    loaded = getattr(sys.modules.get("OpenGL.platform"), "PLATFORM", None)
    return type(loaded).__name__.lower().removesuffix("platform") if loaded else ""


def _is_alive(platform: str) -> bool:
    """Whether PyOpenGL can do anything with the platform that it has settled on.

    It cannot where `MUJOCO_GL` named a backend that is not there when mujoco was imported.
    """
    dead = platform in _BY_PYOPENGL and not works(_BY_PYOPENGL[platform])
    return bool(platform) and not dead


def _forget_pyopengl() -> None:
    """Have PyOpenGL imported anew, for another platform."""
    for name in list(sys.modules):
        if name.split(".")[0] == "OpenGL" or name.startswith(("mujoco.egl", "mujoco.osmesa")):
            del sys.modules[name]


def _import_backend(backend: Backend) -> ModuleType:
    """Import MuJoCo's module for a backend without leaving a trace in the environment.

    The module sets PYOPENGL_PLATFORM, which processes started later would inherit; one that
    wants another backend could then not even import mujoco. It refuses one that the user set.
    """
    if backend != "glfw" and _loaded_platform() not in ("", backend):
        _forget_pyopengl()
    name = "cgl" if backend == "glfw" and sys.platform == "darwin" else backend
    before = os.environ.pop(PLATFORM_VARIABLE, None)
    try:
        return importlib.import_module(f"mujoco.{name}")
    finally:
        os.environ.pop(PLATFORM_VARIABLE, None)
        if before is not None:
            os.environ[PLATFORM_VARIABLE] = before
