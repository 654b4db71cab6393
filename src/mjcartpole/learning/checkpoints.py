"""A training's state on disk, so that it can be killed at any moment and continued.

A checkpoint is one line, then an npz archive of numbers:

    mjcartpole checkpoint 1 <sha256 of the archive>

Every byte counts: a file that is cut off or altered is refused. It holds no code, and numpy's
pickling is switched off, so reading it runs none.

A run keeps the last two. Each is written beside its place and moved there, so that a kill, or a
disk that is full, leaves the ones before.
"""

import dataclasses
import functools
import hashlib
import io
import json
import os
import shutil
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
import numpy.typing as npt

from mjcartpole.errors import CheckpointError
from mjcartpole.files import atomic_write, brief, names_in, opened, sync
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.episodes import ENDINGS, Columns
from mjcartpole.learning.stored import Fields, checked, parse
from mjcartpole.learning.training import Snapshot
from mjcartpole.task import N_ACTIONS

LATEST, PREVIOUS = "checkpoint.bin", "checkpoint-previous.bin"

_HEAD: Final = b"mjcartpole checkpoint 1 "
_LINE_LENGTH: Final = len(_HEAD) + 64 + 1
_NOT_UNDERSTOOD: Final = (
    ArithmeticError,
    EOFError,
    LookupError,
    NotImplementedError,
    OSError,
    RecursionError,
    RuntimeError,
    TypeError,
    ValueError,
    zipfile.BadZipFile,
)
"""What reading an archive that somebody else put together may raise."""

_FRAME: Final = 2**20
"""Bytes of a checkpoint beside its table and its columns, and more than enough."""
_EPISODE_BYTES: Final = 13

_GENERATOR: Final[Fields] = {
    "bit_generator": Literal["PCG64"],
    "state": {"state": int, "inc": int},
    "has_uint32": int,
    "uinteger": int,
}
_ABOUT: Final[Fields] = {
    "config": TrainConfig.fields(),
    "model": str,
    "env_rng": _GENERATOR,
    "learner_rng": _GENERATOR,
    "seconds": float,
}


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """A snapshot, and of what.

    Attributes:
        config: The config of the training.
        model: Checksum of the model's document (see `checksum`).
        snapshot: Its state.
    """

    config: TrainConfig
    model: str
    snapshot: Snapshot

    @property
    def episodes(self) -> int:
        """Episodes that were finished."""
        return len(self.snapshot.columns.totals)


def checksum(document: str) -> str:
    """What a checkpoint remembers of a model's document."""
    return hashlib.sha256(document.encode()).hexdigest()


def save_checkpoint(folder: Path, checkpoint: Checkpoint) -> None:
    """Make this the latest checkpoint of a run; the latest so far becomes the previous one.

    Raises:
        FileError: The folder cannot be written, or the disk is full; the others stay.
    """
    latest, previous = folder / LATEST, folder / PREVIOUS
    content = _pack(checkpoint)
    with atomic_write(latest) as temporary:
        temporary.write_bytes(content)
        sync(temporary)
        # Killed right here, a training goes on from the previous one, which is as good.
        if os.path.lexists(latest):
            latest.replace(previous)


def load_checkpoint(
    path: Path, config: TrainConfig, document: str, *, poles: int = 1
) -> Checkpoint:
    """Read a checkpoint of a training.

    Args:
        path: The file.
        config: The config that it must be of.
        document: The model that it must be of.
        poles: How many that has.

    Raises:
        CheckpointError: It is not there, damaged, or of another training.
    """
    n_states = config.discretizer(poles).n_states
    most = n_states * N_ACTIONS * 8 + config.episodes * _EPISODE_BYTES + _FRAME
    with opened(path, most, refusal=CheckpointError) as file:
        if not (line := file.readline(_LINE_LENGTH)).startswith(_HEAD):
            raise CheckpointError(f"'{path}' is no checkpoint of this version of mjcartpole")
        if line != _line(hashlib.file_digest(file, "sha256").hexdigest()):
            raise CheckpointError(
                f"'{path}' is cut off or was altered: its checksum does not match"
            )
        try:
            with zipfile.ZipFile(file) as archive:
                about = checked(parse(_array(archive, "about", np.uint8, _FRAME).tobytes()), _ABOUT)
                its, model = TrainConfig(**about["config"]), about["model"]
                _check_same(path, its, model, config, document)
                return Checkpoint(its, model, _snapshot(archive, about, its, n_states))
        except _NOT_UNDERSTOOD as error:
            reason = brief(error) or type(error).__name__
            raise CheckpointError(f"'{path}' cannot be understood: {reason}") from error


