"""From "body:pole.inertial.mass" to the element that is meant."""

import re
from collections.abc import Sequence
from typing import Final

from mjcartpole.errors import ConfigError
from mjcartpole.physics.edit.document import Document, Element
from mjcartpole.physics.edit.schema import attributes_of, did_you_mean, node_at, schema

_STEP: Final = re.compile(r"([^.:]+)([.:]?)(.*)", re.DOTALL)


def find_element(document: Document, key: str) -> tuple[Element, str]:
    """Return the element and the attribute that a key names.

    A section that is missing, such as <option>, is put into the document: elements that were found
    before are then out of date.

    Raises:
        ConfigError: There is no such element, or more than one.
    """
    rest, _, attribute = key.rpartition(".")
    element: Element | None = None
    while rest:
        element, rest = _step(document, key, element, rest)
    if element is None:
        raise ConfigError(f"{key!r} names no element")
    return element, attribute


def label_of(element: Element) -> str:
    """Return how a key names an element."""
    if element.name and not (element.tag == "default" and element.name == "main"):
        return f"{element.tag}:{element.name}"
    parent = element.parent
    if parent is None or parent.parent is None or parent.tag in {"worldbody", "visual"}:
        return element.tag
    return f"{label_of(parent)}.{element.tag}"


def known_attributes(element: Element) -> Sequence[str]:
    """Return the attributes that MJCF has for an element where it stands, sorted."""
    path: list[str] = []
    above = element
    while above.parent is not None:
        path.insert(0, above.tag)
        above = above.parent
    node = node_at(path)
    return sorted(node.attributes) if node else attributes_of(element.tag)


def _step(document: Document, key: str, inside: Element | None, rest: str) -> tuple[Element, str]:
    """Take one step of a path; return the element it leads to, and what remains of the path."""
    match = _STEP.match(rest)
    if match is None:
        raise ConfigError(f"{key!r} is no name of an element and an attribute")
    tag, separator, after = match.groups()
    found = _candidates(document, inside, tag)
    if separator == ":":
        return _named(key, tag, found, after)
    if tag == "default" and inside is None:
        found = [element for element in found if element.parent is document.root]
    if not found:
        return _missing(document, key, inside, tag), after
    if len(found) > 1 and not _acts_as_one(inside, tag):
        names = ", ".join(label_of(element) for element in found[:20])
        raise ConfigError(f"{key!r}: the document has {len(found)} <{tag}>; say which of {names}")
    return found[-1], after


def _candidates(document: Document, inside: Element | None, tag: str) -> list[Element]:
    if inside is not None:
        return inside.find(tag)
    found = [element for element in document.elements if element.tag == tag]
    return found if tag == "default" else [each for each in found if not _in_defaults(each)]


def _in_defaults(element: Element) -> bool:
    while element.parent is not None:
        element = element.parent
        if element.tag == "default":
            return True
    return False


def _named(key: str, tag: str, found: list[Element], after: str) -> tuple[Element, str]:
    """Find an element by name; names may hold dots, so the longest that fits is meant."""
    fitting = [
        element for element in found
        if element.name and (after == element.name or after.startswith(f"{element.name}."))
    ]  # fmt: skip
    if not fitting:
        names = [element.name for element in found if element.name]
        hint = did_you_mean(after, names)
        raise ConfigError(f"{key!r}: no <{tag}> of the document is called {after!r}, {hint}")
    longest = max(len(element.name) for element in fitting)
    fitting = [element for element in fitting if len(element.name) == longest]
    if len(fitting) > 1:
        places = ", ".join(
            f"{each.parent.tag}.{tag}:{each.name}" for each in fitting if each.parent
        )
        raise ConfigError(f"{key!r}: {len(fitting)} elements are called so; say which of {places}")
    return fitting[0], after[longest + 1 :]


def _acts_as_one(inside: Element | None, tag: str) -> bool:
    """Return whether MuJoCo reads several of these as one, later attributes before earlier ones."""
    return inside is None and tag in schema().children and schema().children[tag].single


def _missing(document: Document, key: str, inside: Element | None, tag: str) -> Element:
    """Put in a section that is not there; anything else cannot be guessed."""
    if inside is not None:
        node = node_at([inside.tag])
        if node is not None and tag in node.children and node.children[tag].single:
            return document.insert(inside, tag)
        hint = did_you_mean(tag, [child.tag for child in inside.children])
        raise ConfigError(f"{key!r}: {label_of(inside)} has no <{tag}>, {hint}")
    if tag in _SECTIONS:
        return document.insert(document.root, tag)
    for section in ("option", "visual", "compiler"):
        if tag in schema().children[section].children:
            outer, _ = _step(document, key, None, section)
            return document.insert(outer, tag)
    there = {element.tag for element in document.elements}
    raise ConfigError(f"{key!r}: the document has no <{tag}>, {did_you_mean(tag, there)}")


_SECTIONS: Final = ("compiler", "option", "size", "statistic", "visual", "default")
