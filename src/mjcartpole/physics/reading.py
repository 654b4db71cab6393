"""An MJCF is read with its includes, and refused where loading it would not end well.

MuJoCo reads `<include>` relative to the folder of the main file, and each file once. It does as
it is told where a document asks for a million copies or a texture of many gigabytes; those
numbers are looked at first.
"""

import math
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

from mjcartpole.errors import (
    ModelError,
    ModelNotFoundError,
    ModelSyntaxError,
    NotACartPoleError,
)

LARGEST_FILE: Final = 2**24
"""Bytes of one file of a document."""

MOST_ELEMENTS: Final = 5_000
"""Elements of a document, with all copies that `<replicate>` and its like make of them."""

DEEPEST: Final = 200
"""Levels of elements inside each other."""

_COPYING: Final = ("replicate", "composite", "flexcomp")

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


def read_text(path: Path) -> str:
    """The text of a file.

    Raises:
        ModelNotFoundError: It cannot be read.
        ModelSyntaxError: It is too large to be a document, or not text in UTF-8.
    """
    try:
        size = path.stat().st_size
        content = path.read_bytes() if size <= LARGEST_FILE else b""
    except (OSError, ValueError) as error:
        raise ModelNotFoundError(f"model file '{path}' cannot be read: {error}") from error
    if size > LARGEST_FILE:
        raise ModelSyntaxError(
            f"model file '{path}' has {size} bytes; an MJCF is XML of some kilobytes, "
            f"and no more than {LARGEST_FILE} bytes are read"
        )
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ModelSyntaxError(
            f"model file '{path}' is not text in UTF-8 (byte {error.start} does not fit); "
            "save it as UTF-8"
        ) from error


def stand_alone(text: str, name: str, folder: Path) -> str:
    """The document with the content of its included files in their place.

    Args:
        text: As it was written. Without includes it is returned to the last character.
        name: What a person calls it.
        folder: Where its includes are.

    Raises:
        ModelNotFoundError: An included file cannot be read.
        ModelSyntaxError: It is no XML, no MJCF, or includes a file twice.
        ModelError: It asks for more copies, pixels or nesting than any cart-pole needs.
        NotACartPoleError: It has a muscle.
    """
    root = _parse(text, name)
    if root.tag != "mujoco":
        urdf = " (a URDF; MuJoCo can save it as MJCF)" if root.tag == "robot" else ""
        raise _invalid(name, f"its outermost element is <{root.tag}>{urdf}, not <mujoco>")
    includes = root.find(".//include") is not None
    if includes:
        _put_includes(root, name, folder)
    _check_amounts(root, name)
    return ElementTree.tostring(root, encoding="unicode") if includes else text


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
    # MuJoCo takes comments with "--" in them, as people write them.
    try:
        return ElementTree.fromstring(_without_comments(text))
    except (ElementTree.ParseError, ValueError):
        raise _invalid(name, f"it is not well-formed XML: {reason}") from reason


def _without_comments(text: str) -> str:
    """The text with line breaks in place of its comments."""
    kept, place = [], 0
    while (start := text.find("<!--", place)) >= 0 and (end := text.find("-->", start + 4)) >= 0:
        kept += [text[place:start], "\n" * text.count("\n", start, end)]
        place = end + 3
    return "".join([*kept, text[place:]])


def _put_includes(root: ElementTree.Element, name: str, folder: Path) -> None:
    seen: set[str] = set()
    parents = [root]
    while parents:
        parent, place = parents.pop(), 0
        while place < len(parent):
            if parent[place].tag != "include":
                place += 1
                continue
            file = parent[place].get("file", "")
            if file in seen:
                raise _invalid(name, f"it includes '{file}' more than once, or in a circle")
            seen.add(file)
            included = _parse(read_text(folder / file), f"'{file}', which {name} includes,")
            parent[place : place + 1] = list(included)
        parents.extend(parent)


def _check_amounts(root: ElementTree.Element, name: str) -> None:
    """Refuse what would keep MuJoCo busy for ever, or fill the memory."""
    total, waiting = 0.0, [(root, 0, 1.0)]
    while waiting:
        element, depth, copies = waiting.pop()
        if element.tag in _COPYING:
            copies *= _product(element.get("count", ""))
        total += copies
        if total > MOST_ELEMENTS:
            raise ModelError(
                f"{name} has more than {MOST_ELEMENTS} elements, copies by <replicate> and its "
                "like included; a cart-pole needs a few dozen"
            )
        if depth > DEEPEST:
            raise ModelError(f"{name} nests its elements more than {DEEPEST} levels deep")
        _check_numbers(element, name)
        _check_muscles(element, name)
        waiting.extend((child, depth + 1, copies) for child in element)


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