def choose_checkpoint(
    folder: Path, path: Path, config: TrainConfig, document: str, *, poles: int
) -> Checkpoint | None:
    """Where a training goes on: at its latest checkpoint, or the one that was asked for.

    Args:
        folder: The run folder.
        path: The same, or a checkpoint in it.
        config: See `load_checkpoint`, here and below.
        document: The model.
        poles: How many that has.

    Returns:
        None where there is none.

    Raises:
        CheckpointError: It is damaged; the message offers the previous one, if that is good.
    """
    latest, previous, content = folder / LATEST, folder / PREVIOUS, names_in(folder)
    load = functools.partial(load_checkpoint, config=config, document=document, poles=poles)
    if path != folder:
        return load(path)
    if LATEST not in content:
        # Nothing was saved yet, or it was killed between two moves (see save_checkpoint).
        return load(previous) if PREVIOUS in content else None
    try:
        return load(latest)
    except CheckpointError as error:
        try:
            older = load(previous)
        except CheckpointError:
            hint = "there is no good one before it; start again with --overwrite"
        else:
            hint = (
                f"the one before it, after {older.episodes:,} episodes, is good: "
                f"mjcartpole train --resume {previous}"
            )
        raise CheckpointError(f"{error}; {hint}") from error


def keep_only(folder: Path, path: Path) -> None:
    """Make a good checkpoint of a run its latest one, in place of one that is damaged.

    Raises:
        FileError: The folder cannot be written.
    """
    if path.absolute() != (folder / LATEST).absolute():
        with atomic_write(folder / LATEST) as temporary:
            shutil.copyfile(path, temporary, follow_symlinks=False)


def _check_same(
    path: Path, its_config: TrainConfig, its_model: str, config: TrainConfig, document: str
) -> None:
    ours, its = dataclasses.asdict(config), dataclasses.asdict(its_config)
    other = [
        f"{name} {its[name]!r}, not {ours[name]!r}" for name in ours if ours[name] != its[name]
    ]
    if other:
        raise CheckpointError(f"'{path}' is of another training: {'; '.join(other)[:300]}")
    if its_model != checksum(document):
        raise CheckpointError(f"'{path}' is of another model than the one that lies beside it")


def _line(digest: str) -> bytes:
    return _HEAD + digest.encode() + b"\n"


def _pack(checkpoint: Checkpoint) -> bytes:
    snapshot = checkpoint.snapshot
    about = {
        "config": dataclasses.asdict(checkpoint.config),
        "model": checkpoint.model,
        "env_rng": snapshot.env_rng,
        "learner_rng": snapshot.learner_rng,
        "seconds": snapshot.seconds,
    }
    archive = io.BytesIO()
    np.savez(
        archive,
        about=np.frombuffer(json.dumps(about).encode(), np.uint8),
        q_table=snapshot.q_table,
        **snapshot.columns._asdict(),
    )
    content = archive.getvalue()
    return _line(hashlib.sha256(content).hexdigest()) + content


def _snapshot(
    archive: zipfile.ZipFile, about: dict[str, Any], config: TrainConfig, n_states: int
) -> Snapshot:
    columns = Columns(
        _array(archive, "totals", np.float64, config.episodes),
        _array(archive, "steps", np.int32, config.episodes),
        _array(archive, "endings", np.int8, config.episodes),
    )
    table = _array(archive, "q_table", np.float64, n_states, N_ACTIONS)
    seconds = float(about["seconds"])
    snapshot = Snapshot(table, about["env_rng"], about["learner_rng"], columns, seconds)
    _check_snapshot(snapshot, n_states)
    return snapshot


def _array(
    archive: zipfile.ZipFile, name: str, kind: npt.DTypeLike, most: int, *others: int
) -> npt.NDArray[Any]:
    """An array of an archive, of shape (at most `most`, *others).

    What it claims to be is looked at before any memory is taken for it.
    """
    if archive.getinfo(f"{name}.npy").compress_type != zipfile.ZIP_STORED:
        raise ValueError(f"{name} is compressed")
    with archive.open(f"{name}.npy") as member:
        np.lib.format.read_magic(member)
        shape, in_columns, found = np.lib.format.read_array_header_1_0(member)
        if found != kind or in_columns or len(shape) != 1 + len(others) or shape[1:] != others:
            raise ValueError(f"{name} is of {found} with shape {shape}")
        if not 0 <= shape[0] <= most:
            raise ValueError(f"{name} has {shape[0]} rows, and the training no more than {most}")
        size = int(np.prod(shape)) * found.itemsize
        content = member.read(size + 1)
    if len(content) != size:
        raise ValueError(f"{name} is not as long as it says")
    return np.frombuffer(content, kind).reshape(shape)


def _check_snapshot(snapshot: Snapshot, n_states: int) -> None:
    """Refuse numbers that no training can have come to.

    Raises:
        ValueError: See above.
    """
    table, (totals, steps, endings) = snapshot.q_table, snapshot.columns
    if len(table) != n_states or not np.isfinite(table).all():
        raise ValueError(f"a table with {len(table)} rows, or values that are not finite")
    if not len(totals) == len(steps) == len(endings):
        raise ValueError("columns of episodes that do not fit together")
    if not (np.isfinite(totals).all() and (steps > 0).all()):
        raise ValueError("episodes without steps, or without a return")
    if not np.isin(endings, range(len(ENDINGS))).all() or snapshot.seconds < 0:
        raise ValueError("episodes that the training does not have")
    states: tuple[Any, Any] = (snapshot.env_rng, snapshot.learner_rng)
    for state in states:
        np.random.PCG64().state = state
