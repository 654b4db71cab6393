"""Many seeds of one config, side by side: each as if it were trained alone."""

import concurrent.futures
import contextlib
import dataclasses
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from multiprocessing.synchronize import Event
from pathlib import Path

from mjcartpole.cores import worker_count
from mjcartpole.errors import MjCartPoleError, RunError
from mjcartpole.learning import runs
from mjcartpole.learning.checkpoints import Checkpoint
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.documents import CONFIG, read_summary
from mjcartpole.learning.engine import Engine, choose_engine
from mjcartpole.learning.evaluation import evaluate_where_trained
from mjcartpole.learning.run_model import check_storable
from mjcartpole.learning.session import CHECKPOINT_EVERY, Session
from mjcartpole.learning.training import Training, training_grid
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.load import load_model, load_named
from mjcartpole.studies import multi_seed_runs
from mjcartpole.studies.finish_training import finish_training
from mjcartpole.studies.seeds import ManyResult, SeedResult, check_seeds, seed_folder


@dataclass(frozen=True)
class _Job:
    """One seed's training, in a form that another process can be given.

    Attributes:
        document: The model's, where it is loaded already.
        folder: The run's; None keeps nothing.
    """

    config: TrainConfig
    engine: Engine
    document: str | None
    folder: Path | None
    preset: str
    every: float
    events: bool
    allow_assets: tuple[Path, ...]

    def of(self, seed: int) -> "_Job":
        """Return the same with another seed, in that one's folder of many."""
        folder = None if self.folder is None else seed_folder(self.folder, seed)
        return dataclasses.replace(
            self, config=dataclasses.replace(self.config, seed=seed), folder=folder
        )


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
        self.workers = worker_count(workers, len(self.seeds))
        on_mujoco = config.backend == "mujoco"
        engine = choose_engine(engine, config.backend, cartpole if on_mujoco else None)
        document = cartpole.xml if on_mujoco else None
        self._job = _Job(config, engine, document, folder, preset, every, events, allow_assets)
        self._found: dict[int, SeedResult] = {}

    def run(self, stop: Callable[[], bool]) -> Iterator[SeedResult | None]:
        """Train all seeds, or until `stop()` is true.

        Yields:
            Each seed's result when it has come, and None now and then while waiting.
        """
        # The compiled engine leaves Python's lock alone.
        in_threads = self._job.engine == "compiled"
        for found in (self._in_threads if in_threads else self._in_processes)(stop):
            if found is not None:
                self._found[found.seed] = found
            yield found

    def result(self) -> ManyResult:
        """Return the seeds that have come to something, in order."""
        found = tuple(self._found[seed] for seed in self.seeds if seed in self._found)
        return ManyResult(self._job.config, found)

    def _in_threads(self, stop: Callable[[], bool]) -> Iterator[SeedResult | None]:
        with concurrent.futures.ThreadPoolExecutor(self.workers) as pool:
            yield from _as_they_come(
                {pool.submit(_train_seed, self._job.of(seed), stop): seed for seed in self.seeds}
            )

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
                    pool.submit(_train_seed_in_worker, self._job.of(seed)): seed
                    for seed in self.seeds
                }
            try:
                for found in _as_they_come(futures):
                    if stop():
                        stopped.set()
                    yield found
            finally:
                stopped.set()


def train_many(
    config: TrainConfig,
    seeds: int | Sequence[int],
    *,
    workers: int | None = None,
    engine: Engine = "compiled",
    run_dir: Path | None = None,
    overwrite: bool = False,
) -> ManyResult:
    """Train one config with many seeds at once.

    >>> many = train_many(TrainConfig(episodes=5, backend="gym"), seeds=3, workers=2)
    >>> [found.seed for found in many.seeds]
    [0, 1, 2]
    >>> many.aggregate().count
    3

    Args:
        config: What to train.
        seeds: Which seeds; a number stands for that many from the config's own seed on.
        workers: How many at once; as many as there are cores if left out. The compiled engine runs
            in threads, since it leaves Python's lock alone, and the Python engine in processes.
        engine: Who runs the loop.
        run_dir: Keeps a run per seed in this folder, and statistics over them, as
            `mjcartpole train --seeds` does; nothing is written if left out.
        overwrite: Replace what the folder holds of this kind.

    Raises:
        ConfigError: The seeds or workers make no sense.
        ModelError: The model cannot be used.
        FileError: The folder is taken or cannot be written.
    """
    cartpole = config.load_model()
    training_grid(config, cartpole)
    runner = SeedRunner(
        config, seeds, cartpole, workers=workers, engine=engine, folder=run_dir, preset="custom"
    )
    if run_dir is None:
        return _finished(runner)
    check_storable(cartpole)
    with multi_seed_runs.claimed_seeds(run_dir, overwrite=overwrite):
        multi_seed_runs.begin_seeds(run_dir, config, runner.seeds, cartpole, preset="custom")
        many = _finished(runner)
        multi_seed_runs.write_seeds(run_dir, many)
    return many


def _finished(runner: SeedRunner) -> ManyResult:
    for _ in runner.run(lambda: False):
        pass
    return runner.result()


def _as_they_come(futures: dict[Future[SeedResult], int]) -> Iterator[SeedResult | None]:
    waiting = set(futures)
    while waiting:
        done, waiting = concurrent.futures.wait(
            waiting, timeout=0.1, return_when=concurrent.futures.FIRST_COMPLETED
        )
        yield from (_result_of(future, futures[future]) for future in done)
        yield None


def _result_of(future: Future[SeedResult], seed: int) -> SeedResult:
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
    """End with a parent that was killed: a worker would keep its folders locked."""
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
    return SeedResult.of(result, evaluation)


def _train_on_disk(
    job: _Job, folder: Path, cartpole: CartPole, stop: Callable[[], bool]
) -> SeedResult:
    seed = job.config.seed
    if runs.is_complete(folder):
        run = runs.check_complete(folder, job.allow_assets)
        _check_same(job, folder, run.config)
        again = evaluate_where_trained(run.policy, job.config, cartpole, job.engine)
        solved = read_summary(folder).get("solved")
        return SeedResult(seed, again, solved_after=solved["episodes"] if solved else None)
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
    return SeedResult.of(result, evaluation)


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
