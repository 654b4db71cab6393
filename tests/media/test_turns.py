"""Drawing from several threads: in processes of their own, for what goes wrong is a crash."""

import os
import subprocess
import sys
import textwrap

import pytest

from mjcartpole.media import gl
from nightly import few

KINDS = ["egl", "osmesa", "off"]

TOGETHER = """
    import sys, threading
    import gymnasium
    import mjcartpole

    def draw(env):
        for _ in range(10):
            seen.append(env.render().tobytes())

    def draw_own():
        env = gymnasium.make("mjcartpole/CartPole-v1", render_mode="rgb_array")
        env.reset(seed=0)
        draw(env)
        if sys.argv[1] == "closed":
            env.close()

    def together(*works):
        threads = [threading.Thread(target=work) for work in works]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()

    seen = []
    threading.excepthook = lambda problem: seen.append(repr(problem.exc_value))
    env = gymnasium.make("mjcartpole/CartPole-v1", render_mode="rgb_array")
    env.reset(seed=0)
    together(*[lambda: draw(env)] * 8)
    for _ in range(4):
        together(lambda: draw(env))
    env.close()
    together(*[draw_own] * 8)
    assert len(seen) == 200, seen
    assert len(set(seen)) == 1
"""

AT_EXIT = """
    import sys, threading, time
    import gymnasium
    import mjcartpole

    def make():
        env = gymnasium.make("mjcartpole/CartPole-v1", render_mode="rgb_array")
        env.reset(seed=0)
        return env

    def draw(env):
        while True:
            if sys.argv[1] == "new":
                env = make()
            env.unwrapped.step(0)
            env.render()
            drawn.append(threading.get_ident())
            if sys.argv[1] == "new":
                env.close()

    drawn = []
    envs = [make() for _ in range(4)]
    for env in envs:
        threading.Thread(target=draw, args=(envs[0] if sys.argv[1] == "one" else env,),
                         daemon=True).start()
    while len(set(drawn)) < 4:
        time.sleep(0.01)
    envs[0].reset()
    sys.exit(3)
"""


def run(code, kind, argument):
    if kind != "off" and not gl.works(kind):
        pytest.skip(f"no OpenGL by {kind} here")
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", textwrap.dedent(code), argument],
        env={**os.environ, gl.VARIABLE: kind},
        capture_output=True,
        timeout=120,
        text=True,
        check=False,
    )
    return done.returncode, done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("end", ["closed", "left"])
@pytest.mark.parametrize("kind", KINDS)
def test_threads_draw_with_one_environment_and_with_their_own(kind, end):
    assert run(TOGETHER, kind, end) == (0, "")


@pytest.mark.long
@pytest.mark.parametrize(
    "envs", [*(pytest.param(envs, marks=pytest.mark.slow) for envs in ("one", "own")), "new"]
)
@pytest.mark.parametrize("kind", few(KINDS, "egl"))
def test_daemon_threads_that_draw_at_exit_go_in_silence(kind, envs):
    assert run(AT_EXIT, kind, envs) == (3, "")
