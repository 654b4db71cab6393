"""From a document to a cart-pole: whole, compiled, its parts found; each text once."""

import dataclasses
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import mujoco

from mjcartpole.physics.cache import remembered
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.edit.document import Document
from mjcartpole.physics.guard import compile_document
from mjcartpole.physics.includes import read_whole
from mjcartpole.physics.sanity_checks import check_motion, check_numbers
from mjcartpole.physics.structure import (
    UnfitError,
    check_independent,
    check_limits,
    count_from_upright,
    find_controls,
    find_joints,
    refusal,
)

NAMES_FILE: Final = re.compile(r"file\w*\s*=")
"""In the text of a document that depends on other files: includes, meshes, attached models."""


def build(source: str | Document, name: str, path: Path | None = None) -> CartPole:
    """Return the cart-pole that a document describes; shared by all, so nobody may change it.

    `source` is its text, or what was read as such and had no more than values changed since;
    `name` is what a person calls it, `path` the file that it was read from, if there is one.

    Raises:
        ModelError: It does not load, or is no cart-pole.
    """
    text = source if isinstance(source, str) else source.text
    names_files = NAMES_FILE.search(text)

    def make() -> CartPole:
        if isinstance(source, Document) and not names_files:
            return find_parts(name, text, compile_document(source, name))
        folder, called = (path.parent, str(path)) if path else (Path(), name)
        return find_parts(name, *compile_text(text, called, folder))

    return make() if names_files else dataclasses.replace(remembered(text, make), name=name)


def compile_text(
    text: str, name: str, folder: Path, inside: Sequence[Path] | None = None
) -> tuple[str, mujoco.MjModel]:
    """Return a document, whole (see `read_whole`), and its compiled model.

    Raises:
        ModelError: See `read_whole` and `compile_document`.
    """
    document = read_whole(text, name, folder, inside)
    return document.text, compile_document(document, name)


def find_parts(name: str, xml: str, model: mujoco.MjModel) -> CartPole:
    """Return a compiled model as a cart-pole, whose control step is one physics step.

    Raises:
        ModelError: It is none, or no simulation survives its numbers.
    """
    check_numbers(name, model)
    try:
        slider, hinges = find_joints(model)
        controls = find_controls(model, slider)
        found = CartPole(name, xml, model, slider, hinges, controls, 1, ())
        data = mujoco.MjData(model)
        # From the cart outwards: which way a pole on a pole stands depends on the one below it.
        upright = tuple(count_from_upright(found, pole, data) for pole in range(found.poles))
        check_limits(found)
        check_independent(found, data)
    except UnfitError as unfit:
        raise refusal(name, model, unfit) from None
    check_motion(found, data)
    return dataclasses.replace(found, upright=upright)
