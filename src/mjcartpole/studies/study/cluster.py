"""Runs on a Dask cluster that is there: workers share nothing with this machine.

A model travels as its document and the files that it names, a result as a small record. Dask gives
the runs of a worker that was killed to another one; a run is deterministic, so its bits are the
same. Dask sends its messages as pickles: a scheduler has to be one's own, or trusted.
"""

import contextlib
import dataclasses
import functools
import hashlib
import logging
import math
import re
import socket
import struct
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping
from concurrent.futures import BrokenExecutor, Future
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import mjcartpole
from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.errors import ConfigError, MjCartPoleError
from mjcartpole.files import brief, read_bytes
from mjcartpole.packages import check_installed
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.library import stop_timers
from mjcartpole.physics.load import load_stored
from mjcartpole.studies.multi_seed import SeedJob
from mjcartpole.studies.side_by_side import Found, Stop, as_they_come
from mjcartpole.studies.study.plan import PlannedRun
from mjcartpole.studies.study.records import Record, do_run, versions
from mjcartpole.studies.study.runner import Runs

PATIENCE: Final = 10
"""Seconds within which a scheduler answers."""
_AHEAD: Final = 3
"""Runs that are sent for each thread of a worker: none waits for this machine."""
_MOST_FILE: Final = 2**28
"""Bytes of a file that a model names."""
_FOLDERS: Final = ("disturbances", "physics", "envs", "learning")
_DECIDING: Final = ("*.py", *(f"{name}/**/*.py" for name in _FOLDERS))
"""What of this package decides the bits of a training."""
_SINES: Final = "a C library whose sines come to"

_ADDRESS: Final = re.compile(r"((tcp|tls|ucx|ws|wss)://)?[^\s/]+:\d{1,5}")
_START: Final = (
    "start one with `dask scheduler`, and give the address that it prints, such as "
    "tcp://127.0.0.1:8786"
)
_log = logging.getLogger("mjcartpole")
_stop_timers: Final = functools.cache(stop_timers)  # Once in a worker, before it steps.


@dataclass(frozen=True)
class Parcel:
    """A run as it travels.

    Attributes:
        key: See `PlannedRun`.
        job: With the document as a run stores it.
        files: What lies beside it, by name.
        tested: See `PlannedRun`.
        versions: Those here: a worker of others would find other figures.
    """

    key: str
    job: SeedJob
    files: Mapping[str, bytes] = field(repr=False)
    tested: Disturbances | None
    versions: Mapping[str, str]

    @classmethod
    def of(cls, run: PlannedRun) -> "Parcel":
        """Return a run as it travels.

        Raises:
            FileError: A file that its model names cannot be read.
        """
        if run.job.document is None:
            return cls(run.key, run.job, {}, run.tested, versions_here())
        document, files = run.cartpole.stored
        contents = {name: _content(source) for name, source in files.items()}
        job = dataclasses.replace(run.job, document=document)
        return cls(run.key, job, contents, run.tested, versions_here())


def run_parcel(parcel: Parcel) -> Record | None:
    """Do a run on a worker.

    Raises:
        ConfigError: The worker has other versions than where the run comes from.
    """
    check_versions(versions_here(), parcel.versions, f"a worker on {socket.gethostname()}")
    _stop_timers()
    with tempfile.TemporaryDirectory() if parcel.files else contextlib.nullcontext("") as folder:
        for name, content in parcel.files.items():
            Path(folder, name).write_bytes(content)
        cartpole = _unpacked(parcel.job, Path(folder)) if parcel.files else None
        return do_run(parcel.key, parcel.job, parcel.tested, lambda: False, cartpole)


@functools.cache
def versions_here() -> dict[str, str]:
    """Return the versions of all that decides figures, and a digest of these sources."""
    package = Path(mjcartpole.__file__).parent
    paths = [path for part in _DECIDING for path in sorted(package.glob(part))]
    digest = hashlib.sha256()
    for path in paths:
        digest.update(path.read_text(encoding="utf-8").encode())
    return {**versions(), "mjcartpole's sources": digest.hexdigest()[:8], _SINES: _sines()}


def _sines() -> str:
    """Return a digest of sines and cosines: a C library rounds them as its processor can."""
    values = [turn(k / 512) for turn in (math.sin, math.cos) for k in range(2048)]
    return hashlib.sha256(struct.pack(f"<{len(values)}d", *values)).hexdigest()[:8]


