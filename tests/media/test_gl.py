import os
import subprocess
import sys
import textwrap
from types import SimpleNamespace

import pytest

from mjcartpole.errors import RenderError
from mjcartpole.media import gl
from mjcartpole.media.backend_probe import Trial
from nightly import few


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


@pytest.fixture
def nothing_said():
    gl._explain_wish.cache_clear()


@pytest.mark.parametrize(
    ("wish", "line"),
    [
        (
            "osmesa",
            "MUJOCO_GL=osmesa does not work here: no library; pictures are drawn by egl",
        ),
        (
            "Vulkan",
            "MUJOCO_GL=vulkan names no OpenGL backend (there are egl, osmesa, glfw); "
            "pictures are drawn by egl",
        ),
        ("egl", None),
        ("", None),
        ("on", None),
        ("disable", None),
    ],
)
def test_a_wish_that_cannot_be_fulfilled_is_explained_once(
    on_linux, nothing_said, monkeypatch, caplog, wish, line
):
    def reply(backend):
        return "" if backend == "egl" else "no library"

    monkeypatch.setattr(gl, "why_not", reply)
    monkeypatch.setenv(gl.VARIABLE, wish)
    gl.find_backend()
    gl.find_backend()
    assert caplog.messages == ([line] if line else [])


def test_a_platform_that_is_already_imported_is_respected(monkeypatch):
    class OSMesaPlatform:
        pass

    loaded = SimpleNamespace(PLATFORM=OSMesaPlatform())
    monkeypatch.setitem(sys.modules, "OpenGL.platform", loaded)
    monkeypatch.setattr(gl, "works", lambda backend: True)
    monkeypatch.setattr(gl, "try_backend", lambda backend: Trial(backend, works=True))
    assert gl.can_use("osmesa")
    assert gl.why_not("egl") == "this process has imported PyOpenGL for osmesa"


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
        print([name for name in ("OpenGL", "imageio", "av") if name in sys.modules])
        """
    )
    assert done.stdout.strip() == "[]", done.stderr


FORGETFUL = """
    import os
    from mjcartpole.media import gl
    from mjcartpole.media.renderer import open_renderer
    from mjcartpole.physics.load import load_model

    before = dict(os.environ)
    cartpole = load_model()
    renderers = [open_renderer(cartpole, width=32, height=32) for _ in range(3)]
    for renderer in renderers:
        renderer.render((0.0, 0.0, 0.1, 0.0))
    renderers[1].close()
    assert dict(os.environ) == before, "the environment has changed"
    print(renderers[0].kind)
"""


@pytest.mark.slow
@pytest.mark.parametrize("wish", ["egl", "osmesa"])
def test_renderers_nobody_closes_end_in_silence(wish):
    if not gl.works(wish):
        pytest.skip(f"no OpenGL by {wish} here")
    # MuJoCo itself is imported without the wish; only the choice of a backend sees it.
    done = run(
        f"import mujoco, os\nos.environ['{gl.VARIABLE}'] = '{wish}'\n" + textwrap.dedent(FORGETFUL)
    )
    assert (done.returncode, done.stdout.strip(), done.stderr) == (0, wish, "")


@pytest.fixture(params=few(["egl", "osmesa"], "egl"))
def backend(request):
    if not gl.works(request.param):
        pytest.skip(f"no OpenGL by {request.param} here")
    return request.param


@pytest.mark.long
@pytest.mark.parametrize("other", few(["egl", "osmesa"], "egl"))
def test_a_wish_that_is_not_there_does_not_spoil_the_other(hide, other):
    """PyOpenGL has settled on what is not there when mujoco was first imported."""
    if not gl.works(other):
        pytest.skip(f"no OpenGL by {other} here")
    wish = "osmesa" if other == "egl" else "egl"
    done = run(FORGETFUL, **{gl.VARIABLE: wish}, **hide(wish))
    assert (done.returncode, done.stdout.strip()) == (0, other), done.stderr
    assert done.stderr.startswith(f"MUJOCO_GL={wish} does not work here: lib")
    assert done.stderr.count("\n") == 1


FORKING = """
    import multiprocessing, sys
    import numpy as np
    from mjcartpole.media.renderer import open_renderer
    from mjcartpole.physics.load import load_model

    def draw(kind):
        with open_renderer(load_model(), width=32, height=32) as renderer:
            renderer.render((0.0, 0.0, 0.1, 0.0))
            assert renderer.kind in kind, renderer.kind

    if __name__ == "__main__":
        method, before, kinds = sys.argv[1], sys.argv[2] == "before", sys.argv[3:]
        if before:
            renderer = open_renderer(load_model(), width=32, height=32)
            renderer.render((0.0, 0.0, 0.1, 0.0))
        processes = multiprocessing.get_context(method)
        child = processes.Process(target=draw, args=(kinds,))
        child.start()
        child.join(30)
        print(child.exitcode)
        child.kill()
