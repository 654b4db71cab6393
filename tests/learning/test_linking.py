"""MuJoCo's library, linked for compiled code."""

import subprocess
import sys
import sysconfig
from pathlib import Path

import mujoco
import numpy as np
import pytest

from mjcartpole.learning import linking
from mjcartpole.physics.library import libmujoco


def test_libmujoco_is_found_and_linked():
    library = libmujoco()
    assert library.is_file()
    assert library.parent == Path(mujoco.__file__).parent
    assert linking.link(library) == ""
    assert linking.link(library) == "", "a second time as well"


def test_no_library_is_a_reason():
    assert linking.link(None) == "libmujoco was not found in the mujoco package"


def test_what_is_no_library_is_a_reason(tmp_path):
    (tmp_path / "libmujoco.so.1").write_text("words")
    for path in (tmp_path / "libmujoco.so.1", tmp_path / "nothing.so"):
        assert linking.link(path).startswith("libmujoco cannot be linked: ")
        assert path.name in linking.link(path)


@pytest.mark.long
def test_a_library_without_mj_step_is_a_reason():
    """In a process where nothing else has brought mj_step along."""
    extensions = sysconfig.get_config_var("EXT_SUFFIX")
    library = next(Path(np.__file__).parent.rglob(f"*{extensions}"))
    script = "import sys, pathlib; from mjcartpole.learning import linking; print(linking.link("
    done = subprocess.run(
        [sys.executable, "-c", f"{script}pathlib.Path(sys.argv[1])))", str(library)],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == f"'{library}' has no mj_step\n"
