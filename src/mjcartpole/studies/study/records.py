"""What a run of a study has come to, and the log of all: a line each, written as they come.

A process that is killed leaves at most one line that is cut short; that run is done again.
"""

import contextlib
import functools
import json
import socket
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import BinaryIO, Final, Self

from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.errors import FileError, MjCartPoleError
from mjcartpole.files import brief, is_there, opened, sync
from mjcartpole.learning.evaluation import evaluate_in, world_of
from mjcartpole.learning.stored import Fields, checked, parse
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.studies.multi_seed import OUT_OF_MEMORY, SeedJob, model_of, train_seed
from mjcartpole.studies.side_by_side import Stop
from mjcartpole.studies.study.measures import APART, MEASURES, Outcome, curve_of, figures_of
from mjcartpole.versions import version_of

LOG: Final = "results.jsonl"
MOST_LOG: Final = 2**36
"""Bytes: ten times as many as the most runs of a study take."""
MOST_LINE: Final = 2**20

PACKAGES: Final = ("mjcartpole", "mujoco", "numpy", "numba", "gymnasium")
"""What figures may depend on; each is a column."""

_FIELDS: Final[Fields] = {
    "key": str,
    "error": str,
    "figures": {name: float | None for name in MEASURES if name not in APART},
    "episodes_trained": int,
    "steps_trained": int,
    "versions": dict.fromkeys(PACKAGES, str),
    "curve": tuple[tuple[float, ...], ...],
    "greedy": tuple[tuple[float, ...], ...],
    "times": dict.fromkeys(APART, float | None),
    "host": str,
}


@dataclass(frozen=True)
class Record:
    """What one run has come to.

    Attributes:
        key: See `PlannedRun`.
        error: Why it failed, for instance since the physics diverged; empty if it did not.
        figures: By name of measure; None where there is none.
        episodes_trained: How many there were.
        steps_trained: The steps of these.
        versions: By package.
        curve: The learning curve, see `curve_of`.
        greedy: Evaluations in its midst: episodes and steps before, mean, minimum.
        times: Figures that are others each time.
        host: Where.
    """

    key: str
    error: str
    figures: Mapping[str, float | None]
    episodes_trained: int
    steps_trained: int
    versions: Mapping[str, str]
    curve: Sequence[Sequence[float]]
    greedy: Sequence[Sequence[float]]
    times: Mapping[str, float | None]
    host: str

    @classmethod
    def read(cls, line: bytes) -> Self:
        """Return the record that a line of the log is.

        Raises:
            ValueError: It is none.
        """
        found = cls(**checked(parse(line), _FIELDS))
        if {*map(len, found.curve)} - {2} or {*map(len, found.greedy)} - {4}:
            raise ValueError("a point of a curve has too few or too many numbers")
        return found

    def line(self) -> bytes:
        """Return it as a line of the log."""
        return json.dumps(asdict(self), allow_nan=False).encode() + b"\n"

    def has(self, measures: Sequence[str]) -> bool:
        """Return whether it says all that is asked: greedy episodes may not have been played."""
        greedy = any(name.startswith("greedy") for name in measures)
        return bool(self.error) or not greedy or self.figures["greedy_mean"] is not None


@functools.cache
def versions() -> Mapping[str, str]:
    """Return the versions here of all that figures may depend on; they are read once."""
    return {name: version_of(name) or "not installed" for name in PACKAGES}


def do_run(
    key: str,
    job: SeedJob,
    tested: Disturbances | None,
    stop: Stop,
    cartpole: CartPole | None = None,
) -> Record | None:
    """Train, and return what it came to; None if it was to stop, or has no memory here.

    Greedy episodes are played besides under the disturbances under which it is tested, if any. The
    job's model is given if it is loaded already, and is this run's own.
    """
    found = train_seed(job, stop, cartpole)
    result = found.result
    if result is None:
        lasting = found.error and found.error != OUT_OF_MEMORY
        return _failed(key, found.error) if lasting else None
    try:
        disturbed = None
        if tested:
            world = world_of(job.config, cartpole or model_of(job), tested)
            disturbed = evaluate_in(world, result.policy, engine=job.engine)
    except MjCartPoleError as error:
        return _failed(key, str(error))
    outcome = Outcome(result, found.evaluation, disturbed)
    return Record(
        key=key,
        error="",
        figures=figures_of(outcome),
        episodes_trained=len(result.returns),
        steps_trained=result.steps,
        versions=versions(),
        curve=curve_of(result),
        greedy=[
            [each.episodes, each.steps, each.mean, each.minimum] for each in result.evaluations
        ],
        times=figures_of(outcome, apart=True),
        host=socket.gethostname(),
    )


def _failed(key: str, error: str) -> Record:
    figures, times = dict.fromkeys(_FIELDS["figures"]), dict.fromkeys(APART)
    return Record(key, error, figures, 0, 0, versions(), (), (), times, socket.gethostname())


class RecordLog:
    """The records of a folder, in the order in which they came.

    Attributes:
        path: The file.
        found: Records by key.
        damaged: Lines that are no records.
    """

    def __init__(self, folder: Path) -> None:
        """Read what is there.

        Raises:
            FileError: It cannot be read.
        """
        self.path = folder / LOG
        self.found: dict[str, Record] = {}
        self.damaged = 0
        self._is_cut = False
        if is_there(self.path):
            with opened(self.path, MOST_LOG) as file:
                self._read(file)

    def _read(self, file: BinaryIO) -> None:
        while line := file.readline(MOST_LINE):
            self._is_cut = not line.endswith(b"\n")
            try:
                record = Record.read(line)
            except ValueError:
                self.damaged += 1
            else:
                self.found[record.key] = record

    @contextlib.contextmanager
    def writing(self) -> Iterator[Callable[[Record], None]]:
        """Yield what adds a record: to the file at once, so that it outlives this process.

        Raises:
            FileError: The file cannot be written.
        """
        with self._written(), self.path.open("ab") as file:
            file.write(b"\n" if self._is_cut else b"")

        def add(record: Record) -> None:
            with self._written(), self.path.open("ab") as file:
                file.write(record.line())
            self.found[record.key] = record

        yield add
        with self._written():
            sync(self.path)

    @contextlib.contextmanager
    def _written(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise FileError(f"cannot write '{self.path}': {brief(error)}") from error
