"""Assets: the files that a document names, meshes, height fields, skins, textures, other models.

MuJoCo joins a file's name to `meshdir` or `texturedir` of <compiler>, and that to the folder of the
main file. In an included file a name that leads nowhere from there is sought beside that file; an
attached model is sought beside the file that names it. `strippath` of the main file counts for all.
"""

import hashlib
import io
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from mjcartpole.errors import ModelError, ModelNotFoundError
from mjcartpole.files import is_file, is_folder, is_there
from mjcartpole.physics.edit.document import Document, Element

MODEL: Final = "model"

_FOLDERS: Final = {"assetdir", "meshdir", "texturedir"}

_NAMED_BY_FILE: Final = ("mesh", "hfield", "skin", "texture")
"""Elements that are called by their file where they have no name."""

_STORED: Final = re.compile(r"asset-[0-9a-f]{32}(\.\w{1,10})?")


@dataclass(frozen=True)
class Asset:
    """A file that an attribute of an element names.

    Attributes:
        element: The element.
        attribute: The attribute.
        path: Where MuJoCo finds it, absolute.
        tried: All paths that MuJoCo may open for it.
    """

    element: Element
    attribute: str
    path: Path
    tried: tuple[Path, ...]

    @property
    def name(self) -> str:
        """The file's name as it is written."""
        return self.element.attributes[self.attribute]


@dataclass(frozen=True)
class Folders:
    """Where MuJoCo looks for files.

    Attributes:
        main: The main file's folder, absolute.
        inside: Folders in which all files must lie; None: anywhere.
        strip: Whether only the last part of a name counts.
    """

    main: Path
    inside: tuple[Path, ...] | None
    strip: bool = False

    def check(self, path: Path, called: str) -> None:
        """Refuse what lies outside, and what is no regular file: MuJoCo might read it for ever.

        A file that is missing is MuJoCo's to refuse. `called` is what names it, in words.

        Raises:
            ModelNotFoundError: It is a folder, a pipe or a device, or may not be read.
        """
        if self.inside is not None:
            real = Path(os.path.realpath(path))
            if not any(real.is_relative_to(os.path.realpath(root)) for root in self.inside):
                raise ModelNotFoundError(
                    f"{called} is not read: '{path}' lies outside the run's folder; if you trust "
                    f"this run, allow it with --allow-assets {real.parent} (allow_assets=…)"
                )
        check_kind(path, called)


def check_kind(path: Path, called: str) -> None:
    """Refuse what is there in place of a regular file."""
    if not is_file(path) and is_there(path):
        kind = "a folder" if is_folder(path) else "no regular file"
        raise ModelNotFoundError(f"{called} cannot be read: '{path}' is {kind}")


def find_assets(
    document: Document, folders: Folders, origins: Sequence[Path | None]
) -> list[Asset]:
    """Return all files that a document, includes put in their place, names.

    `origins` has for each element the absolute folder of the file that it was included from, None
    where it is the main file's own.
    """
    compilers = [each.attributes for each in _compilers(document)]
    assets = []
    for element, origin in zip(document.elements, origins, strict=True):
        for attribute, name in element.attributes.items():
            if attribute.startswith("file") and name and element.tag != "include":
                paths = _paths(element.tag, name, folders, compilers, origin)
                assets.append(Asset(element, attribute, *paths))
    return assets


def _paths(
    tag: str, name: str, folders: Folders, compilers: list[dict[str, str]], origin: Path | None
) -> tuple[Path, tuple[Path, ...]]:
    """Return where MuJoCo finds a file that an element of a tag names, and all that it tries."""
    given = ""
    if tag != MODEL:
        name = re.split(r"[/\\]", name)[-1] if folders.strip else name
        given = _given(compilers, "texturedir" if tag == "texture" else "meshdir")
    usual = _join(folders.main / _plain(given), name)
    if origin is None:
        return usual, (usual,)
    first, beside = _join(_sought(tag, folders.main, compilers), name), _join(origin, name)
    return usual if is_there(first) else beside, (usual, first, beside)


