"""Does an OpenGL backend work here? Tried in a process of its own, once."""

import functools
import json
import os
import signal
import subprocess
import sys
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

Backend = Literal["egl", "osmesa", "glfw"]
"""Who makes the context; `glfw` stands for the window system that MuJoCo uses by default."""

Cause = Literal["", "library", "driver", "screen"]
"""What is missing; empty where nothing is."""

PLATFORM_VARIABLE: Final = "PYOPENGL_PLATFORM"
"""PyOpenGL's own choice of a platform, which `mujoco.egl` and `mujoco.osmesa` set."""

_PROBE: Final = Path(__file__).with_name("probe_process.py")
_PROBE_SECONDS: Final = 20.0
# What can turn a backend that does not work into one that does, or the other way round.
_SETTINGS: Final = ("DISPLAY", "WAYLAND_DISPLAY", "MUJOCO_EGL_DEVICE_ID")


@dataclass(frozen=True)
class Trial:
    """What came of trying a backend.

    Attributes:
        backend: The backend.
        works: Whether MuJoCo can draw with it.
        cause: What is missing.
        reason: Why it does not work, in one clause; empty where it does.
        vendor: GL_VENDOR; empty where it does not work or is not known.
        renderer: GL_RENDERER.
        version: GL_VERSION.
    """

    backend: Backend
    works: bool
    cause: Cause = ""
    reason: str = ""
    vendor: str = ""
    renderer: str = ""
    version: str = ""


_lock = threading.Lock()


def _renew_lock() -> None:
    """Give a forked process a lock that nobody holds."""
    global _lock  # noqa: PLW0603 - a lock cannot be reset
    _lock = threading.Lock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_renew_lock)


def try_backend(backend: Backend) -> Trial:
    """Whether MuJoCo can draw with a backend here; found out once for each setting of DISPLAY.

    A memory on the disk would save a third of a second, and be wrong after the installation of a
    driver; there is none.
    """
    settings = tuple(os.environ.get(name, "") for name in _SETTINGS)
    with _lock:
        return _remembered(backend, settings)


@functools.cache
def _remembered(backend: Backend, settings: tuple[str, ...]) -> Trial:
    display, wayland, _ = settings
    if backend == "glfw" and sys.platform == "linux" and not (display or wayland):
        return _fails(backend, "screen", "neither DISPLAY nor WAYLAND_DISPLAY is set")
    if sys.platform != "linux" and backend != "glfw":
        return _fails(backend, "library", "MuJoCo has it on Linux only")
    if not sys.executable or getattr(sys, "frozen", False):
        return _fails(backend, "driver", "there is no Python to try it with")
    return _run(backend)


forget = _remembered.cache_clear
"""Have every backend tried again, for instance after the installation of a driver."""


def _run(backend: Backend) -> Trial:
    # MuJoCo's import must not fail on the user's setting: the probe names its module itself.
    environment = {**os.environ, "MUJOCO_GL": "disable"}
    environment.pop(PLATFORM_VARIABLE, None)
    try:
        probe = subprocess.run(
            [sys.executable, "-P", "-W", "ignore", str(_PROBE), backend],
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            timeout=_PROBE_SECONDS,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return _fails(backend, "driver", f"it did not answer within {_PROBE_SECONDS:.0f} s")
    except OSError as error:
        return _fails(backend, "driver", f"it could not be tried: {error.strerror}")
    return _read(backend, probe.returncode, probe.stdout)


def _read(backend: Backend, code: int, output: bytes) -> Trial:
    if code < 0:
        return _fails(backend, "driver", f"its driver crashes ({_signal_name(-code)})")
    try:
        answer = dict(json.loads(output.splitlines()[-1]))
    except (IndexError, TypeError, ValueError):
        return _fails(backend, "driver", f"the trial ended without an answer (exit code {code})")
    return Trial(backend, works="reason" not in answer, **answer)


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def _fails(backend: Backend, cause: Cause, reason: str) -> Trial:
    return Trial(backend, works=False, cause=cause, reason=reason)
