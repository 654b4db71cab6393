"""From a document to a cart-pole: whole, compiled, its parts found; each text once."""

import dataclasses
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import mujoco

from mjcartpole.physics.cache import remembered
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.guard import compile_document
from mjcartpole.physics.includes import read_whole
from mjcartpole.physics.sanity_checks import check_motion, check_numbers
from mjcartpole.physics.structure import (
    check_directions,
    check_independent,
    check_limits,
    count_from_upright,
    find_controls,
    find_joints,
    find_substeps,
)
from mjcartpole.task import CARTPOLE_V1

_NAMES_FILE: Final = re.compile(r"file\w*\s*=")
"""In the text of a document that depends on other files: includes, meshes, attached models."""

LARGEST_LEAN: Final = CARTPOLE_V1.theta_limit
"""A pole that leans by more, rad, at its document's angle 0 has its angle counted from upright.

The same for every task: it belongs to the document, which one task stores and another may read."""


def build(text: str, name: str, own_timestep: bool, path: Path | None = None) -> CartPole:
    """Return the cart-pole that a document describes; shared by all, so nobody may change it.

    Args:
        text: The document as it was written.
        name: What a person calls it.
        own_timestep: Whether a control step is one physics step of the document's.
        path: The file that it was read from; None where there is none.

    Raises:
        ModelError: It does not load, or is no cart-pole.
    """
    folder, called = (path.parent, str(path)) if path else (Path(), name)

    def make() -> CartPole:
        return find_parts(name, *compile_text(text, called, folder), own_timestep)

    if _NAMES_FILE.search(text):
        return make()
    return dataclasses.replace(remembered((text, own_timestep), make), name=name)


def compile_text(
    text: str, name: str, folder: Path, inside: Sequence[Path] | None = None
) -> tuple[str, mujoco.MjModel]:
    """Return a document, whole (see `read_whole`), and its compiled model.

    Raises:
        ModelError: See `read_whole` and `compile_document`.
    """
    document = read_whole(text, name, folder, inside)
    return document.text, compile_document(document, name)


def find_parts(name: str, xml: str, model: mujoco.MjModel, own_timestep: bool) -> CartPole:
    """Return a compiled model as a cart-pole.

    Raises:
        ModelError: It is none, or no simulation survives its numbers.
    """
    check_numbers(name, model)
    slider, hinges = find_joints(name, model)
    controls = find_controls(name, model, slider)
    substeps = 1 if own_timestep else find_substeps(name, model)
    cartpole = CartPole(name, xml, model, slider, hinges, controls, substeps, (0.0,) * len(hinges))
    # From the cart outwards: which way a pole on a pole stands depends on the one below it.
    upright = tuple(_count_from_upright(name, cartpole, pole) for pole in range(cartpole.poles))
    cartpole = dataclasses.replace(cartpole, upright=upright)
    check_limits(name, cartpole)
    check_independent(name, cartpole)
    check_motion(name, cartpole)
    return cartpole


def _count_from_upright(name: str, cartpole: CartPole, pole: int) -> float:
    """Have a pole's angle count from upright, if it does not; return the angle that became 0."""
    upright = check_directions(name, cartpole, pole).upright
    if abs(upright) <= LARGEST_LEAN:
        return 0.0
    return count_from_upright(name, cartpole, pole, upright)
