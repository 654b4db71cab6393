"""An MJCF as text that is edited in place: what is not edited stays as it was written.

No XML writer keeps comments, quotes and the spaces between attributes, so nothing is written anew:
expat says where each start tag begins, and an edit replaces or inserts bytes there. (lxml knows
lines only, no columns.)
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final
from xml.parsers import expat
from xml.sax.saxutils import escape

from mjcartpole.errors import ModelSyntaxError

MOST_ATTRIBUTES: Final = 1_000
"""Of one element; MJCF knows some fifty."""

MOST_ELEMENTS: Final = 5_000
"""Elements of a document."""

DEEPEST: Final = 200
"""Levels of elements inside each other."""

_COMMENT: Final = re.compile(rb"<!--(.*?)-->", re.DOTALL)
_BLANK: Final = bytes(byte if byte in b"\r\n" else ord(" ") for byte in range(256))
_SPACED_TAG: Final = re.compile(rb"<(\s+)(?=[A-Za-z])")

_ATTRIBUTE: Final = re.compile(rb"""\s+([^\s=/>"']+)\s*=\s*("[^"]*"|'[^']*')""")


@dataclass(eq=False)
class Element:
    """An element of a document.

    Attributes:
        tag: Its tag.
        attributes: As they are in the document, entities resolved.
        parent: The element around it; None for the root.
        start: Where its `<` is, in bytes.
        children: The elements in it, in order.
        closes: Where its end tag, if it has one, was when the text was read.
    """

    tag: str
    attributes: dict[str, str]
    parent: "Element | None"
    start: int
    children: list["Element"] = field(default_factory=list)
    closes: int = 0

    @property
    def name(self) -> str:
        """What a person calls it; default classes are called by their class, or main."""
        if self.tag == "default":
            return self.attributes.get("class", "main")
        return self.attributes.get("name", "")

    def find(self, tag: str) -> "list[Element]":
        """Return its children of a tag; those inside a <frame> count as its own."""
        found = []
        for child in self.children:
            if child.tag == tag:
                found.append(child)
            if child.tag == "frame":
                found.extend(child.find(tag))
        return found


class Document:
    """An MJCF text and its elements.

    Attributes:
        root: The outermost element.
        elements: All, in the order of the document.
    """

    root: Element
    elements: list[Element]

    def __init__(self, text: str) -> None:
        """Find the elements of a text.

        Raises:
            ModelSyntaxError: It is not well-formed XML, though MuJoCo may be lenient, or has more
                elements or levels of them than any cart-pole.
        """
        self._parse(text)

    @property
    def text(self) -> str:
        """The document as it is now."""
        return self._bytes.decode("utf-8")

    def set(self, element: Element, name: str, value: str) -> None:
        """Give an element an attribute; a value that is there already keeps its spelling.

        Elements stay valid: their places move along.
        """
        if element.attributes.get(name) == value:
            return
        for match in self._attributes(element):
            if match[1].decode() == name:
                quote = match[2][:1].decode()
                self._replace(*match.span(2), quote + _quoted(value, quote) + quote)
                break
        else:
            end = self._attributes_end(element)
            self._replace(end, end, f' {name}="{_quoted(value, chr(34))}"')
        element.attributes[name] = value

    def insert(self, parent: Element, tag: str) -> Element:
        """Put a new, empty element first into another, on a line of its own where there is one."""
        position = len(parent.children) and parent.children[0].start
        end = self._tag_end(parent)
        if self._bytes[end - 2 : end] == b"/>":
            self._replace(end - 2, end, f"></{parent.tag}>")
            end -= 1
        space = self._indentation(position) if position else ""
        self._replace(end, end, f"{space}<{tag}/>")
        self._parse(self.text)
        return next(each for each in self.elements if each.start == end + len(space))

    def content(self, element: Element) -> tuple[int, int]:
        """Return where an element's content begins and ends; before the text is edited."""
        end = self._tag_end(element)
        return (end, end) if self._bytes[end - 2 : end] == b"/>" else (end, element.closes)

    def span(self, element: Element) -> tuple[int, int]:
        """Return where an element begins and ends; before the text is edited."""
        end = self._tag_end(element)
        if self._bytes[end - 2 : end] != b"/>":
            end = self._bytes.index(b">", element.closes) + 1
        return self._bytes.rindex(b"<", 0, element.start + 1), end

    def _parse(self, text: str) -> None:
        stack: list[Element] = []
        self.elements = []
        parser = expat.ParserCreate()

        def start(tag: str, attributes: dict[str, str]) -> None:
            parent = stack[-1] if stack else None
            element = Element(tag, attributes, parent, parser.CurrentByteIndex)
            if parent is None:
                self.root = element
            else:
                parent.children.append(element)
            stack.append(element)
            self.elements.append(element)
            if len(self.elements) > MOST_ELEMENTS or len(stack) > DEEPEST:
                raise ModelSyntaxError(
                    f"it has more than {MOST_ELEMENTS} elements, or more than {DEEPEST} levels of "
                    "them; a cart-pole needs a few dozen"
                )

        def end(_: str) -> None:
            stack.pop().closes = parser.CurrentByteIndex

        def entity(*_: object) -> None:
            raise ModelSyntaxError("it declares XML entities, which MuJoCo does not know")

        parser.StartElementHandler = start
        parser.EndElementHandler = end
        parser.EntityDeclHandler = entity
        # expat's time goes with the square of their number.
        if max(tag.count("=") for tag in text.split("<")) > MOST_ATTRIBUTES:
            raise ModelSyntaxError(f"it has an element with more than {MOST_ATTRIBUTES} attributes")
        try:
            self._bytes = text.encode("utf-8")
            parser.Parse(made_strict(text), True)
        except (expat.ExpatError, UnicodeEncodeError) as error:
            raise ModelSyntaxError(f"it is not well-formed XML: {error}") from error

    def _attributes(self, element: Element) -> Iterator[re.Match[bytes]]:
        position = element.start + 1 + len(element.tag.encode())
        while match := _ATTRIBUTE.match(self._bytes, position):
            yield match
            position = match.end()

    def _attributes_end(self, element: Element) -> int:
        ends = [match.end() for match in self._attributes(element)]
        return ends[-1] if ends else element.start + 1 + len(element.tag.encode())

    def _tag_end(self, element: Element) -> int:
        return self._bytes.index(b">", self._attributes_end(element)) + 1

    def _indentation(self, position: int) -> str:
        """Return the line break and the spaces before a place; "" if something else is there."""
        before = self._bytes[:position].decode("utf-8")
        match = re.search(r"\r?\n[ \t]*$", before)
        return match[0] if match else ""

    def _replace(self, start: int, end: int, text: str) -> None:
        new = text.encode("utf-8")
        self._bytes = self._bytes[:start] + new + self._bytes[end:]
        moved = len(new) - (end - start)
        for element in reversed(self.elements):
            if element.start < end:
                break
            element.start += moved


def made_strict(text: str) -> str:
    """Return the text as strict parsers take it: what matters stays in place, byte by byte.

    MuJoCo is lenient: it takes comments with "--" in them, and tags with spaces before their name.

    Raises:
        UnicodeEncodeError: It holds half a character.
    """

    def blank(found: re.Match[bytes]) -> bytes:
        return b"<!--" + found[1].translate(_BLANK) + b"-->"

    without_comments = _COMMENT.sub(blank, text.encode("utf-8"))
    return _SPACED_TAG.sub(rb"\1<", without_comments).decode("utf-8")


def _quoted(value: str, quote: str) -> str:
    return escape(value, {quote: "&quot;" if quote == '"' else "&apos;"})
