"""The doctor: what there is for pictures and videos here, what not, and what to install."""

import os
import platform
import sys
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from typing import Any, Final, get_args

from mjcartpole.cores import available_cores
from mjcartpole.media import gl
from mjcartpole.media.backend_probe import Backend, Trial, try_backend
from mjcartpole.media.mp4 import CODEC, why_no_mp4
from mjcartpole.versions import version_of

PACKAGES: Final = (
    "mjcartpole",
    "mujoco",
    "dm-control",
    "gymnasium",
    "numpy",
    "numba",
    "pillow",
    "imageio",
    "av",
)
"""Whose versions are of interest."""

VARIABLES: Final = (
    gl.VARIABLE,
    "DISPLAY",
    "WAYLAND_DISPLAY",
    "PYOPENGL_PLATFORM",
    "MUJOCO_EGL_DEVICE_ID",
)
"""Environment variables that decide who draws."""

# What brings each backend on each family of Linux; Debian's were tried on a bare Debian 12.
_INSTALL: Final = {
    "debian": (
        "apt-get install",
        {"egl": "libegl1 libgl1", "osmesa": "libosmesa6", "glfw": "libgl1"},
    ),
    "fedora": (
        "dnf install",
        {
            "egl": "mesa-libEGL mesa-libGL mesa-dri-drivers",
            "glfw": "mesa-libGL mesa-dri-drivers",
        },
    ),
    "arch": ("pacman -S", {"egl": "mesa", "glfw": "mesa"}),
}
_SCREENLESS: Final = "needs a screen; for a virtual one: {}, then xvfb-run -a <command>"
_XVFB: Final = {
    "debian": "apt-get install xvfb xauth",
    "fedora": "dnf install xorg-x11-server-Xvfb xorg-x11-xauth",
    "arch": "pacman -S xorg-server-xvfb xorg-xauth",
}


@dataclass(frozen=True)
class BackendReport:
    """What became of one way to draw.

    Attributes:
        name: `"egl"`, `"osmesa"`, `"glfw"` or `"sketch"`.
        works: Whether it can draw here.
        chosen: Whether it is what will draw.
        driver: The driver's name and version; empty where it does not work.
        reason: Why it does not work, or why it is not chosen, in one clause.
        install: What to install for it; empty where nothing is missing, or no package is known.
    """

    name: str
    works: bool
    chosen: bool
    driver: str
    reason: str
    install: str


@dataclass(frozen=True)
class Report:
    """What `examine` found.

    Attributes:
        system: The operating system, the machine and Python.
        versions: Of the packages; None for one that is not installed.
        environment: The variables that are set; what is wrong with a value stands behind it.
        no_mp4: Why a gif is written instead of an mp4; empty if an mp4 is.
        backends: Every way to draw, in the order of `get_args(Backend)`, the sketch last.
        renderer: The name of the one that will draw.
        window: Why `render_mode="human"` has no window; empty if it has one.
    """

    system: dict[str, str]
    versions: dict[str, str | None]
    environment: dict[str, str]
    no_mp4: str
    backends: tuple[BackendReport, ...]
    renderer: str
    window: str

    def as_dict(self) -> dict[str, Any]:
        """The same as plain data, for JSON."""
        return asdict(self)

    def text(self) -> str:
        """The same for a person to read."""
        return "\n".join(_lines(self))


def examine() -> Report:
    """Look at everything that decides who draws and who encodes; says and changes nothing."""
    trials = {backend: try_backend(backend) for backend in get_args(Backend)}
    order = gl.candidates()
    chosen = next((backend for backend in order if gl.can_use(backend)), None)
    reports = [_report(trials[backend], chosen, order) for backend in get_args(Backend)]
    return Report(
        system=_system(),
        versions={name: version_of(name) for name in PACKAGES},
        environment={name: _variable(name) for name in VARIABLES if name in os.environ},
        no_mp4=why_no_mp4(),
        backends=(*reports, _report_sketch(chosen)),
        renderer=chosen or "sketch",
        window=trials["glfw"].reason,
    )


