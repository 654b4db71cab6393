"""A program of its own: try one OpenGL backend, say in one line of JSON what came of it, and end.

    python probe_process.py egl|osmesa|glfw

A broken driver can end the process that tries it, and PyOpenGL cannot be talked out of the platform
of its first import; so the trial happens here, and `backend_probe.py` reads the answer. Nothing of
mjcartpole is imported: this file is run by its path, so that nothing but MuJoCo has to start.
"""

import contextlib
import ctypes
import importlib
import json
import os
import sys
from collections.abc import Callable
from types import ModuleType
from typing import Any, Final

# For each backend, groups of libraries of which one has to be there: the backend's own, and the
# one in which PyOpenGL looks for OpenGL itself.
_LIBRARIES: Final = {
    "egl": (("libEGL.so.1",), ("libOpenGL.so.0", "libGL.so.1")),
    "osmesa": (("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"),),
}
_STRINGS: Final = {"vendor": 0x1F00, "renderer": 0x1F01, "version": 0x1F02}
"""OpenGL's numbers for what glGetString tells."""


def main(backend: str) -> dict[str, str]:
    """Try a backend; the answer has `cause` and `reason` where it does not work."""
    _leave_no_core_dump()
    missing = _missing_library(backend)
    if missing:
        return {"cause": "library", "reason": missing}
    try:
        return _draw(backend)
    except Exception as error:  # PyOpenGL and the drivers raise about everything here.
        return _explain(backend, error)


def _draw(backend: str) -> dict[str, str]:
    """Make a context, let MuJoCo load OpenGL through it, and ask the driver for its name."""
    import mujoco  # noqa: PLC0415 - after the cheap look for libraries

    name = "cgl" if backend == "glfw" and sys.platform == "darwin" else backend
    module = importlib.import_module(f"mujoco.{name}")
    context = module.GLContext(16, 16)
    if name == "glfw" and not context._context:
        return {"cause": "screen", "reason": _glfw_reason(module.glfw)}
    context.make_current()
    # MuJoCo's C library asks it which library has OpenGL's functions.
    os.environ["MUJOCO_GL"] = backend
    xml = '<mujoco><visual><quality shadowsize="0" offsamples="0"/></visual></mujoco>'
    drawing = mujoco.MjrContext(mujoco.MjModel.from_xml_string(xml), 50)
    mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, drawing)
    if drawing.currentBuffer != mujoco.mjtFramebuffer.mjFB_OFFSCREEN:
        return {"cause": "driver", "reason": "its driver cannot draw off the screen"}
    with contextlib.suppress(Exception):  # The driver's name is nice to have.
        return _driver(name, module)
    return {}


def _missing_library(backend: str) -> str:
    """Why a library that the backend needs cannot be loaded; empty if all can."""
    groups = _LIBRARIES.get(backend, ()) if sys.platform == "linux" else ()
    for group in groups:
        problems = [_load(library) for library in group]
        if all(problems):
            # One that is there and broken says more than those that are not there.
            return next((one for one in problems if "not installed" not in one), problems[0])
    return ""


def _load(library: str) -> str:
    """Why a library cannot be loaded; empty if it can."""
    try:
        ctypes.CDLL(library)
    except OSError as error:
        if f"{library}: cannot open shared object file" in str(error):
            return f"{library} is not installed"
        return f"{library} cannot be loaded ({error})"
    return ""


def _glfw_reason(glfw: ModuleType) -> str:
    if glfw.init():
        glfw.create_window(16, 16, "", None, None)
    _, message = glfw.get_error()
    return f"GLFW says '{message.decode() if message else 'no window'}'"


def _explain(backend: str, error: Exception) -> dict[str, str]:
    text = " ".join(str(error).split()) or type(error).__name__
    if backend == "egl" and "EGL device display" in text:
        return {"cause": "driver", "reason": "EGL finds no device with a driver that it can use"}
    return {"cause": "driver", "reason": text}


def _driver(name: str, module: ModuleType) -> dict[str, str]:
    """What OpenGL says of its driver; asked without PyOpenGL's GL, which takes long to import."""
    addresses: dict[str, Callable[[], Any]] = {
        "egl": lambda: ctypes.CDLL("libEGL.so.1").eglGetProcAddress,
        "osmesa": lambda: ctypes.CDLL("libOSMesa.so.8").OSMesaGetProcAddress,
    }
    if name == "glfw":
        address = module.glfw.get_proc_address("glGetString")
    else:
        find = addresses[name]()
        find.restype = ctypes.c_void_p
        address = find(b"glGetString")
    get_string = ctypes.CFUNCTYPE(ctypes.c_char_p, ctypes.c_uint)(address)
    return {key: (get_string(number) or b"").decode() for key, number in _STRINGS.items()}


def _leave_no_core_dump() -> None:
    with contextlib.suppress(ImportError, OSError, ValueError):
        import resource  # noqa: PLC0415 - not on Windows

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


if __name__ == "__main__":
    # Drivers may write to stdout: the answer is the last line. No clean-up, which a driver might
    # not survive: the answer is known.
    answer = main(sys.argv[1])
    sys.stdout.write("\n" + json.dumps(answer) + "\n")
    sys.stdout.flush()
    os._exit(0)
