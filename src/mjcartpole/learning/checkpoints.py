"""Checkpoints: a training's state on disk, so that it can be killed at any moment and continued.

A checkpoint is one line, then an npz archive of numbers:

    mjcartpole checkpoint 1 <sha256 of the archive>

Every byte counts: a file that is cut off or altered is refused. It holds no code, and numpy's
pickling is switched off, so reading it runs none.

A run keeps one. It is written beside its place and moved there, so that a kill, or a disk that is
full, leaves the one before.
"""

import hashlib
import io
import json
import math
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
import numpy.typing as npt

from mjcartpole.errors import CheckpointError
from mjcartpole.files import atomic_write, brief, opened
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.documents import read_values
from mjcartpole.learning.episodes import ENDINGS, SIDES, Columns
from mjcartpole.learning.greedy_curve import GreedyPoint
from mjcartpole.learning.learner import Learner
from mjcartpole.learning.stored import Fields, checked, parse
from mjcartpole.learning.training import Snapshot

LATEST: Final = "checkpoint.bin"
FORMER: Final = "checkpoint-previous.bin"
"""Runs that version 0.1 began have it beside the latest one."""

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

_INSTEAD: Final = "restore it from a copy, or start again with --overwrite"

_FRAME: Final = 2**20
"""Bytes of a checkpoint beside its table and its columns, and more than enough."""
_EPISODE_BYTES: Final = 14
_POINT: Final = len(GreedyPoint._fields)
"""Numbers of one evaluation, 8 bytes each."""

