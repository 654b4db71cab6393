"""Change an MJCF by naming what should be different: pole.length=1.5, joint:hinge.damping=0.1.

Edits are made in the document's text, never in a compiled model, where mass and inertia would stay
as they were. By meaning (`EDIT_NAMES`), all that belongs together moves together; by element, one
attribute is written, and has the last word.
"""

import math
import numbers
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Final

import numpy as np

from mjcartpole.errors import ConfigError, ModelError
from mjcartpole.physics.edit.document import Document
from mjcartpole.physics.edit.element_path import find_element, known_attributes, label_of
from mjcartpole.physics.edit.schema import attributes_of, did_you_mean
from mjcartpole.physics.edit.schema import tags as schema_tags
from mjcartpole.physics.edit.semantic_edits import MEANINGS, apply_meanings, meaning_of, names_like
from mjcartpole.physics.edit.xml_elements import number_text

EDIT_NAMES: Final[dict[str, str]] = {
    name: f"{meaning.text} ({meaning.unit})" for name, meaning in MEANINGS.items()
}
"""What can be edited by meaning: name to description and unit, for help texts."""

_AT_LEAST_ZERO: Final = {
    "damping", "frictionloss", "armature", "density", "viscosity", "mass", "diaginertia",
}  # fmt: skip
_MORE_THAN_ZERO: Final = {("option", "timestep"), ("inertial", "mass")}
_WORDS: Final = {"name", "class", "childclass", "joint", "body", "site", "material", "file"}


def parse_edit(text: str) -> tuple[str, float | str]:
    """Return an edit from the command line, such as "pole.length=1.5".

    Returns:
        Key and value: a number for an edit by meaning, text for one by element.

    Raises:
        ConfigError: There is no "=", no such name, no such element or attribute, or the value
            makes no sense.
    """
    key, equals, value = text.partition("=")
    key, value = key.strip(), value.strip()
    if not equals or not key or not value:
        raise ConfigError(
            f"{text!r} is no edit; give NAME=VALUE such as pole.length=1.5 or "
            'joint:hinge.damping=0.1 or geom:pole.rgba="1 0 0 1"'
        )
    if len(value) >= 2 and value[0] == value[-1] and value[0] in "\"'":
        value = value[1:-1]
    check_key(key)
    meaning = meaning_of(key)
    return key, value if meaning is None else meaning.check(key, value)


def edits_of(edits: Mapping[str, object] | Sequence[str]) -> dict[str, object]:
    """Return edits as a mapping, also where they are texts such as "pole.length=1.5".

    Raises:
        ConfigError: A text is no edit, or two are of the same thing.
    """
    if isinstance(edits, Mapping):
        for key in edits:
            if not isinstance(key, str):
                raise ConfigError(f"an edit is called by a text such as 'pole.length', not {key!r}")
        return dict(edits)
    found: dict[str, object] = {}
    texts = [edits] if isinstance(edits, str) or not isinstance(edits, Iterable) else edits
    for text in texts:
        if not isinstance(text, str):
            raise ConfigError(
                'edits are one mapping such as {"pole.length": 1.5}, or texts such as '
                f'"pole.length=1.5", not {text!r}'
            )
        key, value = parse_edit(text)
        if key in found:
            raise ConfigError(f"{key!r} is edited twice; give one value")
        found[key] = value
    return found


def check_key(key: str) -> None:
    """Refuse a key that no document can have, as far as that is known without one.

    Raises:
        ConfigError: It is neither an edit by meaning nor an element and attribute of MJCF.
    """
    if meaning_of(key):
        return
    tag = re.split(r"[.:]", key, maxsplit=1)[0]
    if tag not in schema_tags():
        near = (tag, schema_tags()) if ":" in key else (key, names_like(key))
        raise ConfigError(f"nothing to edit is called {key!r}: {did_you_mean(*near)}")
    selector, _, attribute = key.rpartition(".")
    if not selector or not attribute:
        raise ConfigError(f"{key!r} names no attribute, as joint:hinge.damping does")
    if "." not in selector:
        _check_attribute(key, tag, attribute, attributes_of(tag))


