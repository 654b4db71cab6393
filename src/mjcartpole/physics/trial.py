"""Compile and step a document with bounded memory and time: a script for a process of its own.

It calls MuJoCo's library directly, since importing the mujoco package takes ten times as long as
all that is done here. Arguments: the library, the folder of its plugins, bytes, seconds. The
document comes by stdin, a reason why it cannot be used goes to stdout.
"""

import contextlib
import ctypes
import os
import sys
import time
from typing import Final

STEP_SECONDS: Final = 0.01
"""That a physics step may take, on average over the track."""

_STEPS: Final = 3
_PLACES: Final = (0.0, -2.4, -1.2, 1.2, 2.4)
_QPOS: Final = 2
"""mjSTATE_QPOS."""

_HANDLER: Final = ctypes.CFUNCTYPE(None, ctypes.c_char_p)


def limit(memory: int, seconds: int) -> None:
    """Have the system end this process where it asks for more; Windows cannot."""
    try:
        import resource  # noqa: PLC0415 - there is none on Windows
    except ImportError:
        return
    for kind, most in ((resource.RLIMIT_AS, memory), (resource.RLIMIT_CPU, seconds)):
        with contextlib.suppress(ValueError, OSError):  # macOS limits no addresses.
            resource.setrlimit(kind, (most, most))
    with contextlib.suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def try_document(text: bytes, library: str, plugins: str) -> str:
    """Say why a document does not compile, or cannot be stepped in time; empty if it can.

    The first word says which: INVALID, FATAL (MuJoCo gives up) or SLOW.
    """
    lib = ctypes.CDLL(library)
    for name in ("mj_parseXMLString", "mj_compile", "mj_makeData", "mjs_getError"):
        getattr(lib, name).restype = ctypes.c_void_p
    handlers = _HANDLER(_give_up), _HANDLER(lambda _: None)
    for name, handler in zip(("mju_user_error", "mju_user_warning"), handlers, strict=True):
        ctypes.c_void_p.in_dll(lib, name).value = ctypes.cast(handler, ctypes.c_void_p).value
    lib.mj_loadAllPluginLibraries(plugins.encode(), None)
    reason = ctypes.create_string_buffer(1000)
    spec = lib.mj_parseXMLString(ctypes.c_char_p(text), None, reason, len(reason))
    if not spec:
        return f"INVALID {reason.value.decode(errors='replace')}"
    model = lib.mj_compile(ctypes.c_void_p(spec), None)
    if not model:
        error = ctypes.string_at(lib.mjs_getError(ctypes.c_void_p(spec)))
        return f"INVALID {error.decode(errors='replace')}"
    return _step(lib, ctypes.c_void_p(model))


def _step(lib: ctypes.CDLL, model: ctypes.c_void_p) -> str:
    data = ctypes.c_void_p(lib.mj_makeData(model))
    size = lib.mj_stateSize(model, _QPOS)
    started = time.process_time()
    for place in _PLACES:
        lib.mj_resetData(model, data)
        lib.mj_setState(model, data, (ctypes.c_double * size)(*[place] * size), _QPOS)
        for _ in range(_STEPS):
            lib.mj_step(model, data)
    steps = len(_PLACES) * _STEPS
    taken = (time.process_time() - started) / steps
    return f"SLOW a step of physics takes {taken:.3g} s" if taken > STEP_SECONDS else ""


def _give_up(message: bytes) -> None:
    _answer(f"FATAL {message.decode(errors='replace')}")


def _answer(reason: str) -> None:
    sys.stdout.buffer.write(reason.encode(errors="replace"))
    sys.stdout.flush()
    os._exit(0)


if __name__ == "__main__":
    limit(int(sys.argv[3]), int(sys.argv[4]))
    try:
        _answer(try_document(sys.stdin.buffer.read(), sys.argv[1], sys.argv[2]))
    except MemoryError:
        os._exit(1)
