"""An MJCF is read with its includes, and refused where loading it would not end well.

MuJoCo reads `<include>` relative to the folder of the main file or of the file that includes, and
each file once. It does as it is told where a document asks for a million copies, a texture of many
gigabytes or a model that attaches itself; those numbers and files are looked at first.
"""

import math
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

from mjcartpole.errors import (
    ModelError,
    ModelNotFoundError,
    ModelSyntaxError,
    NotACartPoleError,
)
from mjcartpole.physics.assets import (
    MODEL,
    Asset,
    Folders,
    check_files,
    find_assets,
    folders_of,
    what_else,
    with_absolute_paths,
)
from mjcartpole.physics.document import made_strict
from mjcartpole.physics.soundness import MOST_ITERATIONS

LARGEST_FILE: Final = 2**24
"""Bytes of one file of a document."""

MOST_ELEMENTS: Final = 5_000
"""Elements of a document, with attached models and all copies by `<replicate>` and its like."""

DEEPEST: Final = 200
"""Levels of elements inside each other."""

DEEPEST_MODELS: Final = 20
"""Levels of models attached to each other."""

_COPYING: Final = ("replicate", "composite", "flexcomp")

_ITERATIONS: Final = (
    "iterations", "ls_iterations", "noslip_iterations", "ccd_iterations", "sdf_iterations",
    "sdf_initpoints",
)  # fmt: skip
"""Attributes of <option>. MuJoCo runs its solver while it compiles, so that later is too late."""

_UNITS: Final = {"K": 2**10, "M": 2**20, "G": 2**30, "T": 2**40, "P": 2**50, "E": 2**60}

_USER_DATA: Final = ("body", "jnt", "geom", "site", "cam", "tendon", "actuator", "sensor")

_LIMITS: Final = (
    ("texture", ("width", "height"), 2**25),
    ("hfield", ("nrow", "ncol"), 2**22),
    ("mesh", ("params",), 300),
    ("numeric", ("size",), 10_000),
    ("user", ("dim",), 10_000),
    ("size", ("memory",), 2**30),
    ("size", ("nstack",), 2**27),
    ("size", ("njmax",), 100_000),
    ("size", ("nconmax",), 100_000),
    ("size", ("nuserdata",), 10_000),
    ("size", ("nkey",), 10_000),
    *(("size", (f"nuser_{kind}",), 1_000) for kind in _USER_DATA),
    (None, ("nsample",), 10_000),
)
"""Element (None: any), attributes whose product counts, and the largest product allowed."""


@dataclass(frozen=True)
class _Origin:
    """The included file that an element comes from.

    Attributes:
        name: What a person calls it.
        folder: Where it is, absolute.
    """

    name: str
    folder: Path


@dataclass(frozen=True)
class _Reading:
    """A document with its includes in their place.

    Attributes:
        name: What a person calls it.
        root: Its outermost element.
        folders: Where the files that it names are sought.
        assets: These files.
    """

    name: str
    root: ElementTree.Element
    folders: Folders
    assets: list[Asset]


@dataclass
class _Family:
    """The models that are attached to a document, each looked at once.

    Attributes:
        elements: By a model's file, how many elements it comes to.
        above: The files that are being looked at, each attached to the one before it.
    """

    elements: dict[str, float] = field(default_factory=dict)
    above: list[str] = field(default_factory=list)


def read_text(path: Path, name: str = "") -> str:
    """The text of a file.

    Args:
        path: Where it is.
        name: What a person calls it; without one it is the model file of that path.

    Raises:
        ModelNotFoundError: It cannot be read, or is no regular file.
        ModelSyntaxError: It is too large to be a document, or not text in UTF-8.
    """
    name = name or f"model file '{path}'"
    if kind := what_else(path):
        raise ModelNotFoundError(f"{name} cannot be read: '{path}' is {kind}")
    try:
        size = path.stat().st_size
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)
    except (OSError, ValueError) as error:
        raise ModelNotFoundError(f"{name} cannot be read: {error}") from error
    if len(content) > LARGEST_FILE:
        raise ModelSyntaxError(
            f"{name} has {max(size, len(content))} bytes; an MJCF is XML of some kilobytes, "
            f"and no more than {LARGEST_FILE} bytes are read"
        )
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ModelSyntaxError(
            f"{name} is not text in UTF-8 (byte {error.start} does not fit); save it as UTF-8"
        ) from error


