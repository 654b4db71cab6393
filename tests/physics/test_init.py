"""Physics needs no OpenGL, whatever the environment asks for, and a training no video library."""

import os
import subprocess
import sys

import pytest

CODE = """
import os, sys, mjcartpole
result = mjcartpole.train(mjcartpole.TrainConfig(episodes=2))
import mjcartpole.commands.policies
print(result.steps > 0, os.environ["MUJOCO_GL"])
print({"OpenGL", "imageio", "dm_control"} & set(sys.modules))
"""


@pytest.mark.long
@pytest.mark.parametrize(
    "choice",
    [
        "nonsense",
        *(
            pytest.param(choice, marks=pytest.mark.slow)
            for choice in ("egl", "disable", "osmesa", "glfw")
        ),
    ],
)
def test_training_works_with_any_mujoco_gl_and_uses_none(choice):
    done = subprocess.run(
        [sys.executable, "-c", CODE],
        env={**os.environ, "MUJOCO_GL": choice},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stderr == ""
    # MuJoCo itself imports what somebody wishes.
    loaded = str({"OpenGL"} if choice in {"egl", "osmesa"} else set())
    assert done.stdout.split() == ["True", choice, loaded]
