"""Backends tried in a process of their own, also with drivers that misbehave."""

import os
import subprocess
import sys

import pytest

from mjcartpole.media import backend_probe, probe_process
from mjcartpole.media.backend_probe import try_backend

LINUX = pytest.mark.skipif(sys.platform != "linux", reason="EGL and OSMesa are Linux's")


@pytest.fixture(autouse=True)
def forgets():
    backend_probe.forget()
    yield
    backend_probe.forget()


@LINUX
@pytest.mark.parametrize("backend", ["egl", "osmesa"])
def test_one_that_works_says_who_draws(backend):
    found = try_backend(backend)
    if not found.works:
        pytest.skip(f"no OpenGL by {backend} here: {found.reason}")
    assert (found.cause, found.reason) == ("", "")
    assert all((found.vendor, found.renderer, found.version))


@LINUX
@pytest.mark.parametrize(
    ("backend", "hidden", "library"),
    [
        ("egl", "egl", "libEGL.so.1"),
        ("egl", "opengl", "libOpenGL.so.0"),
        ("osmesa", "osmesa", "libOSMesa.so.8"),
    ],
)
def test_a_library_that_cannot_be_loaded_is_named(hide, monkeypatch, backend, hidden, library):
    for name, value in hide(hidden).items():
        monkeypatch.setenv(name, value)
    found = try_backend(backend)
    assert (found.works, found.cause) == (False, "library")
    assert library in found.reason


@LINUX
def test_a_library_that_is_not_there_is_named():
    assert probe_process._load("libno-such.so.9") == "libno-such.so.9 is not installed"


@LINUX
def test_a_display_that_is_not_there(monkeypatch):
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.delenv("DISPLAY", raising=False)
    found = try_backend("glfw")
    assert (found.works, found.cause) == (False, "screen")
    assert found.reason == "neither DISPLAY nor WAYLAND_DISPLAY is set"
    # Remembered for each DISPLAY: a screen may come later.
    monkeypatch.setenv("DISPLAY", ":4711")
    found = try_backend("glfw")
    assert (found.works, found.cause) == (False, "screen")
    assert found.reason.startswith("GLFW says 'X11: Failed to")


@LINUX
@pytest.mark.slow
def test_an_egl_device_that_is_not_there(monkeypatch):
    if not try_backend("egl").works:
        pytest.skip("no OpenGL by egl here")
    monkeypatch.setenv("MUJOCO_EGL_DEVICE_ID", "4711")
    found = try_backend("egl")
    assert not found.works
    assert "MUJOCO_EGL_DEVICE_ID" in found.reason


@LINUX
@pytest.mark.slow
def test_pyopengls_own_variable_does_not_matter(monkeypatch):
    before = try_backend("egl").works
    backend_probe.forget()
    monkeypatch.setenv(backend_probe.PLATFORM_VARIABLE, "glx")
    assert try_backend("egl").works == before


@pytest.mark.parametrize(
    ("program", "reason"),
    [
        pytest.param(
            "import os; os.abort()",
            "its driver crashes (SIGABRT)",
            marks=pytest.mark.skipif(os.name == "nt", reason="has no signals"),
        ),
        ("raise SystemExit(1)", "the trial ended without an answer (exit code 1)"),
        ("print('no JSON')", "the trial ended without an answer (exit code 0)"),
        ("import time; time.sleep(60)", "it did not answer within 1 s"),
    ],
    ids=["crashes", "fails", "babbles", "hangs"],
)
def test_a_trial_that_goes_wrong_is_a_no(monkeypatch, tmp_path, program, reason):
    script = tmp_path / "probe.py"
    script.write_text(program)
    monkeypatch.setattr(backend_probe, "_PROBE", script)
    monkeypatch.setattr(backend_probe, "_PROBE_SECONDS", 1.0)
    found = backend_probe._run("egl")
    assert (found.works, found.reason) == (False, reason)


def test_words_of_the_driver_are_not_the_answer(monkeypatch, tmp_path):
    script = tmp_path / "probe.py"
    script.write_text("print('libEGL: hello'); print('{\"vendor\": \"me\"}')")
    monkeypatch.setattr(backend_probe, "_PROBE", script)
    assert backend_probe._run("egl") == backend_probe.Trial("egl", works=True, vendor="me")


def test_it_is_tried_once(monkeypatch, tmp_path):
    script, log = tmp_path / "probe.py", tmp_path / "log"
    script.write_text(f"open({str(log)!r}, 'a').write('x'); print('{{}}')")
    monkeypatch.setattr(backend_probe, "_PROBE", script)
    monkeypatch.setenv("DISPLAY", ":0")
    assert try_backend("glfw").works
    assert try_backend("glfw").works
    assert log.read_text() == "x"


def test_a_frozen_program_is_not_started_anew(monkeypatch):
    """There `sys.executable` is the program itself, which would start again and again."""
    monkeypatch.setattr(sys, "frozen", True, raising=False)
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: pytest.fail("started"))
    monkeypatch.setenv("DISPLAY", ":0")
    assert try_backend("glfw").reason == "there is no Python to try it with"
