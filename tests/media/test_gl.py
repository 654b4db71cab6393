import os
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from types import SimpleNamespace

import pytest

from mjcartpole.errors import RenderError
from mjcartpole.media import gl


@pytest.fixture(autouse=True)
def forgets() -> Iterator[None]:
    gl.works.cache_clear()
    yield
    gl.works.cache_clear()


def run(code: str, **environment: str) -> "subprocess.CompletedProcess[str]":
    inherited = {name: value for name, value in os.environ.items() if name != gl.VARIABLE}
    return subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)],
        env={**inherited, **environment},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.fixture
def on_linux(monkeypatch):
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv(gl.VARIABLE, raising=False)


@pytest.mark.parametrize(
    ("wish", "order"),
    [
        ("", ("egl", "osmesa")),
        ("egl", ("egl", "osmesa")),
        ("OSMesa ", ("osmesa", "egl")),
        ("glfw", ("glfw", "egl", "osmesa")),
        ("glx", ("glfw", "egl", "osmesa")),
        ("nonsense", ("egl", "osmesa")),
        ("disable", ()),
        ("off", ()),
        ("0", ()),
    ],
)
def test_the_users_wish_is_tried_first_on_linux(on_linux, monkeypatch, wish, order):
    monkeypatch.setenv(gl.VARIABLE, wish)
    assert gl.candidates() == order


@pytest.mark.parametrize("system", ["darwin", "win32"])
@pytest.mark.parametrize("wish", ["", "egl", "cgl", "wgl"])
def test_other_systems_use_their_window_system(monkeypatch, system, wish):
    monkeypatch.setattr(sys, "platform", system)
    monkeypatch.setenv(gl.VARIABLE, wish)
    assert gl.candidates() == ("glfw",)


def test_the_first_that_works_is_found(on_linux, monkeypatch):
    monkeypatch.setattr(gl, "can_use", lambda backend: backend == "osmesa")
    assert gl.find_backend() == "osmesa"


def test_none_is_found_where_none_works(on_linux, monkeypatch):
    monkeypatch.setattr(gl, "can_use", lambda backend: False)
    assert gl.find_backend() is None


def test_without_a_library_no_process_is_started(monkeypatch):
    monkeypatch.setattr(gl, "_LIBRARIES", {"egl": ("no-such-library", "libno-such.so.9")})
    monkeypatch.setattr(subprocess, "run", lambda *args, **kwargs: pytest.fail("started"))
    assert not gl.works("egl")


@pytest.mark.parametrize(
    "probe",
    ["import os; os.abort()", "raise SystemExit(1)", "import time; time.sleep(60)"],
    ids=["crashes", "fails", "hangs"],
)
def test_a_backend_whose_probe_goes_wrong_does_not_work(monkeypatch, probe):
    monkeypatch.setattr(gl, "_has_library", lambda backend: True)
    monkeypatch.setattr(gl, "_PROBE_SECONDS", 1.0)
    monkeypatch.setattr(gl, "_PROBE", probe)
    assert not gl.works("egl")


def test_a_backend_is_probed_once(monkeypatch):
    started = []
    monkeypatch.setattr(gl, "_has_library", lambda backend: True)
    monkeypatch.setattr(
        subprocess, "run", lambda *args, **_: started.append(args) or SimpleNamespace(returncode=0)
    )
    assert gl.works("egl")
    assert gl.works("egl")
    assert len(started) == 1


def test_a_platform_that_is_already_imported_is_respected(monkeypatch):
    class OSMesaPlatform:
        pass

    loaded = SimpleNamespace(PLATFORM=OSMesaPlatform())
    monkeypatch.setitem(sys.modules, "OpenGL.platform", loaded)
    monkeypatch.setattr(gl, "works", lambda backend: True)
    assert gl.can_use("osmesa")
    assert not gl.can_use("egl")


def test_an_unknown_backend_is_refused():
    with pytest.raises(RenderError, match="'vulkan' is unknown; available: egl, osmesa, glfw"):
        gl.make_context("vulkan", 16, 16)  # type: ignore[arg-type]


def test_a_context_that_cannot_be_made_is_a_render_error(monkeypatch):
    def fail(backend):
        raise AttributeError("'NoneType' object has no attribute 'eglQueryString'")

    monkeypatch.setattr(gl, "_import_backend", fail)
    with pytest.raises(RenderError, match="OpenGL by egl gives no context: 'NoneType'"):
        gl.make_context("egl", 16, 16)


def test_importing_media_brings_neither_opengl_nor_imageio():
    done = run(
        """
        import sys
        import mjcartpole.media.gl, mjcartpole.media.renderer, mjcartpole.media.sketch
        import mjcartpole.media.video
        print([name for name in ("OpenGL", "imageio", "imageio_ffmpeg") if name in sys.modules])
        """
    )
    assert done.stdout.strip() == "[]", done.stderr


FORGETFUL = """
    import os
    from mjcartpole.media import gl
    from mjcartpole.media.renderer import open_renderer
    from mjcartpole.physics.model import load_model

    before = dict(os.environ)
    cartpole = load_model()
    renderers = [open_renderer(cartpole, width=32, height=32) for _ in range(3)]
    for renderer in renderers:
        renderer.render((0.0, 0.0, 0.1, 0.0))
    renderers[1].close()
    assert dict(os.environ) == before, "the environment has changed"
    print(renderers[0].kind)
"""


@pytest.mark.parametrize("wish", ["egl", "osmesa"])
def test_renderers_nobody_closes_end_in_silence(wish):
    if not gl.works(wish):
        pytest.skip(f"no OpenGL by {wish} here")
    # MuJoCo itself is imported without the wish; only the choice of a backend sees it.
    done = run(
        f"import mujoco, os\nos.environ['{gl.VARIABLE}'] = '{wish}'\n" + textwrap.dedent(FORGETFUL)
    )
    assert (done.returncode, done.stdout.strip(), done.stderr) == (0, wish, "")


def test_with_opengl_switched_off_the_sketch_renderer_draws():
    done = run(FORGETFUL, **{gl.VARIABLE: "disable"})
    assert (done.returncode, done.stdout.strip(), done.stderr) == (0, "sketch", "")