def check_versions(there: Mapping[str, str], here: Mapping[str, str], where: str) -> None:
    """Refuse a worker that would find other figures (ConfigError)."""
    for name in here:
        if there.get(name) != here[name]:
            step = "begin on a machine of its kind" if name == _SINES else "install the same there"
            raise ConfigError(
                f"{where} has {name} {there.get(name, 'of another kind')}, and here it is "
                f"{here[name]}; {step}"
            )


@contextlib.contextmanager
def connected(address: str) -> Iterator[Any]:
    """Connect Dask's client to a scheduler, and check its workers.

    Raises:
        ConfigError: It does not answer, or a worker has other versions.
    """
    check_installed("a cluster", "distributed")
    if not _ADDRESS.fullmatch(address):
        raise ConfigError(f"{address!r} is no address of a scheduler; {_START}")
    client = _client(address)
    if isinstance(client, Exception):
        said = brief(client)
        raise ConfigError(f"no Dask scheduler answers at {address!r} ({said}); {_START}")
    with client:
        for worker, there in client.run(versions_here, on_error="return").items():
            if isinstance(there, BaseException):
                raise _unusable(worker, there)
            check_versions(there, versions_here(), f"worker {worker}")
        yield client


def _client(address: str) -> Any:  # noqa: ANN401
    """Return Dask's client, or why there is none."""
    import distributed  # noqa: PLC0415 - an optional package

    for name in logging.root.manager.loggerDict:
        if name.startswith("distributed"):
            # What goes wrong is told in a line of ours.
            logging.getLogger(name).setLevel(logging.CRITICAL)
    made = list[Any]()

    def make() -> None:
        try:
            made.append(distributed.Client(address, timeout=PATIENCE, set_as_default=False))
        except (OSError, ValueError, TypeError) as error:
            made.append(error)

    # Of what is there and is no scheduler, Dask would wait for a word for ever.
    thread = threading.Thread(target=make, daemon=True)
    thread.start()
    thread.join(2 * PATIENCE)
    return made[0] if made else TimeoutError("what is there says nothing that Dask understands")


def run_there(runs: Runs, client: Any, stop: Stop) -> Found[PlannedRun, Record | None]:  # noqa: ANN401
    """Do runs on a cluster.

    Raises:
        FileError: A file that a model names cannot be read.
    """
    pool, ahead = client.get_executor(pure=False), _Ahead(client)
    jobs = (run for run in runs if not stop())

    def submit(run: PlannedRun) -> Future[Record | None]:
        sent: Future[Record | None] = pool.submit(run_parcel, Parcel.of(run))
        return sent

    try:
        for found in as_they_come(submit, jobs, ahead.count):
            yield None if found is None else (found[0], _understood(found[1]))
            if stop():
                return
    except OSError as error:
        _log.warning("the scheduler answers no more (%s)", brief(error))
    finally:
        pool.shutdown(wait=False)


def threads_of(client: Any) -> int:  # noqa: ANN401
    """Return how many runs the workers of a cluster do at once."""
    return sum(client.nthreads().values())


class _Ahead:
    """How many runs are to be under way; asked for now and then, since workers come and go."""

    def __init__(self, client: Any) -> None:  # noqa: ANN401
        self._client, self._count, self._asked = client, 1, 0.0

    def count(self) -> int:
        """Return it."""
        if time.monotonic() > self._asked + 1:
            threads = threads_of(self._client)
            if not threads and self._count:
                _log.warning("the scheduler has no worker; waiting for one")
            self._count, self._asked = _AHEAD * threads, time.monotonic()
        return max(1, self._count)


def _understood(future: Future[Record | None]) -> Future[Record | None]:
    """Return a run's future; of one whose workers were killed again and again, a broken one.

    Raises:
        ConfigError: A worker cannot do it.
    """
    error = None if future.cancelled() else future.exception()
    if error is None or isinstance(error, MjCartPoleError):
        return future
    if type(error).__name__ != "KilledWorker":
        raise _unusable("of this scheduler", error)
    broken = Future[Record | None]()
    broken.set_exception(BrokenExecutor(str(error)))
    return broken


def _unusable(worker: str, error: BaseException) -> ConfigError:
    return ConfigError(
        f"worker {worker} cannot do a run ({type(error).__name__}: {error}); install mjcartpole "
        f"{mjcartpole.__version__} there"
    )


def _content(source: Path | str) -> bytes:
    return (
        source.encode() if isinstance(source, str) else read_bytes(source, _MOST_FILE, follow=True)
    )


def _unpacked(job: SeedJob, folder: Path) -> CartPole:
    assert job.document is not None
    config = job.config
    return load_stored(job.document, config.model, folder, own_timestep=config.own_timestep)
