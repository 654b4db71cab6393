"""The script that compiles and steps a document says what comes of it in its first word."""

import subprocess
import sys

import mujoco
import pytest

from mjcartpole.physics import trial
from mjcartpole.physics.library import libmujoco
from mjcartpole.physics.load import models_folder

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits of Linux processes")

REFERENCE = (models_folder() / "cartpole.xml").read_text(encoding="utf-8")
LOOP = '<mujoco><worldbody><replicate count="2000000000"><site/></replicate></worldbody></mujoco>'


def run(text, seconds=4, megabytes=768):
    limits = str(megabytes * 2**20), str(seconds)
    return subprocess.run(
        [sys.executable, "-I", "-S", trial.__file__, libmujoco(), mujoco.PLUGINS_DIR, *limits],
        input=text.encode(),
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        check=False,
        timeout=60,
    )


@pytest.mark.parametrize(
    ("text", "answer"),
    [
        (REFERENCE, b""),
        ("<mujoco><nothing/></mujoco>", b"INVALID XML Error: Schema violation"),
        ("<mujoco><worldbody><geom/></worldbody></mujoco>", b"INVALID Error: size 0 must be"),
        ('<mujoco><size memory="1T"/></mujoco>', b"INVALID Error: engine error: Could not alloc"),
    ],
)
def test_a_document_that_ends_by_itself_is_answered(text, answer):
    done = run(text)
    assert done.returncode == 0
    assert done.stdout.startswith(answer)
    assert bool(done.stdout) == bool(answer)


@pytest.mark.long
def test_the_system_ends_what_takes_too_long():
    done = run(LOOP, seconds=1)
    assert done.returncode < 0
    assert done.stdout == b""
