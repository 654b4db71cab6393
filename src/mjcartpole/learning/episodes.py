"""What an episode came to, and the log of all episodes of a training."""

from collections.abc import Iterator, Sequence
from typing import Any, Final, Literal, NamedTuple, Self, overload

import numpy as np
import numpy.typing as npt

Ending = Literal["time limit", "off the track", "pole fell"]
ENDINGS: Final[tuple[Ending, ...]] = ("time limit", "off the track", "pole fell")
Side = Literal["", "left", "right"]
SIDES: Final[tuple[Side, ...]] = ("", "left", "right")
"""Where the rules ended an episode; the first at a time limit, and where it was not noted."""

_TOUCHED: Final = 10_000_000
"""Episodes whose memory is claimed at the start, so that a long training does not grow."""


class Episode(NamedTuple):
    """What one episode came to."""

    number: int
    total: float
    """Undiscounted return."""
    steps: int
    ending: Ending
    side: Side = ""
    """Where the cart left the track, or to which side the pole fell."""


def ending_index(terminated: bool, x: float, x_limit: float) -> int:
    """Return why an episode ended with the cart at x, m, as an index of `ENDINGS`."""
    if not terminated:
        return 0
    return 1 if abs(x) > x_limit else 2


def side_index(ending: int, x: float, theta: float) -> int:
    """Return on which side an episode ended, as an index of `SIDES`.

    `ending` is an index of `ENDINGS`, x the cart's last place, m, and theta the last angle of the
    pole that leans most, rad.
    """
    if ending == 0:
        return 0
    return 2 if (x if ending == 1 else theta) > 0.0 else 1


class Columns(NamedTuple):
    """Episodes in columns, each of shape (n,): fourteen bytes for an episode."""

    totals: npt.NDArray[np.float64]
    steps: npt.NDArray[np.int32]
    endings: npt.NDArray[np.int8]
    """Indices of `ENDINGS`."""
    sides: npt.NDArray[np.int8]
    """Indices of `SIDES`."""

    def __repr__(self) -> str:
        return f"Columns({len(self.totals):,} episodes)"


class EpisodeLog(Sequence[Episode]):
    """The episodes of a training.

    Attributes:
        storage: Columns for as many as it can take; the first `len(log)` entries count.
    """

    def __init__(self, capacity: int) -> None:
        """An empty log, for at most so many episodes."""
        self.storage = Columns(
            np.empty(capacity, np.float64),
            np.empty(capacity, np.int32),
            np.empty(capacity, np.int8),
            np.empty(capacity, np.int8),
        )
        self._length = 0
        for column in self.storage:
            column[:_TOUCHED] = 0

    @classmethod
    def of(cls, columns: Columns, capacity: int) -> Self:
        """A log that begins with the episodes of other columns."""
        log = cls(capacity)
        log._length = len(columns.totals)
        log._put(slice(log._length), *columns)
        return log

    def __repr__(self) -> str:
        mean = f", mean return {self.columns.totals.mean():.2f}" if len(self) else ""
        return f"EpisodeLog({len(self):,} episodes{mean})"

    def csv(self, name: str = "episode") -> str:
        """One line per episode, numbered from 1, under a line of names; the first is given."""
        # There are few different ones, so each is put together once.
        tails: dict[tuple[float, int, int, int], str] = {}
        lines = [f"{name},return,steps,ending,side\n"]
        columns = (column.tolist() for column in self.columns)
        for number, episode in enumerate(zip(*columns, strict=True), start=1):
            if episode not in tails:
                total, steps, ending, side = episode
                tails[episode] = f",{total},{steps},{ENDINGS[ending]},{SIDES[side]}\n"
            lines.append(f"{number}{tails[episode]}")
        return "".join(lines)

    @property
    def columns(self) -> Columns:
        """The episodes so far, each column of shape (len(log),); views."""
        columns: list[Any] = [column[: self._length] for column in self.storage]
        return Columns(*columns)

    def append(self, episode: Episode) -> None:
        """Add the next episode."""
        kind, side = ENDINGS.index(episode.ending), SIDES.index(episode.side)
        self._put(self._length, episode.total, episode.steps, kind, side)
        self._length += 1

    def extend_to(self, length: int) -> None:
        """Count episodes as logged that were written straight into the storage."""
        self._length = length

    def copy(self) -> Self:
        """The episodes so far, which later ones do not change."""
        return type(self).of(self.columns, self._length)

    def __len__(self) -> int:
        return self._length

    @overload
    def __getitem__(self, index: int) -> Episode: ...
    @overload
    def __getitem__(self, index: slice) -> list[Episode]: ...
    def __getitem__(self, index: int | slice) -> Episode | list[Episode]:
        if isinstance(index, slice):
            return [self._at(i) for i in range(*index.indices(self._length))]
        if not -self._length <= index < self._length:
            raise IndexError(f"the log has {self._length} episodes, none at {index}")
        return self._at(index % self._length)

    def __iter__(self) -> Iterator[Episode]:
        return (self._at(index) for index in range(self._length))

    def _at(self, index: int) -> Episode:
        totals, steps, endings, sides = (column[index] for column in self.storage)
        return Episode(index, float(totals), int(steps), ENDINGS[endings], SIDES[sides])

    def _put(self, where: int | slice, *columns: npt.ArrayLike) -> None:
        storage: tuple[Any, ...] = self.storage
        for column, values in zip(storage, columns, strict=True):
            column[where] = values
