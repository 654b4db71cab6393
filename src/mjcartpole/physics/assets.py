"""The files that a document needs beside it: meshes, height fields, skins, textures, other models.

MuJoCo joins a file's name to `meshdir` or `texturedir` of <compiler>, and that to the folder of the
main file. In an included file a name that leads nowhere from there is sought beside that file; an
attached model is sought beside the file that names it. Here these folders are written into the
document as absolute paths, so that it compiles to the same model wherever the program runs.
"""

import os
import stat
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

from mjcartpole.errors import ModelError, ModelNotFoundError
from mjcartpole.physics.document import Document

MODEL: Final = "model"

_SIDES: Final = ("right", "left", "up", "down", "front", "back")

_FILES: Final = {
    "mesh": ("file",),
    "hfield": ("file",),
    "skin": ("file",),
    "flexcomp": ("file",),
    "texture": ("file", *(f"file{side}" for side in _SIDES)),
    MODEL: ("file",),
}
"""Elements that name files, and the attributes that do."""


@dataclass(frozen=True)
class Asset:
    """A file that an element names.

    Attributes:
        tag: The element's tag.
        place: Which element of the document it is, counted from the root.
        attribute: The attribute that names the file.
        name: The file's name as it is written there.
        path: Where MuJoCo finds it, absolute.
        tried: All paths that MuJoCo may open for it.
        folder: The attribute of <compiler> that gives its folder; "" if none does.
        moved: Whether the folder that <compiler> gives does not lead to it.
    """

    tag: str
    place: int
    attribute: str
    name: str
    path: Path
    tried: tuple[Path, ...]
    folder: str
    moved: bool

    @property
    def absolute(self) -> bool:
        """Whether its name is a whole path as it is written."""
        return _plain(self.name).is_absolute()


@dataclass(frozen=True)
class Folders:
    """Where MuJoCo looks for files.

    Attributes:
        main: The main file's folder, absolute.
        given: The folders of meshes and of textures, absolute, by their attribute of <compiler>.
        sought: By tag, where a name of an included file is tried first, absolute.
        strip: Whether only the last part of a name counts.
    """

    main: Path
    given: Mapping[str, Path]
    sought: Mapping[str, Path]
    strip: bool


def folders_of(root: ElementTree.Element, main: Path) -> Folders:
    """Where MuJoCo looks for the files of a document.

    Args:
        root: Its outermost element, includes put in their place.
        main: The main file's folder, absolute.
    """
    compilers = [compiler.attrib for compiler in root.iter("compiler")]
    last = {name: value for attributes in compilers for name, value in attributes.items()}
    both = last.get("assetdir", "")
    sought = {
        "mesh": last.get("meshdir") or both,
        "texture": last.get("texturedir") or both,
        "hfield": both,
        "skin": both,
        "flexcomp": "",
    }
    return Folders(
        main,
        {each: _join(main, _given(compilers, each)) for each in ("meshdir", "texturedir")},
        {MODEL: Path.cwd()} | {tag: _join(main, folder) for tag, folder in sought.items()},
        any(attributes.get("strippath") == "true" for attributes in compilers),
    )


def _given(compilers: list[dict[str, str]], name: str) -> str:
    """The folder that several <compiler> give together: a later one has the last word."""
    folder = ""
    for attributes in compilers:
        folder = attributes.get(name, attributes.get("assetdir", folder))
    return folder


def find_assets(
    root: ElementTree.Element, folders: Folders, origins: Mapping[ElementTree.Element, Path]
) -> list[Asset]:
    """All files that a document names, but for its includes.

    Args:
        root: Its outermost element, includes put in their place.
        folders: Where MuJoCo looks for them.
        origins: The absolute folder of the file that an element was included from.
    """
    elements = [element for element in root.iter() if isinstance(element.tag, str)]
    return [
        _asset(element, place, attribute, folders, origins.get(element))
        for place, element in enumerate(elements)
        for attribute in _FILES.get(element.tag, ())
        if element.get(attribute)
    ]


def check_files(assets: list[Asset], name: str) -> None:
    """Refuse what is there but is no plain file: MuJoCo would read it for ever, or wait for ever.

    A file that is missing is MuJoCo's to refuse.

    Raises:
        ModelNotFoundError: It is a folder, a pipe or a device.
    """
    for asset in assets:
        for path in asset.tried:
            if kind := what_else(path):
                raise ModelNotFoundError(
                    f"'{asset.name}', which {name} names as the file of a <{asset.tag}>, cannot be "
                    f"read: '{path}' is {kind}"
                )


def what_else(path: Path) -> str:
    """What is there in place of a regular file, in words; "" if it is one, or nothing is there."""
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError):
        return ""
    if stat.S_ISREG(mode):
        return ""
    return "a folder" if stat.S_ISDIR(mode) else "no regular file"


def with_absolute_paths(text: str, assets: list[Asset], folders: Folders) -> str:
    """A document that leads to its files from anywhere; without such files, as it was.

    Args:
        text: A document without includes.
        assets: The files that it names.
        folders: Where MuJoCo looks for them.

    Raises:
        ModelSyntaxError: The text cannot be edited.
        ModelError: A folder's name cannot be written as text.
    """
    if not assets:
        return text
    document = Document(text)
    try:
        _write_paths(document, assets, folders)
    except UnicodeEncodeError as error:
        raise ModelError(
            f"the files of a model in the folder {str(folders.main)!r} cannot be named in its "
            "document, since that name is not UTF-8; rename the folder"
        ) from error
    return document.text


def _write_paths(document: Document, assets: list[Asset], folders: Folders) -> None:
    elements = list(document.root.walk())
    for asset in assets:
        if asset.moved:
            document.set(elements[asset.place], asset.attribute, str(asset.path))
    needed = {
        asset.folder
        for asset in assets
        if asset.folder and (folders.strip or not (asset.moved or asset.absolute))
    }
    if needed:
        # The last <compiler> has the last word, and its meshdir the word over its assetdir.
        found = [child for child in document.root.children if child.tag == "compiler"]
        compiler = found[-1] if found else document.insert(document.root, "compiler")
        for each in sorted(needed):
            document.set(compiler, each, str(folders.given[each]))


def _asset(
    element: ElementTree.Element,
    place: int,
    attribute: str,
    folders: Folders,
    origin: Path | None,
) -> Asset:
    name = element.get(attribute, "")
    model = element.tag == MODEL
    attribute_of_folder = "texturedir" if element.tag == "texture" else "meshdir"
    folder = folders.main if model else folders.given[attribute_of_folder]
    path = usual = _join(folder, name)
    tried = [usual, folder / usual.name]
    if origin is not None:
        first, beside = _join(folders.sought[element.tag], name), _join(origin, name)
        tried += [first, beside]
        path = usual if _is_there(first) else beside
    return Asset(
        element.tag,
        place,
        attribute,
        name,
        path,
        tuple(tried),
        "" if model else attribute_of_folder,
        moved=path != usual or (model and not _plain(name).is_absolute()),
    )


def _is_there(path: Path) -> bool:
    try:
        path.stat()
    except (OSError, ValueError):
        return False
    return True


def _join(folder: Path, name: str) -> Path:
    """A path as MuJoCo joins it: ".." takes away the folder before it, whatever links there are."""
    return Path(os.path.normpath(folder / _plain(name)))


def _plain(name: str) -> Path:
    """MuJoCo takes both slashes on every system."""
    return Path(name.replace("\\", "/"))
