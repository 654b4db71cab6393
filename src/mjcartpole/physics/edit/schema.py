"""Which elements and attributes MJCF has, as MuJoCo itself says."""

import functools
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import mujoco

from mjcartpole.errors import nearest

_LINE = re.compile(r"^( *)(\S+) \((.)\) +(.*)$")


@dataclass(eq=False)
class Node:
    """What an element may have.

    Attributes:
        tag: Its tag.
        single: Whether a parent has at most one of them, or several that act as one.
        attributes: Names of its attributes.
        children: What it may contain, by tag.
    """

    tag: str
    single: bool
    attributes: set[str]
    children: dict[str, "Node"] = field(default_factory=dict)

    def walk(self) -> "Iterator[Node]":
        """Return the node and all below it, each once."""
        yield self
        for child in self.children.values():
            if child is not self and child.tag not in _NESTING:
                yield from child.walk()


_MANY = ("(world)body", "default")
_NESTING = ("body", "frame", "replicate")
_ADDED: dict[str, set[str]] = {
    # MuJoCo's printed schema leaves these out (see its XML reference, body/frame and replicate).
    "frame": {"name", "childclass", "pos", "quat", "axisangle", "xyaxes", "zaxis", "euler"},
    "replicate": {"count", "euler", "sep", "offset", "childclass"},
}


@functools.cache
def schema() -> Node:
    """Return the schema's root, the element <mujoco>; parsed from MuJoCo's own print."""
    text = str(mujoco.mj_printSchema(False, True))
    root = Node("mujoco", True, set())
    stack, node = [(-1, root)], root
    for line in text.replace("\u00a0", " ").splitlines():
        match = _LINE.match(line)
        if not match:
            node.attributes.update(line.split())
            continue
        depth, tag, attributes = len(match[1]), match[2], match[4].split()
        node = root if tag == root.tag else Node(tag, False, set())
        node.attributes.update(attributes)
        while stack[-1][0] >= depth:
            stack.pop()
        parent = stack[-1][1]
        if node is not root:
            node.single = match[3] == "?" or (parent is root and tag not in _MANY)
            parent.children[tag] = node
        stack.append((depth, node))
    _make_recursive(root)
    return root


def _make_recursive(root: Node) -> None:
    default = root.children["default"]
    default.children["default"] = default
    body = root.children.pop("(world)body")
    body.tag = "body"
    root.children["worldbody"] = Node("worldbody", True, body.attributes, body.children)
    body.children["body"] = body
    for tag, attributes in _ADDED.items():
        body.children[tag] = Node(tag, False, attributes, body.children)


def tags() -> list[str]:
    """Return every tag of MJCF, sorted."""
    return sorted({node.tag for node in schema().walk()} | set(_NESTING))


def node_at(path: Iterable[str]) -> Node | None:
    """Return the node of an element by the tags from the root (which is left out) down to it."""
    node: Node | None = schema()
    for tag in path:
        node = node.children.get(tag) if node is not None else None
    return node


def attributes_of(tag: str) -> list[str]:
    """Return every attribute that an element of a tag has somewhere in MJCF, sorted."""
    nodes = [node for node in schema().walk() if node.tag == tag]
    nodes += [schema().children["worldbody"].children[tag]] if tag in _NESTING else []
    return sorted(set().union(*(node.attributes for node in nodes)))


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return the nearest of some words, or all where none is near, for the end of a message."""
    words = sorted(set(known))
    if near := nearest(word, words)[:3]:
        return "did you mean " + " or ".join(f"'{each}'" for each in near) + "?"
    shown = ", ".join(words[:40]) + (" …" if len(words) > 40 else "")
    return f"available: {shown or 'nothing'}"
