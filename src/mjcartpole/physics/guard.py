"""Guard: a document is compiled where it can do no harm before it is compiled here.

MuJoCo does as it is told where a document asks for a million copies, a texture of many gigabytes
or a model that attaches itself, and there are more such ways than can be listed. A trial in a
process of its own, with bounded memory and time, costs 20 ms (see trial.py). Plain documents, of
the elements that every cart-pole has, are spared that.
"""

import hashlib
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Final

import mujoco

from mjcartpole.errors import ModelError, NotACartPoleError
from mjcartpole.physics.edit.document import Document
from mjcartpole.physics.library import invalid, libmujoco, one_line

MEMORY: Final = 768 * 2**20
"""Bytes that a document may take while it is compiled and stepped."""

SECONDS: Final = 4
"""Of one CPU, for the same."""

_PATIENCE: Final = 10.0
"""Seconds on the clock."""

_PLAIN: Final = frozenset({
    "mujoco", "compiler", "option", "flag", "statistic", "visual", "global", "quality", "headlight",
    "map", "rgba", "default", "asset", "material", "worldbody", "body", "frame", "inertial",
    "joint", "geom", "site", "camera", "light", "actuator", "motor",
})  # fmt: skip
"""Elements that ask for no more than what is written of them."""
_MOST_PLAIN: Final = 100
_COSTLY: Final = re.compile("file|nsample|.*iterations|sdf_.*")
"""Attributes that no plain document has."""

_ENDED: Final = (9, 24)
"""SIGKILL and SIGXCPU, which the system sends for too much time."""

_TRIAL: Final = Path(__file__).with_name("trial.py")

_stood: set[bytes] = set()
"""Checksums of documents that stood their trial."""


def compile_document(document: Document, name: str) -> mujoco.MjModel:
    """Compile a document that a person calls by a name, and that names its files by full paths.

    Raises:
        ModelSyntaxError: MuJoCo does not accept it.
        ModelError: It takes too much memory or time, or MuJoCo crashes on it.
    """
    text = document.text
    if not _is_plain(document):
        _try(text, name)
    try:
        return mujoco.MjModel.from_xml_string(text)
    except (ValueError, mujoco.FatalError) as error:
        raise invalid(name, error) from error


def _is_plain(document: Document) -> bool:
    elements = document.elements
    attributes = {name for each in elements for name in each.attributes}
    is_plain = len(elements) <= _MOST_PLAIN and {each.tag for each in elements} <= _PLAIN
    return is_plain and not any(map(_COSTLY.fullmatch, attributes))


def _try(text: str, name: str) -> None:
    """Compile and step a document in another process, once as long as its text is the same."""
    library, checksum = libmujoco(), hashlib.sha256(text.encode()).digest()
    if checksum in _stood or not (library and sys.executable) or hasattr(sys, "frozen"):
        return
    limits = str(MEMORY), str(SECONDS)
    try:
        ended = subprocess.run(
            [sys.executable, "-I", "-S", _TRIAL, library, mujoco.PLUGINS_DIR, *limits],
            # Each thread's own heap would count as memory.
            env={**os.environ, "MALLOC_ARENA_MAX": "1"},
            input=text.encode(),
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            timeout=_PATIENCE,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise _too_much(name, f"it was not done within {_PATIENCE:.0f} s") from None
    except OSError as error:
        raise ModelError(f"{name} cannot be tried out: {error.strerror}") from error
    _judge(name, ended.returncode, ended.stdout.decode(errors="replace"))
    _stood.add(checksum)


def _judge(name: str, code: int, answer: str) -> None:
    kind, _, reason = answer.partition(" ")
    if kind == "FATAL" and re.search("memory|arena|stack", reason):
        raise _too_much(name, "its contacts and constraints outgrow the memory that it gives them")
    if "alloc" in reason or "memory" in reason:
        raise _too_much(name, "there was no memory left")
    if "Lengthrange" in reason:
        raise NotACartPoleError(
            f"{name} is not a cart-pole: it has a muscle, or another actuator whose lengths MuJoCo "
            "must find by simulation, where one plain motor on the slide joint is needed"
        )
    if kind == "INVALID":
        raise invalid(name, reason)
    if kind:
        raise ModelError(f"MuJoCo gives up on {name}: {one_line(reason)}")
    if code:
        raise _too_much(name, "it was ended" if -code in _ENDED else "it crashed")


def _too_much(name: str, reason: str) -> ModelError:
    return ModelError(
        f"{name} asks for too much: MuJoCo could not compile and step it with "
        f"{MEMORY // 2**20} MB, {SECONDS} s of processor time and {_PATIENCE:.0f} s in all "
        f"({reason}); look for large textures, height fields, "
        "meshes, files and counts, for geoms that all touch and models that attach themselves"
    )
