"""Machines without some library, made out of one that has it."""

import sys

import pytest

LIBRARIES = {
    "egl": ("libEGL.so.1",),
    "osmesa": ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"),
    "opengl": ("libOpenGL.so.0", "libGL.so.1"),
    "x11": ("libX11.so.6",),
}


@pytest.fixture
def hide(tmp_path):
    """Variables for a process that cannot load some libraries: it finds rubbish in their place."""
    if sys.platform != "linux":
        pytest.skip("hides libraries from Linux's loader")

    def environment(*names):
        folder = tmp_path / "hidden"
        folder.mkdir(exist_ok=True)
        for library in (library for name in names for library in LIBRARIES[name]):
            (folder / library).write_text("hidden")
        return {"LD_LIBRARY_PATH": str(folder)}

    return environment
