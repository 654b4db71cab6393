"""Includes: an MJCF read whole, they in their place and other files by absolute names.

MuJoCo reads `<include>` relative to the folder of the main file or of the file that includes, and
each file once. How much memory and time a document takes is found out by a trial (see guard.py);
here it is only seen to that reading it is no danger.
"""

import os
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

from mjcartpole.errors import ModelError, ModelNotFoundError, ModelSyntaxError
from mjcartpole.files import is_there
from mjcartpole.physics.assets import (
    MODEL,
    Asset,
    Folders,
    check_kind,
    find_assets,
    name_by_content,
    store_names,
    strips,
    write_paths,
)
from mjcartpole.physics.edit.document import Document, Element
from mjcartpole.physics.library import invalid

LARGEST_FILE: Final = 2**24
"""Bytes of a document, with all that it includes and attaches."""

MOST_FILES: Final = 50
"""Documents that one includes and attaches."""


def read_text(path: Path, name: str = "", most: int = LARGEST_FILE) -> str:
    """Return the text of a file, called by a name, of so many bytes at most.

    Raises:
        ModelNotFoundError: It cannot be read, or is no regular file.
        ModelSyntaxError: It is too large to be a document, or not text in UTF-8.
    """
    name = name or f"model file '{path}'"
    check_kind(path, name)
    try:
        with path.open("rb") as file:
            content, size = file.read(most + 1), os.fstat(file.fileno()).st_size
    except (OSError, ValueError) as error:
        raise ModelNotFoundError(f"{name} cannot be read: {error}") from error
    if len(content) > most:
        raise ModelSyntaxError(
            f"{name} has {max(size, len(content))} bytes; an MJCF is XML of some kilobytes, "
            f"and no more than {LARGEST_FILE} bytes are read of it and all that it includes"
        )
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ModelSyntaxError(
            f"{name} is not text in UTF-8 (byte {error.start} does not fit); save it as UTF-8"
        ) from error


def read_whole(
    text: str, name: str, folder: Path, inside: Sequence[Path] | None = None
) -> Document:
    """Return a document with its includes in their place and absolute names of its other files.

    Without includes and other files it stays as it was written, to the last character. All of
    these must lie inside of some folders, or may lie anywhere if `inside` is None.

    Raises:
        ModelNotFoundError: A file that it includes or attaches cannot be read, or lies outside.
        ModelSyntaxError: It is no XML, no MJCF, includes a file twice or has too many elements.
    """
    folders = Folders(folder.resolve(), None if inside is None else tuple(inside))
    reader = _Reader(folders, LARGEST_FILE - len(text))
    document, assets = reader.read(text, name)
    _check_models(reader, assets, name, set())
    write_paths(document, assets, reader.folders)
    return document


def portable(text: str) -> tuple[str, dict[str, Path | str]]:
    """Return a document that names its files by their content, without any folder, and these files.

    They are given by name: where each is, or its text if it is a document itself.

    Raises:
        ModelError: A file cannot be read.
    """
    reader = _Reader(Folders(Path.cwd(), None))
    document, assets = reader.read(text, "the document")
    files: dict[str, Path | str] = {}
    _store(reader, document, assets, files)
    return document.text, files


