"""One config, many seeds, side by side: each as if it were trained alone."""

import concurrent.futures
import contextlib
import dataclasses
import multiprocessing
import os
import reprlib
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.synchronize import Event
from pathlib import Path

from mjcartpole.errors import ConfigError, MjCartPoleError, RunError
from mjcartpole.learning import runs
from mjcartpole.learning.checkpoints import Checkpoint
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.documents import CONFIG
from mjcartpole.learning.engine import Engine, choose_engine
from mjcartpole.learning.session import CHECKPOINT_EVERY, Session
from mjcartpole.learning.training import Training, TrainResult
from mjcartpole.physics.batch_simulation import available_cores
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.load import load_model, load_named
from mjcartpole.studies.evaluation import Evaluation
from mjcartpole.studies.finish_training import evaluate_where_trained, finish_training
from mjcartpole.studies.statistics import Aggregate, aggregate

MAX_SEEDS = 100_000


@dataclass(frozen=True, eq=False, repr=False)
class SeedResult:
    """What one seed has come to.

    Attributes:
        seed: The seed.
        evaluation: The greedy evaluation; None if the seed failed or was stopped.
        result: What was learned; None if the seed failed, or was complete on disk before.
        error: Why it failed; empty if it did not.
    """

    seed: int
    evaluation: Evaluation | None = None
    result: TrainResult | None = None
    error: str = ""

    @property
    def score(self) -> float | None:
        """Mean greedy return."""
        return None if self.evaluation is None else self.evaluation.mean

    def __repr__(self) -> str:
        outcome = self.error or self.evaluation or "not finished"
        return f"SeedResult({self.seed}: {outcome})"


@dataclass(frozen=True, eq=False, repr=False)
class ManyResult:
    """What many seeds have come to.

    Attributes:
        config: What was trained; its seed is the first.
        seeds: One result for each, in order.
    """

    config: TrainConfig
    seeds: tuple[SeedResult, ...]

    @property
    def scores(self) -> list[float]:
        """Mean greedy return of each seed that was evaluated."""
        return [found.score for found in self.seeds if found.score is not None]

    @property
    def failed(self) -> list[SeedResult]:
        """The seeds that ended in an error."""
        return [found for found in self.seeds if found.error]

    def aggregate(self) -> Aggregate | None:
        """Statistics over the scores; None where there are none."""
        if not self.scores:
            return None
        return aggregate(self.scores, solved_at=self.config.rules.reward_threshold)

    def __repr__(self) -> str:
        count, scores = len(self.seeds), self.scores
        reached = (
            f", mean {sum(scores) / len(scores):.2f}, least {min(scores):.2f}" if scores else ""
        )
        return f"ManyResult({len(scores)} of {count} seeds evaluated{reached})"


@dataclass(frozen=True)
class _Job:
    """One seed, in a form that another process can be given."""

    config: TrainConfig
    engine: Engine
    document: str | None
    """The model's, where it is loaded already."""
    folder: Path | None
    preset: str
    every: float
    events: bool
    allow_assets: tuple[Path, ...]