def _report(trial: Trial, chosen: Backend | None, order: tuple[Backend, ...]) -> BackendReport:
    backend = trial.backend
    reason = trial.reason
    if trial.works and backend != chosen:
        reason = _why_not_chosen(backend, chosen, order)
    driver = ", ".join(filter(None, (trial.renderer, trial.vendor, trial.version)))
    return BackendReport(
        backend, trial.works, backend == chosen, driver, reason, "" if trial.works else _cure(trial)
    )


def _why_not_chosen(backend: Backend, chosen: Backend | None, order: tuple[Backend, ...]) -> str:
    if not order:
        return f"{gl.VARIABLE}={os.environ[gl.VARIABLE]} switches OpenGL off"
    if backend not in order:
        return 'only for windows (render_mode="human"), unless MUJOCO_GL=glfw'
    return gl.why_not(backend) or f"{chosen} comes first"


def _report_sketch(chosen: Backend | None) -> BackendReport:
    reason = f"{chosen} works" if chosen else ""
    return BackendReport("sketch", True, chosen is None, "needs no OpenGL", reason, "")


def _cure(trial: Trial) -> str:
    """What to install, or to do, for a backend that does not work."""
    family = _linux_family()
    if trial.cause == "screen" and "Xlib" not in trial.reason and "GLX" not in trial.reason:
        return _SCREENLESS.format(_XVFB.get(family, "Xvfb")) if sys.platform == "linux" else ""
    if trial.cause in ("library", "screen", "driver") and family in _INSTALL:
        command, packages = _INSTALL[family]
        names = packages.get(trial.backend)
        if family == "debian" and trial.backend == "egl" and trial.cause == "driver":
            names = "libgl1-mesa-dri"
        return f"{command} {names}" if names else ""
    return ""


def _linux_family() -> str:
    """`debian`, `fedora` or `arch`, also for what derives from them; else empty."""
    try:
        release = platform.freedesktop_os_release()
    except OSError:
        return ""
    names = [release.get("ID", ""), *release.get("ID_LIKE", "").split()]
    names = ["fedora" if name in ("rhel", "centos") else name for name in names]
    return next((name for name in names if name in _INSTALL), "")


def _system() -> dict[str, str]:
    try:
        name = platform.freedesktop_os_release().get("PRETTY_NAME", platform.system())
    except OSError:
        name = platform.platform(terse=True)
    return {
        "platform": f"{name}, {platform.machine()}, {available_cores()} cores",
        "python": f"{platform.python_version()} ({sys.executable})",
    }


def _variable(name: str) -> str:
    """A variable's value, and what is wrong with it."""
    wrong = ""
    if name == gl.VARIABLE:
        wrong = gl.why_not_as_wished()
    elif name == "DISPLAY" and os.environ[name] and not gl.works("glfw"):
        wrong = "no window opens there"
    value = os.environ[name] or "empty"
    return f"{value} ({wrong})" if wrong else value


def _lines(report: Report) -> Iterator[str]:
    yield from _table(report.system.items())
    yield from _table((name, found or "not installed") for name, found in report.versions.items())
    yield ""
    yield "environment"
    yield from _table((name, report.environment.get(name, "not set")) for name in VARIABLES)
    yield ""
    yield "drawing"
    yield from _table((one.name, _state(one)) for one in report.backends)
    yield f"  → frames are drawn by {report.renderer}; {_window(report)}"
    yield ""
    yield "encoding"
    yield f"  → {_encoding(report)}"


def _table(rows: Iterable[tuple[str, str]]) -> Iterator[str]:
    for name, text in rows:
        yield f"  {name:21s} {text}"


def _state(one: BackendReport) -> str:
    if not one.works:
        return f"does not work: {one.reason}" + (f"; {one.install}" if one.install else "")
    return f"works ({one.driver})" + (f", not used: {one.reason}" if one.reason else "")


def _window(report: Report) -> str:
    return 'render_mode="human" ' + (
        f"has no window: {report.window}" if report.window else "opens a window"
    )


def _encoding(report: Report) -> str:
    if report.no_mp4:
        return f"a gif is written instead of an mp4: {report.no_mp4}; python -m pip install av"
    return f"mp4 by PyAV's {CODEC}; gif, webp and png by Pillow"
