"""A training's state on disk, so that it can be killed at any moment and continued.

A checkpoint is one line, then an npz archive of numbers:

    mjcartpole checkpoint 1 <sha256 of the archive>

Every byte counts: a file that is cut off or altered is refused. It holds no code, and numpy's
pickling is switched off, so reading it runs none.

A run keeps the last two. Each is written beside its place and moved there, so that a kill, or a
disk that is full, leaves the ones before.
"""

import dataclasses
import hashlib
import io
import json
import os
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from mjcartpole.errors import CheckpointError, FileError
from mjcartpole.files import replacing
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.episodes import Columns
from mjcartpole.learning.training import Snapshot

LATEST, PREVIOUS = "checkpoint.bin", "checkpoint-previous.bin"

_HEAD: Final = b"mjcartpole checkpoint 1 "
_DIGEST_LENGTH: Final = 64


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
    with replacing(latest) as temporary:
        temporary.write_bytes(content)
        if latest.exists():
            _link(latest, previous)


def load_checkpoint(path: Path, config: TrainConfig, document: str) -> Checkpoint:
    """Read a checkpoint of a training.

    Args:
        path: The file.
        config: The config that it must be of.
        document: The model that it must be of.

    Raises:
        CheckpointError: It is not there, damaged, or of another training.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise CheckpointError(f"'{path}' cannot be read: {error.strerror}") from error
    if not content.startswith(_HEAD):
        raise CheckpointError(f"'{path}' is no checkpoint of this version of mjcartpole")
    start = len(_HEAD) + _DIGEST_LENGTH + 1
    archive = content[start:]
    if content[:start] != _line(archive):
        raise CheckpointError(f"'{path}' is cut off or was altered: its checksum does not match")
    try:
        checkpoint = _unpack(archive)
    except (KeyError, TypeError, ValueError, zipfile.BadZipFile) as error:
        raise CheckpointError(f"'{path}' cannot be understood: {error}") from error
    _check_same(path, checkpoint, config, document)
    return checkpoint


def keep_only(folder: Path, path: Path) -> None:
    """Make a good checkpoint of a run its latest one, in place of one that is damaged.

    Raises:
        FileError: The folder cannot be written.
    """
    if path.absolute() != (folder / LATEST).absolute():
        _link(path, folder / LATEST)


def _check_same(path: Path, checkpoint: Checkpoint, config: TrainConfig, document: str) -> None:
    ours, its = dataclasses.asdict(config), dataclasses.asdict(checkpoint.config)
    other = [
        f"{name} {its[name]!r}, not {ours[name]!r}" for name in ours if ours[name] != its[name]
    ]
    if other:
        raise CheckpointError(f"'{path}' is of another training: {'; '.join(other)}")
    if checkpoint.model != checksum(document):
        raise CheckpointError(f"'{path}' is of another model than the one that lies beside it")


def _line(archive: bytes) -> bytes:
    return _HEAD + hashlib.sha256(archive).hexdigest().encode() + b"\n"


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
    return _line(content) + content


def _unpack(content: bytes) -> Checkpoint:
    with np.load(io.BytesIO(content), allow_pickle=False) as archive:
        about: dict[str, Any] = json.loads(archive["about"].tobytes())
        snapshot = Snapshot(
            q_table=archive["q_table"],
            env_rng=about["env_rng"],
            learner_rng=about["learner_rng"],
            columns=Columns(archive["totals"], archive["steps"], archive["endings"]),
            seconds=about["seconds"],
        )
    return Checkpoint(TrainConfig(**about["config"]), about["model"], snapshot)


def _link(existing: Path, name: Path) -> None:
    """Give a file a second name, which then takes the place of whatever had it."""
    try:
        with replacing(name) as temporary:
            temporary.unlink()
            os.link(existing, temporary)
    except FileError:
        # A file system without hard links: a copy does.
        with replacing(name) as temporary:
            temporary.write_bytes(existing.read_bytes())
