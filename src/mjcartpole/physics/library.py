"""MuJoCo's C library: where it lies, how it complains, and how many digits it writes."""

import contextlib
import ctypes
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import mujoco

from mjcartpole.errors import ModelSyntaxError


def libmujoco() -> Path | None:
    """Return the library that the mujoco package brings along, if it is where it is expected."""
    folder = Path(mujoco.__file__).parent
    for pattern in ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll"):
        for path in sorted(folder.glob(pattern)):
            return path
    return None


def one_line(message: object) -> str:
    """Return what MuJoCo says in one line."""
    return " ".join(str(message).split()).removeprefix("XML Error: ").removeprefix("Error: ")


def invalid(name: str, reason: object) -> ModelSyntaxError:
    """Return the error for a document, called by a name, that MuJoCo does not accept."""
    return ModelSyntaxError(f"{name} is not a valid MJCF: {one_line(reason)}")


def stop_timers() -> None:
    """Have MuJoCo take no time of its steps, which is a third of what a step costs.

    For a process of our own, a command or a cluster's worker, before it steps: what `MjData.timer`
    says of durations is then nothing, and the callback that MuJoCo's package sets cannot be unset
    in Python.
    """
    with contextlib.suppress(OSError, ValueError):
        ctypes.c_void_p.in_dll(ctypes.CDLL(str(libmujoco())), "mjcb_time").value = None


_ENOUGH: Final = 17
"""Digits that tell every float64 from its neighbours."""


@contextlib.contextmanager
def all_digits() -> Iterator[None]:
    """Have MuJoCo write documents with all digits of its numbers, where its library can.

    Its own are six, and the document then compiles to another model than the one that it is of.
    """
    try:
        library = ctypes.CDLL(str(libmujoco()))
        usual = library._mjPRIVATE__get_xml_precision()
        write = library._mjPRIVATE__set_xml_precision
    except (OSError, AttributeError):
        yield
        return
    write(_ENOUGH)
    try:
        yield
    finally:
        write(usual)
