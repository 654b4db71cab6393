"""From an MJCF file to one control step.

MuJoCo looks for OpenGL when it is imported, and where `MUJOCO_GL` names a backend that is not
there, the import itself fails. Physics needs no OpenGL: in that case mujoco is imported without.
"""

import os
import sys

_VARIABLE = "MUJOCO_GL"


def _import_mujoco() -> None:
    if "mujoco" in sys.modules:
        return
    try:
        import mujoco  # noqa: PLC0415
    except (AttributeError, ImportError, RuntimeError, OSError):
        wanted = os.environ.get(_VARIABLE)
        if wanted is None:
            raise
        os.environ[_VARIABLE] = "disable"
        try:
            import mujoco  # noqa: F401, PLC0415
        finally:
            os.environ[_VARIABLE] = wanted


_import_mujoco()
