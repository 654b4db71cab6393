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
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from mjcartpole.errors import CheckpointError
from mjcartpole.files import replacing, sync
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.episodes import ENDINGS, Columns
from mjcartpole.learning.training import Snapshot
from mjcartpole.task import N_ACTIONS

LATEST, PREVIOUS = "checkpoint.bin", "checkpoint-previous.bin"

_HEAD: Final = b"mjcartpole checkpoint 1 "
_DIGEST_LENGTH: Final = 64
_NOT_UNDERSTOOD: Final = (
    ArithmeticError,
    AttributeError,
    EOFError,
    LookupError,
    MemoryError,
    NotImplementedError,
    OSError,
    RecursionError,
    TypeError,
    ValueError,
    zipfile.BadZipFile,
    zlib.error,
)
"""What reading an archive that somebody else put together may raise."""


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
        sync(temporary)
        # Killed right here, a training goes on from the previous one, which is as good.
        if latest.exists():
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
        checkpoint = _unpack(archive, poles)
    except _NOT_UNDERSTOOD as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise CheckpointError(f"'{path}' cannot be understood: {reason}") from error
    _check_same(path, checkpoint, config, document)
    return checkpoint


def keep_only(folder: Path, path: Path) -> None:
    """Make a good checkpoint of a run its latest one, in place of one that is damaged.

    Raises:
        FileError: The folder cannot be written.
    """
    if path.absolute() != (folder / LATEST).absolute():
        with replacing(folder / LATEST) as temporary:
            temporary.write_bytes(path.read_bytes())


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


def _unpack(content: bytes, poles: int) -> Checkpoint:
    with np.load(io.BytesIO(content), allow_pickle=False) as archive:
        about: dict[str, Any] = json.loads(archive["about"].tobytes())
        snapshot = Snapshot(
            q_table=archive["q_table"],
            env_rng=about["env_rng"],
            learner_rng=about["learner_rng"],
            columns=Columns(archive["totals"], archive["steps"], archive["endings"]),
            seconds=float(about["seconds"]),
        )
    config = TrainConfig(**about["config"])
    _check_snapshot(snapshot, config, poles)
    return Checkpoint(config, str(about["model"]), snapshot)


def _check_snapshot(snapshot: Snapshot, config: TrainConfig, poles: int) -> None:
    """Refuse numbers that no training with this config can have come to.

    Raises:
        ValueError: See above.
    """
    table, columns = snapshot.q_table, snapshot.columns
    n = len(columns.totals)
    expected = {"totals": np.float64, "steps": np.int32, "endings": np.int8}
    n_states = config.discretizer(poles).n_states
    if table.dtype != np.float64 or table.shape != (n_states, N_ACTIONS):
        raise ValueError(f"a table of {table.dtype} with shape {table.shape}")
    arrays: dict[str, npt.NDArray[Any]] = columns._asdict()
    if any(
        arrays[name].dtype != kind or arrays[name].shape != (n,) for name, kind in expected.items()
    ):
        raise ValueError("columns of episodes that do not fit together")
    if n > config.episodes or not np.isin(columns.endings, range(len(ENDINGS))).all():
        raise ValueError("episodes that the training does not have")
    states: tuple[Any, Any] = (snapshot.env_rng, snapshot.learner_rng)
    for state in states:
        np.random.PCG64().state = state
