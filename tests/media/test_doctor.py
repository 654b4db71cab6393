"""The doctor's findings on machines that lack one thing or another."""

import json
import os
import subprocess
import sys

import pytest

from mjcartpole.media import doctor, gl, mp4

LINUX = pytest.mark.skipif(sys.platform != "linux", reason="hides Linux's libraries")
CODE = """
import json, sys
from mjcartpole.media.doctor import examine
report = examine()
said = report.text()
opengl = sorted({"OpenGL", "mujoco.egl", "mujoco.osmesa"} & set(sys.modules))
print(json.dumps({**report.as_dict(), "text": said, "opengl": opengl}))
"""


def examine_with(**environment):
    """The report of a process with these variables, and none of those that matter otherwise."""
    inherited = {name: value for name, value in os.environ.items() if name not in doctor.VARIABLES}
    done = subprocess.run(
        [sys.executable, "-c", CODE],
        env={**inherited, **environment},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    return json.loads(done.stdout)


def states(report):
    return {one["name"]: one["works"] for one in report["backends"]}


def one_of(report, name):
    return next(one for one in report["backends"] if one["name"] == name)


def needs(*backends):
    for backend in backends:
        if not gl.works(backend):
            pytest.skip(f"no OpenGL by {backend} here")


def test_it_names_versions_and_the_driver():
    report = doctor.examine()
    assert report.versions["mujoco"]
    assert report.versions.keys() == set(doctor.PACKAGES)
    text = report.text()
    for one in report.backends:
        assert one.chosen == (one.name == report.renderer)
        assert bool(one.driver) == one.works
        assert one.name in text
    assert f"frames are drawn by {report.renderer}" in text
    assert report.no_mp4 == ""
    assert "mp4 by PyAV's libx264" in text
    json.dumps(report.as_dict())


@pytest.mark.long
@LINUX
@pytest.mark.parametrize(
    ("there", "hidden"),
    [("egl", "osmesa"), pytest.param("osmesa", "egl", marks=pytest.mark.slow)],
    ids=["EGL only", "OSMesa only"],
)
def test_only_one_backend(hide, there, hidden):
    needs(there)
    report = examine_with(**hide(hidden))
    assert states(report) == {there: True, hidden: False, "glfw": False, "sketch": True}
    assert report["renderer"] == there
    assert "lib" in one_of(report, hidden)["reason"]
    assert report["opengl"] == [], "the doctor's own process touches OpenGL"


@pytest.mark.long
@LINUX
def test_no_opengl_at_all(hide):
    report = examine_with(**hide("egl", "osmesa", "opengl", "x11"))
    assert states(report) == {"egl": False, "osmesa": False, "glfw": False, "sketch": True}
    assert report["renderer"] == "sketch"


@LINUX
@pytest.mark.parametrize(
    ("wish", "said"),
    [
        ("osmesa", "osmesa (does not work here: libOSMesa.so.8"),
        ("garbage", "garbage (names no OpenGL backend"),
        ("glfw", "glfw (does not work here: neither DISPLAY"),
    ],
)
@pytest.mark.slow
def test_a_misleading_wish(hide, wish, said):
    needs("egl")
    report = examine_with(MUJOCO_GL=wish, **hide("osmesa"))
    assert report["renderer"] == "egl"
    assert report["environment"]["MUJOCO_GL"].startswith(said)
    assert states(report) == {"egl": True, "osmesa": False, "glfw": False, "sketch": True}


@pytest.mark.slow
def test_opengl_switched_off():
    report = examine_with(MUJOCO_GL="disable")
    assert report["renderer"] == "sketch"
    assert report["environment"]["MUJOCO_GL"] == "disable"
    for one in report["backends"]:
        if one["works"] and one["name"] != "sketch":
            assert one["reason"] == "MUJOCO_GL=disable switches OpenGL off"


@LINUX
@pytest.mark.slow
def test_a_display_that_does_not_answer():
    report = examine_with(DISPLAY=":4711")
    assert not states(report)["glfw"]
    assert "GLFW says 'X11: Failed to" in report["window"]
    assert report["environment"]["DISPLAY"] == ":4711 (no window opens there)"


@pytest.mark.parametrize(
    ("release", "egl", "osmesa"),
    [
        ({"ID": "debian"}, "apt-get install libegl1 libgl1", "apt-get install libosmesa6"),
        (
            {"ID": "pop", "ID_LIKE": "ubuntu debian"},
            "apt-get install libegl1 libgl1",
            "apt-get install libosmesa6",
        ),
        (
            {"ID": "rocky", "ID_LIKE": "rhel centos fedora"},
            "dnf install mesa-libEGL mesa-libGL mesa-dri-drivers",
            "",
        ),
        ({"ID": "manjaro", "ID_LIKE": "arch"}, "pacman -S mesa", ""),
        ({"ID": "unheard-of"}, "", ""),
    ],
    ids=lambda value: value["ID"] if isinstance(value, dict) else "",
)
def test_what_to_install_depends_on_the_system(monkeypatch, release, egl, osmesa):
    monkeypatch.setattr("platform.freedesktop_os_release", lambda: release)
    found = [
        doctor._cure(doctor.Trial(backend, works=False, cause="library", reason="not installed"))
        for backend in ("egl", "osmesa")
    ]
    assert found == [egl, osmesa]


def test_without_an_encoder_it_says_so(monkeypatch):
    monkeypatch.setattr(mp4, "CODEC", "libx999")
    mp4.why_no_mp4.cache_clear()
    report = doctor.examine()
    mp4.why_no_mp4.cache_clear()
    assert "was built without libx999" in report.no_mp4
    assert f"a gif is written instead of an mp4: {report.no_mp4}" in report.text()
