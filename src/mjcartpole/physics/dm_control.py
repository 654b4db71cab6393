"""dm_control, fitted to the MuJoCo that is here; nothing else imports it.

It lists MuJoCo's arrays by name, of one version of MuJoCo, and takes for granted that all of them
exist; MuJoCo 4 has nine fewer. What does not exist is struck off the list.
"""

import sys
import warnings
from typing import Any, Final

from mujoco import MjData, MjModel

from mjcartpole.versions import version_of

NO_WHEEL: Final = (3, 13)
"""The first Python for which labmaze, which dm_control needs, has none."""


def strike_off(array_sizes: dict[str, dict[str, Any]]) -> None:
    """Take arrays that the installed MuJoCo does not have off dm_control's list of them."""
    for struct, kind in (("mjmodel", MjModel), ("mjdata", MjData)):
        arrays = array_sizes[struct]
        for name in [name for name in arrays if not hasattr(kind, name)]:
            del arrays[name]


def why_not(error: Exception) -> str:
    """Return why there is no dm_control, and what would bring it, in one line."""
    found = version_of("dm-control")
    if found:
        pair = f"dm-control {found} with mujoco {version_of('mujoco')}"
        return f"{pair} does not load: {type(error).__name__}: {' '.join(str(error).split())}"
    if sys.version_info < NO_WHEEL:
        return "dm_control is not installed; try: pip install dm-control"
    return (
        "dm_control is not installed: labmaze, which it needs, has no wheel for Python 3.13 and "
        "newer; Python 3.11 and 3.12 have it"
    )


try:
    with warnings.catch_warnings():
        # It looks for a window system on import, and warns where there is none.
        warnings.simplefilter("ignore")
        from dm_control import mujoco
        from dm_control.mujoco import wrapper
        from dm_control.mujoco.wrapper.mjbindings import sizes
        from dm_control.rl import control
        from dm_env import specs  # type: ignore[import-untyped]

    strike_off(sizes.array_sizes)
    # What else another version lacks would show at the first model.
    mujoco.Physics.from_xml_string("<mujoco/>")
except Exception as error:
    raise ImportError(why_not(error)) from error

__all__ = ["control", "mujoco", "specs", "strike_off", "why_not", "wrapper"]