"""


@pytest.mark.long
@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork here")
@pytest.mark.parametrize(
    ("method", "when", "expected"),
    [
        pytest.param("fork", "first", None, marks=pytest.mark.slow),
        ("fork", "before", "sketch"),  # the driver's threads are not in the copy
        pytest.param("spawn", "before", None, marks=pytest.mark.slow),
    ],
)
def test_other_processes_draw(backend, tmp_path, method, when, expected):
    program = tmp_path / "program.py"
    program.write_text(textwrap.dedent(FORKING))
    done = subprocess.run(
        [sys.executable, program, method, when, expected or backend],
        env={**os.environ, gl.VARIABLE: backend},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (done.returncode, done.stdout) == (0, "0\n"), done.stderr
    assert done.stderr.count("\n") == (1 if expected else 0), done.stderr
    assert expected is None or "was forked from one that had used OpenGL" in done.stderr


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork here")
def test_a_fork_without_a_wish_is_told_too(tmp_path):
    if gl.find_backend() is None:
        pytest.skip("no OpenGL here")
    program = tmp_path / "program.py"
    program.write_text(textwrap.dedent(FORKING))
    environment = {name: value for name, value in os.environ.items() if name != gl.VARIABLE}
    done = subprocess.run(
        [sys.executable, program, "fork", "before", "sketch"],
        env=environment,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (done.returncode, done.stdout) == (0, "0\n"), done.stderr
    assert done.stderr.startswith("this process was forked from one that had used OpenGL")


@pytest.mark.long
@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork here")
def test_a_renderer_from_before_a_fork_is_refused(backend):
    done = run(
        f"""
        import os
        from mjcartpole.errors import RenderError
        from mjcartpole.media import gl

        context = gl.make_context({backend!r}, 32, 32)
        child = os.fork()
        if child == 0:
            try:
                context.make_current()
            except RenderError as error:
                print(error, flush=True)
            context.release()
            context.free()
            os._exit(7)
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
        context.make_current()
        context.release()
        context.free()
        """
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("a renderer cannot be used in a process forked")
    assert done.stdout.endswith("\n7\n")


MANY = """
    import os, threading
    import gymnasium, mjcartpole

    def draw(count):
        for _ in range(count):
            env = gymnasium.make(
                "mjcartpole/CartPole-v1", render_mode="rgb_array", width=64, height=48
            )
            env.reset(seed=0)
            env.step(1)
            assert env.render().any()
            env.close()

    def held():
        with open("/proc/self/statm") as file:
            memory = int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
        return memory / 2**20, len(os.listdir("/proc/self/fd")), threading.active_count()

    count = int(os.environ["COUNT"])
    draw(5)
    before = held()
    draw(count)
    after = held()
    threads = [threading.Thread(target=draw, args=(count // 10,)) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    print(before, after, held())
    assert after[0] - before[0] < 20, "memory leaks"
    assert after[1:] == before[1:], "files or threads leak"
    assert held()[1:] == before[1:], "files or threads leak"
"""


BESIDE = """
    import mujoco
    from mjcartpole.media.renderer import open_renderer
    from mjcartpole.physics.load import load_model

    cartpole = load_model()
    data = mujoco.MjData(cartpole.model)
    mujoco.mj_forward(cartpole.model, data)
    theirs = mujoco.Renderer(cartpole.model, 48, 64)
    ours = open_renderer(cartpole, width=64, height=48)
    pictures = []
    for _ in range(3):
        theirs.update_scene(data, camera="side")
        pictures.append((theirs.render().tobytes(), ours.render((0.0, 0.0, 0.1, 0.0)).tobytes()))
    assert len(set(pictures)) == 1
    late = mujoco.Renderer(cartpole.model, 48, 64)
    CLOSE
    print(ours.kind)
"""


@pytest.mark.parametrize(
    "close",
    [
        "theirs.close(); ours.close(); late.close()",
        "ours.close(); theirs.close(); late.close()",
        "late.close(); theirs.close()",
    ],
    ids=["theirs first", "ours first", "ours at exit"],
)
@pytest.mark.slow
def test_mujocos_own_renderer_beside_ours(backend, close):
    done = run(BESIDE.replace("CLOSE", close), **{gl.VARIABLE: backend})
    assert (done.returncode, done.stdout.strip(), done.stderr) == (0, backend, "")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="counts in /proc")
@pytest.mark.parametrize(
    "count", [10, pytest.param(100, marks=pytest.mark.slow)], ids=["few", "many"]
)
@pytest.mark.parametrize("wish", few(["egl", "osmesa", "disable"], "egl"))
def test_many_environments_and_threads_leave_nothing(wish, count):
    if wish != "disable" and not gl.works(wish):
        pytest.skip(f"no OpenGL by {wish} here")
    done = run(MANY, **{gl.VARIABLE: wish}, COUNT=str(count))
    assert (done.returncode, done.stderr) == (0, ""), done.stderr


@pytest.mark.long
def test_with_opengl_switched_off_the_sketch_renderer_draws():
    done = run(FORGETFUL, **{gl.VARIABLE: "disable"})
    assert (done.returncode, done.stdout.strip(), done.stderr) == (0, "sketch", "")