@dataclass
class _Reader:
    """Reads a document and what belongs to it.

    Attributes:
        folders: Where its files are.
        left: Bytes that may still be read.
        included: The real paths of the files that it includes.
    """

    folders: Folders
    left: int = LARGEST_FILE
    included: set[str] = field(default_factory=set)

    def read(self, text: str, name: str) -> tuple[Document, list[Asset]]:
        """Return a document with its includes in their place, and the files that it names."""
        document = _parse(text, name)
        whole, origins = self._flat(document, name, None)
        if whole != text:
            document = _parse(whole, name)
        root = document.root.tag
        if root != "mujoco":
            urdf = " (a URDF; MuJoCo can save it as MJCF)" if root == "robot" else ""
            raise invalid(name, f"its outermost element is <{root}>{urdf}, not <mujoco>")
        self.folders = replace(self.folders, strip=self.folders.strip or strips(document))
        assets = find_assets(document, self.folders, origins)
        for asset in assets:
            called = f"'{asset.name}', which {name} names as the file of a <{asset.element.tag}>,"
            for path in asset.tried:
                self.folders.check(path, called)
        return document, assets

    def attached(self, asset: Asset, name: str) -> tuple[Document, list[Asset]]:
        """Return a model that a document attaches, and the files that it names in turn."""
        who = f"'{asset.name}', which {name} attaches,"
        text = self._text(asset.path, who)
        reader = _Reader(replace(self.folders, main=asset.path.parent), self.left)
        found = reader.read(text, who)
        self.left = reader.left
        return found

    def _flat(
        self, document: Document, name: str, origin: Path | None
    ) -> tuple[str, list[Path | None]]:
        """Return a document's text, or an included one's content, and its elements' origins."""
        content = document.text.encode()
        start, end = (0, len(content)) if origin is None else document.content(document.root)
        pieces: list[bytes] = []
        origins: list[Path | None] = []
        for element in document.elements:
            if element.start < start:
                continue  # The root of an included file, or what an <include> holds.
            if element.tag != "include":
                origins.append(origin)
                continue
            inner, theirs = self._included(element, name, origin)
            first, last = document.span(element)
            pieces += [content[start:first], inner.encode()]
            origins += theirs
            start = last
        return b"".join([*pieces, content[start:end]]).decode(), origins

    def _included(
        self, include: Element, name: str, origin: Path | None
    ) -> tuple[str, list[Path | None]]:
        """Return an included file's content: it lies beside the main file, else the includer."""
        file = include.attributes.get("file", "")
        if not file:
            raise ModelNotFoundError(
                f"{name} cannot be read whole: an <include> of it names no file; "
                'write <include file="..."/>'
            )
        path, beside = (
            folder / file.replace("\\", "/")
            for folder in (self.folders.main, origin or self.folders.main)
        )
        if is_there(beside) and not is_there(path):
            path = beside
        if (real := os.path.realpath(path)) in self.included:
            raise invalid(name, f"it includes '{file}' more than once, or in a circle")
        self.included.add(real)
        who = f"'{file}', which {name} includes,"
        self.folders.check(path, who)
        included = _parse(self._text(path, who), f"'{file}'")
        return self._flat(included, f"'{file}'", path.parent)

    def _text(self, path: Path, who: str) -> str:
        if self.left <= 0:
            raise ModelError(
                f"{who} is one document too many: {MOST_FILES} at most, of {LARGEST_FILE} bytes "
                "together, are included and attached"
            )
        text = read_text(path, who, self.left)
        self.left -= len(text) + LARGEST_FILE // MOST_FILES
        return text


def _check_models(reader: _Reader, assets: list[Asset], name: str, seen: set[str]) -> None:
    """Look at all models that a document attaches, and at their files, each once."""
    for asset in assets:
        real = os.path.realpath(asset.path)
        if asset.element.tag == MODEL and real not in seen:
            seen.add(real)
            _, theirs = reader.attached(asset, name)
            _check_models(reader, theirs, f"'{asset.name}'", seen)


def _store(
    reader: _Reader, document: Document, assets: list[Asset], files: dict[str, Path | str]
) -> None:
    names: dict[Path, str] = {}
    for asset in assets:
        if asset.path in names:
            continue
        content = None
        if asset.element.tag == MODEL:
            child, theirs = reader.attached(asset, "the document")
            _store(reader, child, theirs, files)
            content = child.text
        names[asset.path] = name_by_content(asset.path, content)
        files[names[asset.path]] = asset.path if content is None else content
    store_names(document, assets, names)


def _parse(text: str, name: str) -> Document:
    if not text.strip():
        raise invalid(name, "it is empty")
    if "\0" in text:
        raise invalid(name, "it holds a zero byte, so it is not text")
    try:
        return Document(text)
    except ModelSyntaxError as error:
        raise invalid(name, error) from error
