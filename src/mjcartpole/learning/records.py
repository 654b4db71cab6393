"""What a training has come to so far, episode by episode, read back from its run folder."""

import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from mjcartpole.errors import RunError
from mjcartpole.files import brief, is_folder, read_bytes
from mjcartpole.learning.checkpoints import LATEST, load_checkpoint
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.documents import read_config
from mjcartpole.learning.episodes import ENDINGS, SIDES, Columns, EpisodeLog
from mjcartpole.learning.run_model import read_document, stored_model
from mjcartpole.learning.runs import EPISODES, EVALUATIONS, VISITS, content_of
from mjcartpole.task import N_ACTIONS

MOST_BYTES: Final = 2**28
"""Of a table of a run: some eight million episodes."""


@dataclass(frozen=True, eq=False)
class Record:
    """A training as it went.

    Attributes:
        folder: Its run folder.
        config: What is trained.
        columns: The episodes that are finished, one at least.
        greedy: Training episodes before each greedy evaluation, and its mean return.
    """

    folder: Path
    config: TrainConfig
    columns: Columns
    greedy: tuple[tuple[int, float], ...]


def read_record(folder: Path) -> Record:
    """Read what a training has come to; while it lasts, up to its last checkpoint.

    Raises:
        RunError: It is no run folder, is damaged, or no episode is finished.
        ModelError: The model of a run that is not complete cannot be used.
    """
    if not is_folder(folder):
        raise RunError(f"no run folder '{folder}'; `mjcartpole train` makes one")
    content, config = content_of(folder), read_config(folder)[2]
    if LATEST in content:
        columns, greedy = _of_checkpoint(folder, config)
    elif EPISODES in content:
        columns = _read_episodes(folder / EPISODES, config)
        greedy = _read_greedy(folder / EVALUATIONS) if EVALUATIONS in content else ()
    else:
        columns, greedy = EpisodeLog(0).columns, ()
    if not len(columns.totals):
        raise RunError(
            f"no episode of the run in '{folder}' is finished; go on with "
            f"`mjcartpole train --resume {folder}`"
        )
    return Record(folder, config, columns, greedy)


def _of_checkpoint(
    folder: Path, config: TrainConfig
) -> tuple[Columns, tuple[tuple[int, float], ...]]:
    document = read_document(folder)
    poles = stored_model(document, config, folder).poles
    found = load_checkpoint(folder / LATEST, config, document, poles=poles).snapshot
    return found.columns, tuple((point.episodes, point.mean) for point in found.evaluations)


def _read_episodes(path: Path, config: TrainConfig) -> Columns:
    before = {
        config.episode.replace(" ", "_"): "i8",
        "return": "f8",
        "steps": "i4",
        "ending": "U16",
    }
    table = _read_table(path, before | {"side": "U16"}, before)
    endings = _indices(table["ending"], ENDINGS)
    sided = "side" in (table.dtype.names or ())
    sides = _indices(table["side"], SIDES) if sided else np.zeros(len(table), np.int8)
    right = (
        len(table) <= config.episodes
        and np.isfinite(table["return"]).all()
        and (table["steps"] > 0).all()
        and (endings >= 0).all()
        and (sides >= 0).all()
    )
    if not right:
        raise RunError(f"'{path}' is damaged: it has episodes that the run cannot have had")
    return Columns(table["return"], table["steps"], endings, sides)


def _indices(words: npt.NDArray[Any], known: Sequence[str]) -> npt.NDArray[np.int8]:
    """Return the index of each word; -1 of one that is unknown."""
    found = np.full(len(words), -1, np.int8)
    for index, word in enumerate(known):
        found[words == word] = index
    return found


def read_visits(folder: Path, grid: Discretizer) -> npt.NDArray[np.int64] | None:
    """Return how often each action was taken in each state; None where it was not counted.

    The grid is that of the run's policy.

    Raises:
        RunError: They are damaged, or those of another table.
    """
    if VISITS not in content_of(folder):
        return None
    table = _read_table(folder / VISITS, {"left": "i8", "right": "i8"})
    visits = np.stack([table["left"], table["right"]], axis=1)
    if len(visits) != math.prod(grid.bins) or (visits < 0).any():
        raise RunError(f"'{folder / VISITS}' is damaged: it is not of the run's table")
    counted: npt.NDArray[np.int64] = visits.reshape(*grid.bins, N_ACTIONS)
    return counted


def _read_greedy(path: Path) -> tuple[tuple[int, float], ...]:
    names = ("episode", "steps", "mean", "minimum")
    table = _read_table(path, dict.fromkeys(names, "f8"))
    if not all(np.isfinite(table[name]).all() for name in names):
        raise RunError(f"'{path}' is damaged: it has values that are not finite")
    pairs = zip(table["episode"].tolist(), table["mean"].tolist(), strict=True)
    return tuple((int(episode), mean) for episode, mean in pairs)


def _read_table(path: Path, *kinds: dict[str, str]) -> npt.NDArray[Any]:
    """Return the lines of a table under a line of names: one of several kinds that it may have.

    Raises:
        RunError: It cannot be read, or has other columns.
    """
    head, _, lines = read_bytes(path, MOST_BYTES, refusal=RunError).partition(b"\n")
    known = {",".join(columns).encode(): list(columns.items()) for columns in kinds}
    columns = known.get(head.rstrip())
    if columns is None:
        names = next(iter(known)).decode()
        raise RunError(f"'{path}' is damaged: its first line is not {names}")
    if not lines.strip():
        return np.empty(0, columns)
    try:
        return np.loadtxt(io.BytesIO(lines), columns, delimiter=",", comments=None, ndmin=1)
    except (ValueError, OverflowError) as error:
        raise RunError(f"'{path}' is damaged: {brief(error)}") from error