class SeedRunner:
    """Many seeds at work; iterating `run()` does it, `result()` says what it has come to.

    Attributes:
        seeds: Which.
        workers: How many at once.
    """

    def __init__(
        self,
        config: TrainConfig,
        seeds: int | Sequence[int],
        cartpole: CartPole,
        *,
        workers: int | None = None,
        engine: Engine = "compiled",
        folder: Path | None = None,
        preset: str = "tuned",
        every: float = CHECKPOINT_EVERY,
        events: bool = False,
        allow_assets: tuple[Path, ...] = (),
    ) -> None:
        """Plan the work.

        Args:
            config: What to train.
            seeds: Which seeds; a number stands for that many from the config's own seed on.
            cartpole: The config's model.
            workers: How many at once; as many as there are cores if left out.
            engine: Who runs the loop.
            folder: Keeps a run per seed in here, `seed-<n>`; runs that are there go on.
            preset: Name of the preset that the config began from.
            every: Seconds between two checkpoints of a run.
            events: Write TensorBoard events for each run.
            allow_assets: Folders in which the files of the models of runs that go on may lie.

        Raises:
            ConfigError: The seeds or workers make no sense.
        """
        self.seeds = check_seeds(config, seeds)
        self.workers = min(_check_workers(workers), len(self.seeds))
        self._config = config
        on_mujoco = config.backend == "mujoco"
        self._engine = choose_engine(engine, config.backend, cartpole if on_mujoco else None)
        self._jobs = [
            _Job(
                config=dataclasses.replace(config, seed=seed),
                engine=self._engine,
                document=cartpole.xml if on_mujoco else None,
                folder=None if folder is None else seed_folder(folder, seed),
                preset=preset,
                every=every,
                events=events,
                allow_assets=allow_assets,
            )
            for seed in self.seeds
        ]
        self._found: dict[int, SeedResult] = {}

    def run(self, stop: Callable[[], bool]) -> Iterator[SeedResult | None]:
        """Train all seeds, or until `stop()` is true.

        Yields:
            Each seed's result when it has come, and None now and then while waiting.
        """
        work = self._in_threads if self._engine == "compiled" else self._in_processes
        for found in work(stop):
            if found is not None:
                self._found[found.seed] = found
            yield found

    def result(self) -> ManyResult:
        """The seeds that have come to something, in order."""
        return ManyResult(
            self._config, tuple(self._found[seed] for seed in self.seeds if seed in self._found)
        )

    def _in_threads(self, stop: Callable[[], bool]) -> Iterator[SeedResult | None]:
        with concurrent.futures.ThreadPoolExecutor(self.workers) as pool:
            futures = {pool.submit(_train_seed, job, stop): job.config.seed for job in self._jobs}
            yield from _as_they_come(futures)

    def _in_processes(self, stop: Callable[[], bool]) -> Iterator[SeedResult | None]:
        # A fresh interpreter each: nothing of OpenGL or threads is inherited.
        spawn = multiprocessing.get_context("spawn")
        with _signals_for_parent():
            stopped = spawn.Event()
        with concurrent.futures.ProcessPoolExecutor(
            self.workers, mp_context=spawn, initializer=_begin_worker, initargs=(stopped,)
        ) as pool:
            with _signals_for_parent():
                futures = {
                    pool.submit(_train_seed_in_worker, job): job.config.seed for job in self._jobs
                }
            try:
                for found in _as_they_come(futures):
                    if stop():
                        stopped.set()
                    yield found
            finally:
                stopped.set()


def _as_they_come(
    futures: "dict[concurrent.futures.Future[SeedResult], int]",
) -> Iterator[SeedResult | None]:
    waiting = set(futures)
    while waiting:
        done, waiting = concurrent.futures.wait(
            waiting, timeout=0.1, return_when=concurrent.futures.FIRST_COMPLETED
        )
        yield from (_result_of(future, futures[future]) for future in done)
        yield None


def _result_of(future: "concurrent.futures.Future[SeedResult]", seed: int) -> SeedResult:
    try:
        return future.result()
    except (concurrent.futures.BrokenExecutor, OSError) as error:
        # A worker process was killed from outside, or there is no memory for one.
        return SeedResult(seed, error=f"its process ended: {error}")


@contextlib.contextmanager
def _signals_for_parent() -> Iterator[None]:
    """Have processes that are started inside never see signals that end a job.

    A terminal, and `timeout`, send them to all processes of a job.
    """
    if sys.platform == "win32":
        yield
        return
    ending = {signal.SIGINT, signal.SIGTERM, signal.SIGHUP}
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ending)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


_stopped: Event | None = None