def stand_alone(text: str, name: str, folder: Path) -> str:
    """The document with the content of its included files in their place.

    Args:
        text: As it was written. Without includes and other files it is returned to the last
            character.
        name: What a person calls it.
        folder: Where its includes and other files are; the document names the latter by absolute
            paths.

    Raises:
        ModelNotFoundError: An included file, or a model that it attaches, cannot be read.
        ModelSyntaxError: It is no XML, no MJCF, includes a file twice or attaches itself.
        ModelError: It asks for more copies, pixels or nesting than any cart-pole needs.
        NotACartPoleError: It has a muscle.
    """
    root = _parse(text, name)
    includes = root.find(".//include") is not None
    reading = _read(root, name, folder.resolve())
    _count(reading, _Family())
    if includes:
        text = ElementTree.tostring(reading.root, encoding="unicode")
    return with_absolute_paths(text, reading.assets, reading.folders)


def _invalid(name: str, reason: str) -> ModelSyntaxError:
    return ModelSyntaxError(f"{name} is not a valid MJCF: {reason}")


def _parse(text: str, name: str) -> ElementTree.Element:
    if not text.strip():
        raise _invalid(name, "it is empty")
    if "\0" in text:
        raise _invalid(name, "it holds a zero byte, so it is not text")
    parser = ElementTree.XMLParser(target=ElementTree.TreeBuilder(insert_comments=True))
    try:
        return ElementTree.fromstring(text, parser)
    except (ElementTree.ParseError, ValueError) as error:
        reason = error
    # What MuJoCo takes, as people write it.
    try:
        return ElementTree.fromstring(made_strict(text))
    except (ElementTree.ParseError, ValueError):
        raise _invalid(name, f"it is not well-formed XML: {reason}") from reason


def _read(root: ElementTree.Element, name: str, folder: Path) -> _Reading:
    """Put a document's includes in their place and find the files that it names."""
    if root.tag != "mujoco":
        urdf = " (a URDF; MuJoCo can save it as MJCF)" if root.tag == "robot" else ""
        raise _invalid(name, f"its outermost element is <{root.tag}>{urdf}, not <mujoco>")
    origins = _put_includes(root, name, folder)
    folders = folders_of(root, folder)
    assets = find_assets(root, folders, {each: origins[each].folder for each in origins})
    check_files(assets, name)
    return _Reading(name, root, folders, assets)


def _put_includes(
    root: ElementTree.Element, name: str, folder: Path
) -> dict[ElementTree.Element, _Origin]:
    """Put the content of included files in their place; returns what came from where."""
    origins: dict[ElementTree.Element, _Origin] = {}
    seen: set[str] = set()
    parents = [root]
    while parents:
        parent, place = parents.pop(), 0
        while place < len(parent):
            include = parent[place]
            if include.tag != "include":
                place += 1
                continue
            origin = origins.get(include, _Origin(name, folder))
            path = _included_file(include, origin, folder)
            if (key := os.path.realpath(path)) in seen:
                file = include.get("file")
                raise _invalid(name, f"it includes '{file}' more than once, or in a circle")
            seen.add(key)
            who = f"'{include.get('file')}', which {origin.name} includes,"
            included = _parse(read_text(path, who), who)
            came = _Origin(f"'{include.get('file')}'", path.parent)
            origins.update(dict.fromkeys(included.iter(), came))
            parent[place : place + 1] = list(included)
        parents.extend(parent)
    return origins


def _included_file(include: ElementTree.Element, origin: _Origin, folder: Path) -> Path:
    """Where an included file is: beside the main file, else beside the one that includes it."""
    file = include.get("file", "").replace("\\", "/")
    if not file:
        raise ModelNotFoundError(
            f"{origin.name} cannot be read whole: an <include> of it names no file; "
            'write <include file="..."/>'
        )
    usual, beside = folder / file, origin.folder / file
    try:
        return usual if usual.exists() or not beside.exists() else beside
    except (OSError, ValueError):
        return usual


def _count(reading: _Reading, family: _Family) -> float:
    """How many elements a document and the models that it attaches come to.

    Raises:
        ModelError: They are too many, or ask for too much.
    """
    attached = [_count_file(asset, reading, family) for asset in _models(reading)]
    return _check_amounts(reading.root, reading.name, attached)