_GENERATOR: Final[Fields] = {
    "bit_generator": Literal["PCG64"],
    "state": {"state": int, "inc": int},
    "has_uint32": int,
    "uinteger": int,
}
_ABOUT: Final[Fields] = {
    "config": dict,
    "model": str,
    "env_rng": _GENERATOR,
    "learner_rng": _GENERATOR,
    "chance_rng?": _GENERATOR,
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
    """Return what a checkpoint remembers of a model's document."""
    return hashlib.sha256(document.encode()).hexdigest()


def save_checkpoint(folder: Path, checkpoint: Checkpoint) -> None:
    """Make this the checkpoint of a run.

    Raises:
        FileError: The folder cannot be written, or the disk is full; the one before stays.
    """
    with atomic_write(folder / LATEST) as temporary:
        temporary.write_bytes(_pack(checkpoint))


def load_checkpoint(
    path: Path, config: TrainConfig, document: str, *, poles: int = 1
) -> Checkpoint:
    """Read a checkpoint of a training with this config, on a model with this document and poles.

    Raises:
        CheckpointError: It is not there, damaged, or of another training.
    """
    learner = Learner(config, config.discretizer(poles))
    most = sum(array.nbytes for array in learner.memory) + config.episodes * _EPISODE_BYTES + _FRAME
    most += learner.visits.nbytes + 8 * _most_numbers(config)
    with opened(path, most, refusal=CheckpointError) as file:
        if not (line := file.readline(_LINE_LENGTH)).startswith(_HEAD):
            raise CheckpointError(
                f"'{path}' is no checkpoint of this version of mjcartpole; {_INSTEAD}"
            )
        if line != _line(hashlib.file_digest(file, "sha256").hexdigest()):
            raise CheckpointError(
                f"'{path}' is cut off or was altered: its checksum does not match; {_INSTEAD}"
            )
        try:
            with zipfile.ZipFile(file) as archive:
                about = parse(_array(archive, "about", np.uint8, _FRAME).tobytes())
                its = read_values(checked(about, _ABOUT)["config"])
                _check_same(path, its, about["model"], config, document)
                return Checkpoint(its, about["model"], _snapshot(archive, about, its, learner))
        except _NOT_UNDERSTOOD as error:
            reason = brief(error) or type(error).__name__
            raise CheckpointError(f"'{path}' cannot be understood: {reason}; {_INSTEAD}") from error


def _check_same(
    path: Path, its_config: TrainConfig, its_model: str, config: TrainConfig, document: str
) -> None:
    ours, its = config.values(), its_config.values()
    other = [
        f"{name} {its.get(name)!r}, not {ours[name]!r}"
        for name in ours
        if ours[name] != its.get(name)
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
        "config": checkpoint.config.stored(),
        "model": checkpoint.model,
        "env_rng": snapshot.env_rng,
        "learner_rng": snapshot.learner_rng,
        "seconds": snapshot.seconds,
    }
    if snapshot.chance_rng is not None:
        about["chance_rng"] = snapshot.chance_rng
    archive = io.BytesIO()
    arrays: dict[str, Any] = {
        "about": np.frombuffer(json.dumps(about).encode(), np.uint8),
        **snapshot.memory,
        **snapshot.columns._asdict(),
    }
    if snapshot.evaluations:
        arrays["evaluations"] = np.array(snapshot.evaluations, np.float64).ravel()
    if snapshot.visits is not None:
        arrays["state_visits"] = snapshot.visits
    np.savez(archive, **arrays)
    content = archive.getvalue()
    return _line(hashlib.sha256(content).hexdigest()) + content


def _snapshot(
    archive: zipfile.ZipFile, about: dict[str, Any], config: TrainConfig, learner: Learner
) -> Snapshot:
    totals = _array(archive, "totals", np.float64, config.episodes)
    sides = _added(archive, "sides", np.int8, config.episodes)
    columns = Columns(
        totals,
        _array(archive, "steps", np.int32, config.episodes),
        _array(archive, "endings", np.int8, config.episodes),
        np.zeros(len(totals), np.int8) if sides is None else sides,
    )
    found = {
        name: _array(archive, name, array.dtype, array.size).reshape(array.shape)
        for name, array in learner.memory._asdict().items()
    }
    learner.check(found)
    seconds, curve = float(about["seconds"]), _evaluations(archive, config)
    visits = _added(archive, "state_visits", np.int64, learner.visits.size)
    states = about["env_rng"], about["learner_rng"]
    snapshot = Snapshot(found, *states, columns, seconds, curve, visits, about.get("chance_rng"))
    if snapshot.chance_rng is None and config.disturbances.are_some:
        raise ValueError("no generator for the disturbances of the config")
    _check_snapshot(snapshot, config.evaluation_period)
    steps, size = int(columns.steps.sum()), learner.visits.size
    if visits is not None and (visits.size != size or visits.min() < 0 or visits.sum() != steps):
        raise ValueError("visits that are not those of its episodes")
    return snapshot


def _most_numbers(config: TrainConfig) -> int:
    """Return how many numbers the evaluations of a whole training are."""
    period = config.evaluation_period
    return 0 if period is None else config.episodes // period * _POINT


def _evaluations(archive: zipfile.ZipFile, config: TrainConfig) -> tuple[GreedyPoint, ...]:
    numbers = _added(archive, "evaluations", np.float64, _most_numbers(config))
    if numbers is None:
        return ()
    return tuple(
        GreedyPoint(int(episodes), int(steps), *others)
        for episodes, steps, *others in numbers.reshape(-1, _POINT).tolist()
    )


def _added(
    archive: zipfile.ZipFile, name: str, kind: npt.DTypeLike, most: int
) -> npt.NDArray[Any] | None:
    """Return an array that some checkpoints lack."""
    return _array(archive, name, kind, most) if f"{name}.npy" in archive.namelist() else None


def _array(archive: zipfile.ZipFile, name: str, kind: npt.DTypeLike, most: int) -> npt.NDArray[Any]:
    """Return an array of an archive, flat and of at most so many values.

    What it claims to be is looked at before any memory is taken for it.
    """
    if archive.getinfo(f"{name}.npy").compress_type != zipfile.ZIP_STORED:
        raise ValueError(f"{name} is compressed")
    with archive.open(f"{name}.npy") as member:
        np.lib.format.read_magic(member)
        shape, in_columns, found = np.lib.format.read_array_header_1_0(member)
        count = math.prod(shape)
        if found != kind or in_columns or min(shape, default=0) < 0:
            raise ValueError(f"{name} is of {found} with shape {shape}")
        if count > most:
            raise ValueError(f"{name} has {count} values, and the training no more than {most}")
        size = count * found.itemsize
        content = member.read(size + 1)
    if len(content) != size:
        raise ValueError(f"{name} is not as long as it says")
    return np.frombuffer(content, kind)


def _check_snapshot(snapshot: Snapshot, period: int | None) -> None:
    """Refuse numbers that no training can have come to (ValueError)."""
    totals, steps, endings, sides = snapshot.columns
    if len({len(column) for column in snapshot.columns}) > 1:
        raise ValueError("columns of episodes that do not fit together")
    if not (np.isfinite(totals).all() and (steps > 0).all()):
        raise ValueError("episodes without steps, or without a return")
    known = np.isin(endings, range(len(ENDINGS))).all() and np.isin(sides, range(len(SIDES))).all()
    if not known or snapshot.seconds < 0:
        raise ValueError("episodes that the training does not have")
    due = range(period, len(totals) + 1, period) if period else ()
    if [point.episodes for point in snapshot.evaluations] != list(due):
        raise ValueError("evaluations at other episodes than the training has them")
    if not np.isfinite(snapshot.evaluations).all():
        raise ValueError("evaluations with values that are not finite")
    states: list[Any] = [snapshot.env_rng, snapshot.learner_rng, snapshot.chance_rng]
    for state in filter(None, states):
        np.random.PCG64().state = state