def _check_attribute(key: str, tag: str, attribute: str, known: Sequence[str]) -> None:
    if attribute not in known:
        hint = did_you_mean(attribute, known)
        raise ConfigError(f"{key!r}: <{tag}> has no attribute {attribute!r}, {hint}")


def edit_document(
    document: str, edits: Mapping[str, object], name: str = "the XML document"
) -> str:
    """Return a document with some things changed, and everything else as it was written.

    The order of the edits does not matter: those by meaning come first, those by element after
    them.

    Args:
        document: An MJCF, whole.
        edits: By meaning (see `EDIT_NAMES`) a number, and where there are several poles with the
            pole's number, as pole2.length; by element, "tag:name.attribute" or
            "tag.attribute" where it is the only one, with steps into an element by dots
            (body:pole.inertial.mass, default:stop.geom.size): text, a number, or several numbers.
        name: What a person calls the document.

    Raises:
        ConfigError: An edit names nothing that is there, or a value is outside physics.
        ModelError: The document is no cart-pole, or is none afterwards.
    """
    for key in edits:
        check_key(key)
    if not edits:
        return document
    edited = Document(document)
    meanings = {key: meaning_of(key) for key in edits}
    values = {key: found.check(key, edits[key]) for key, found in meanings.items() if found}
    if values:
        try:
            apply_meanings(edited, values, name, in_one=True)
        except (ConfigError, ModelError):
            # The first step that fails is to say why.
            edited = Document(document)
            apply_meanings(edited, values, name, in_one=False)
    _apply_elements(edited, {key: edits[key] for key in sorted(edits) if key not in values})
    return edited.text


def describe_edits(before: str, after: str) -> list[str]:
    """Return what differs between two documents of the same elements, attribute by attribute.

    Lines are such as 'geom:pole.size: 0.03 → 0.05'; where elements were added, one line says so.
    """
    lines = []
    old, new = Document(before).elements, Document(after).elements
    if [element.tag for element in old] != [element.tag for element in new]:
        return [f"other elements: {len(old)} before, {len(new)} after"]
    for a, b in zip(old, new, strict=True):
        for name in dict.fromkeys([*a.attributes, *b.attributes]):
            was, now = a.attributes.get(name), b.attributes.get(name)
            if was != now:
                lines.append(f"{label_of(b)}.{name}: {was or 'nothing'} → {now or 'nothing'}")
    return lines


def _apply_elements(document: Document, edits: Mapping[str, object]) -> None:
    # Found by place, not by object: putting in a missing element parses the document anew.
    written: dict[tuple[str, str], str] = {}
    for key, value in edits.items():
        element, attribute = find_element(document, key)
        _check_attribute(key, element.tag, attribute, known_attributes(element))
        text = _text(key, value)
        _check_value(key, element.tag, attribute, text)
        place = label_of(element), attribute
        if place in written:
            raise ConfigError(f"{written[place]!r} and {key!r} are the same attribute; give one")
        written[place] = key
        document.set(element, attribute, text)


def _text(key: str, value: object) -> str:
    """Return a value as MJCF writes it."""
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if isinstance(value, numbers.Real):
        return number_text(float(value))
    if isinstance(value, str):
        if not all(sign.isprintable() or sign in "\t\n" for sign in value):
            raise ConfigError(f"{key} must be printable text, not {value!r}")
        return value
    if isinstance(value, Iterable) and not isinstance(value, bytes | Mapping):
        return " ".join(_text(key, each) for each in value)
    raise ConfigError(f"{key} must be text, a number or several numbers, not {value!r}")


def _check_value(key: str, tag: str, attribute: str, text: str) -> None:
    """Refuse numbers that no physics has; whether they are numbers is MuJoCo's question."""
    try:
        values = [float(token) for token in text.split()]
    except ValueError:
        return
    if attribute not in _WORDS and not all(math.isfinite(value) for value in values):
        raise ConfigError(f"{key} must be finite, not {text!r}")
    if (tag, attribute) in _MORE_THAN_ZERO and not all(value > 0 for value in values):
        raise ConfigError(f"{key} must be more than 0, not {text!r}")
    if attribute in _AT_LEAST_ZERO and not all(value >= 0 for value in values):
        raise ConfigError(f"{key} must be 0 or more, not {text!r}")