def _models(reading: _Reading) -> list[Asset]:
    found = [asset for asset in reading.assets if asset.tag == MODEL]
    if len(found) != len(list(reading.root.iter(MODEL))):
        raise _invalid(reading.name, "a <model> of it names no file")
    return found


def _count_file(asset: Asset, reading: _Reading, family: _Family) -> float:
    """How many elements an attached model comes to; MuJoCo follows a circle until it crashes."""
    key = os.path.realpath(asset.path)
    if key in family.elements:
        return family.elements[key]
    if key in family.above:
        raise _invalid(reading.name, f"it attaches '{asset.name}' in a circle")
    if len(family.above) >= DEEPEST_MODELS:
        raise ModelError(
            f"{reading.name} is one of models attached to each other more than {DEEPEST_MODELS} "
            "levels deep"
        )
    who = f"'{asset.name}', which {reading.name} attaches,"
    family.above.append(key)
    root = _parse(read_text(asset.path, who), who)
    count = _count(_read(root, f"'{asset.name}'", asset.path.parent), family)
    family.above.pop()
    family.elements[key] = count
    return count


def _check_amounts(root: ElementTree.Element, name: str, attached: list[float]) -> float:
    """Refuse what would keep MuJoCo busy for ever, or fill the memory.

    Args:
        root: The outermost element of a document.
        name: What a person calls it.
        attached: How many elements the models come to that it attaches.

    Returns:
        How many elements it comes to.
    """
    total, waiting = sum(attached), [(root, 0, 1.0)]
    while waiting:
        element, depth, copies = waiting.pop()
        if element.tag in _COPYING:
            copies *= _product(element.get("count", ""))
        if element.tag == "attach":
            # Without a model it copies a body of the document, which may hold copies itself.
            total += copies * (max(attached, default=0.0) if element.get(MODEL) else total)
        total += copies
        if total > MOST_ELEMENTS:
            raise ModelError(
                f"{name} has more than {MOST_ELEMENTS} elements, copies by <replicate> and its "
                "like included; a cart-pole needs a few dozen"
            )
        if depth > DEEPEST:
            raise ModelError(f"{name} nests its elements more than {DEEPEST} levels deep")
        _check_numbers(element, name)
        _check_iterations(element, name)
        _check_muscles(element, name)
        waiting.extend((child, depth + 1, copies) for child in reversed(element))
    return total


def _check_numbers(element: ElementTree.Element, name: str) -> None:
    for tag, attributes, limit in _LIMITS:
        if tag not in {None, element.tag}:
            continue
        values = [element.get(attribute, "") for attribute in attributes]
        if _product(" ".join(values)) > limit:
            raise ModelError(
                f"{name} asks for too much: {' x '.join(attributes)} of <{element.tag}> is "
                f"{' x '.join(value[:20] for value in values)}; no more than {limit} is allowed"
            )


def _check_iterations(element: ElementTree.Element, name: str) -> None:
    for attribute in _ITERATIONS if element.tag == "option" else ():
        value = element.get(attribute, "")
        if _product(value) > MOST_ITERATIONS:
            raise ModelError(
                f"{name} asks for {value[:20]} {attribute} in each step; no more than "
                f"{MOST_ITERATIONS} are done"
            )


def _check_muscles(element: ElementTree.Element, name: str) -> None:
    """Refuse muscles before they are compiled: MuJoCo then simulates them, which may take for ever.

    A cart-pole has one actuator, a plain motor, so nothing is refused that could be one.
    """
    kinds = {element.get(kind) for kind in ("dyntype", "gaintype", "biastype")}
    if "muscle" in kinds or (element.tag == "muscle" and element.get("joint") is not None):
        raise NotACartPoleError(
            f"{name} is not a cart-pole: it has a muscle, with activation states, where one plain "
            "motor on the slide joint is needed"
        )
    if element.tag == "lengthrange" and element.get("mode") in {"all", "muscleuser"}:
        raise ModelError(
            f"{name} has MuJoCo simulate the length ranges of its actuators (<lengthrange>), which "
            "may take for ever; a motor needs none, leave it out"
        )


def _product(text: str) -> float:
    """The product of the numbers above 1 in a text; what is no number is MuJoCo's to refuse."""
    product = 1.0
    for word in text.split():
        unit = _UNITS.get(word[-1], 1)
        try:
            value = float(word if unit == 1 else word[:-1]) * unit
        except ValueError:
            continue
        product *= 1.0 if math.isnan(value) else max(1.0, value)
    return product
