"""The model in a run's folder: its document, and beside it the files that it names."""

import contextlib
import dataclasses
import shutil
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final

from mjcartpole.errors import ModelError, RunError
from mjcartpole.files import atomic_write, brief, read_bytes, remove, write_whole
from mjcartpole.learning.config import TrainConfig
from mjcartpole.physics.assets import is_stored, name_by_content
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.load import load_stored, same_model

MODEL: Final = "model.xml"

_LARGEST_MODEL: Final = 2**24
"""Bytes."""


def check_storable(cartpole: CartPole) -> None:
    """Refuse a model that is another one when it is read back from what a run stores.

    Raises:
        ModelError: It is, or a file that it needs cannot be read.
    """
    document, files = cartpole.stored
    with tempfile.TemporaryDirectory() if files else contextlib.nullcontext("") as temporary:
        if files:
            write_model(Path(temporary), cartpole)
        again = load_stored(document, cartpole.name, Path(temporary), own_timestep=True)
    if not same_model(again.model, cartpole.model):
        raise ModelError(
            f"{cartpole.name} compiles to another model when its document stands alone; "
            "make it one self-contained file"
        )


def write_model(folder: Path, cartpole: CartPole) -> None:
    """Write a model's document, and beside it the files that it names.

    Raises:
        FileError: The folder cannot be written, or a file cannot be read.
        ModelError: A file cannot be read.
    """
    document, files = cartpole.stored
    for name, source in files.items():
        if isinstance(source, str):
            write_whole(folder / name, source)
        elif not _has(folder / name):
            with atomic_write(folder / name) as temporary:
                shutil.copyfile(source, temporary)
    write_whole(folder / MODEL, document)


def _has(asset: Path) -> bool:
    """Whether a file is there whole; a model may have been loaded from this very folder."""
    return asset.is_file() and not asset.is_symlink() and name_by_content(asset) == asset.name


def remove_assets(folder: Path, keep: Iterable[str] = ()) -> None:
    """Remove the files that a model named, but for some."""
    names = {path.name for path in folder.glob("asset-*") if is_stored(path.name)}
    for name in names - set(keep):
        remove(folder / name)


def stored_model(
    document: str, config: TrainConfig, folder: Path, allow_assets: Sequence[Path] = ()
) -> CartPole:
    """The model of a run from the document that it stores, under the name that was trained on.

    The files that it names lie in the run's folder, or in `allow_assets`.

    Raises:
        ModelError: The document was damaged, or names a file elsewhere.
    """
    # Never by `load_model`, which would take some texts for a model's name or a path.
    cartpole = load_stored(
        document, f"'{folder / MODEL}'", folder, allow_assets, own_timestep=config.own_timestep
    )
    return dataclasses.replace(cartpole, name=config.model)


def read_model(folder: Path, config: TrainConfig, allow_assets: Sequence[Path] = ()) -> CartPole:
    """The model that a run folder stores; see `stored_model`.

    Raises:
        RunError: It cannot be read.
        ModelError: It was damaged, or names a file elsewhere.
    """
    return stored_model(read_document(folder), config, folder, allow_assets)


def read_document(folder: Path) -> str:
    """The document of the model that a run folder stores.

    Raises:
        RunError: It cannot be read.
    """
    content = read_bytes(folder / MODEL, _LARGEST_MODEL, refusal=RunError)
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise RunError(f"'{folder / MODEL}' cannot be read: {brief(error)}") from error
