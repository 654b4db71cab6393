"""Where MuJoCo's own library lies, for compiled code that calls it."""

from pathlib import Path

import mujoco


def libmujoco() -> Path | None:
    """The library that the mujoco package brings along, if it is where it is expected."""
    folder = Path(mujoco.__file__).parent
    for pattern in ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll"):
        for path in sorted(folder.glob(pattern)):
            return path
    return None