def strips(document: Document) -> bool:
    """Return whether only the last part of a file's name counts, in attached models as well."""
    return any(each.attributes.get("strippath") == "true" for each in _compilers(document))


def write_paths(document: Document, assets: list[Asset], folders: Folders) -> None:
    """Have a document lead to its files from anywhere; without such files it stays as it was.

    Raises:
        ModelError: A folder's name cannot be written as text.
    """
    try:
        # Where names are stripped, of attached models' files too, folders lead to them.
        for asset in reversed(assets):
            if asset.element.tag == MODEL or not folders.strip:
                document.set(asset.element, asset.attribute, str(asset.path))
        if assets:
            _set_folders(document, folders)
    except UnicodeEncodeError as error:
        raise ModelError(
            f"the files of a model in the folder {str(folders.main)!r} cannot be named in its "
            "document, since that name is not UTF-8; rename the folder"
        ) from error


def store_names(document: Document, assets: list[Asset], names: Mapping[Path, str]) -> None:
    """Name files otherwise; elements that were called by their file keep that name."""
    for asset in reversed(assets):
        element = asset.element
        if asset.attribute == "file" and element.tag in _NAMED_BY_FILE and not element.name:
            document.set(element, "name", asset.path.stem)
        document.set(element, asset.attribute, names[asset.path])
    if assets:
        _set_folders(document, None)


def _set_folders(document: Document, folders: Folders | None) -> None:
    compilers = _compilers(document)
    given = [each.attributes.copy() for each in compilers]
    for compiler in compilers:
        for name in compiler.attributes.keys() & _FOLDERS:
            document.set(compiler, name, "")
    if folders is not None and folders.strip:
        for name in ("meshdir", "texturedir"):
            document.set(compilers[-1], name, str(_join(folders.main, _given(given, name))))


def _compilers(document: Document) -> list[Element]:
    return [each for each in document.elements if each.tag == "compiler"]


def name_by_content(path: Path, content: str | None = None) -> str:
    """Return what a file is called in a run, by what is stored: itself, or a text in its place.

    Raises:
        ModelNotFoundError: It cannot be read.
    """
    try:
        with path.open("rb") if content is None else io.BytesIO(content.encode()) as file:
            digest = hashlib.file_digest(file, "sha256")
    except OSError as error:
        raise ModelNotFoundError(f"a file of the model cannot be read: {error}") from error
    name = f"asset-{digest.hexdigest()[:32]}"
    return name + path.suffix if is_stored(name + path.suffix) else name


def is_stored(name: str) -> bool:
    """Return whether a file's name is one that `name_by_content` gives."""
    return _STORED.fullmatch(name) is not None


def _given(compilers: list[dict[str, str]], name: str) -> str:
    """Return the folder that several <compiler> give together: the last word counts."""
    folder = ""
    for attributes in compilers:
        folder = attributes.get(name, attributes.get("assetdir", folder))
    return folder


def _sought(tag: str, main: Path, compilers: list[dict[str, str]]) -> Path:
    """Return where a name of an included file is tried first."""
    if tag == MODEL:
        return Path.cwd()
    last = {name: value for attributes in compilers for name, value in attributes.items()}
    kind = {"mesh": "meshdir", "texture": "texturedir"}.get(tag, "")
    folder = "" if tag == "flexcomp" else last.get(kind, "") or last.get("assetdir", "")
    return main / _plain(folder)


def _join(folder: Path, name: str) -> Path:
    """Join a path as MuJoCo does: ".." takes away the folder before it, be that a link."""
    return Path(os.path.normpath(folder / _plain(name)))


def _plain(name: str) -> Path:
    """Return a name as a path; MuJoCo takes both slashes on every system."""
    return Path(name.replace("\\", "/"))