def _begin_worker(stopped: Event) -> None:
    """Leave signals to the process that began the work; it says when to stop."""
    global _stopped  # noqa: PLW0603 - the pool has no other way to hand an event over
    _stopped = stopped
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """A worker outlives a parent that was killed, and would keep its folders locked."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


def _train_seed_in_worker(job: _Job) -> SeedResult:
    assert _stopped is not None
    return _train_seed(job, _stopped.is_set)


def _train_seed(job: _Job, stop: Callable[[], bool]) -> SeedResult:
    seed = job.config.seed
    if stop():
        return SeedResult(seed)
    try:
        cartpole = _model_of(job)
        if job.folder is None:
            return _train_in_memory(job, cartpole, stop)
        return _train_on_disk(job, job.folder, cartpole, stop)
    except MjCartPoleError as error:
        return SeedResult(seed, error=str(error))
    except MemoryError:
        return SeedResult(seed, error="out of memory")


def _model_of(job: _Job) -> CartPole:
    if job.document is None:
        return load_model()
    return load_named(job.document, job.config.model, own_timestep=job.config.own_timestep)


def _train_in_memory(job: _Job, cartpole: CartPole, stop: Callable[[], bool]) -> SeedResult:
    training = Training(job.config, engine=job.engine, cartpole=cartpole)
    for _ in training.run():
        if stop():
            return SeedResult(job.config.seed)
    result = training.result()
    evaluation = evaluate_where_trained(result.policy, job.config, cartpole, job.engine)
    return SeedResult(job.config.seed, evaluation, result)


def _train_on_disk(
    job: _Job, folder: Path, cartpole: CartPole, stop: Callable[[], bool]
) -> SeedResult:
    seed = job.config.seed
    if runs.is_complete(folder):
        run = runs.check_complete(folder, job.allow_assets)
        _check_same(job, folder, run.config)
        again = evaluate_where_trained(run.policy, job.config, cartpole, job.engine)
        return SeedResult(seed, again)
    training = Training(job.config, engine=job.engine, cartpole=cartpole)
    session = Session(folder, training, cartpole, every=job.every)
    with _begun(job, folder, cartpole) as checkpoint:
        session.resume(checkpoint)
        for _ in session.run(stop):
            pass
        result, _, evaluation = finish_training(
            session, folder, cartpole, preset=job.preset, events=job.events
        )
        if evaluation is None:
            return SeedResult(seed)
        runs.finish_run(folder)
    return SeedResult(seed, evaluation, result)


@contextlib.contextmanager
def _begun(job: _Job, folder: Path, cartpole: CartPole) -> Iterator[Checkpoint | None]:
    """Hold a seed's folder; yields where to go on."""
    if CONFIG in runs.content_of(folder):
        with runs.resumed_folder(folder, job.allow_assets) as begun:
            _check_same(job, folder, begun.config)
            yield begun.checkpoint
    else:
        # What else lies there is the rest of a run whose removal was cut short.
        with runs.claimed_folder(folder, overwrite=True):
            runs.begin_run(folder, job.config, cartpole, preset=job.preset)
            yield None


def _check_same(job: _Job, folder: Path, config: TrainConfig) -> None:
    if config != job.config:
        raise RunError(f"'{folder}' holds a run with another config")


def seed_folder(folder: Path, seed: int) -> Path:
    """Where one seed's run lies in the folder of many."""
    return folder / f"seed-{seed}"


def check_seeds(config: TrainConfig, seeds: int | Sequence[int]) -> tuple[int, ...]:
    """The seeds that are meant; a number stands for that many from the config's own on.

    Raises:
        ConfigError: They are too many, none, the same twice, or no seeds.
    """
    if isinstance(seeds, int):
        if not 1 <= seeds <= MAX_SEEDS:
            raise ConfigError(f"seeds must be a number from 1 to {MAX_SEEDS:,}, not {seeds}")
        seeds = range(config.seed, config.seed + seeds)
    if not 1 <= len(seeds) <= MAX_SEEDS or len(set(seeds)) != len(seeds):
        raise ConfigError(
            f"seeds must be different numbers, at least one and at most {MAX_SEEDS:,}, "
            f"not {reprlib.repr(list(seeds))}"
        )
    for seed in (min(seeds), max(seeds)):
        _ = dataclasses.replace(config, seed=seed)
    return tuple(seeds)


def _check_workers(workers: int | None) -> int:
    if workers is None:
        return available_cores()
    if workers < 1:
        raise ConfigError(f"workers must be a number from 1 up, not {workers}")
    return workers
