"""From an MJCF file to one control step.

MuJoCo looks for OpenGL when it is imported, and where `MUJOCO_GL` names a backend that is not
there, the import itself fails. Physics needs no OpenGL: in that case mujoco is imported without.
"""

import os
import sys

_VARIABLE, _PLATFORM = "MUJOCO_GL", "PYOPENGL_PLATFORM"


def _import_mujoco() -> None:
    if "mujoco" in sys.modules:
        return
    platform = os.environ.get(_PLATFORM)
    try:
        import mujoco  # noqa: PLC0415
    except Exception:  # What is raised depends on which of OpenGL's libraries is missing.
        wanted = os.environ.get(_VARIABLE)
        if wanted is None:
            raise
        # The failed import leaves a platform behind that is not there.
        if platform is None:
            os.environ.pop(_PLATFORM, None)
        os.environ[_VARIABLE] = "disable"
        try:
            import mujoco  # noqa: F401, PLC0415
        finally:
            os.environ[_VARIABLE] = wanted


_import_mujoco()
