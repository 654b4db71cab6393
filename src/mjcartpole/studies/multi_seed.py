"""Many seeds of one config, side by side: each as if it were trained alone."""

import contextlib
import dataclasses
from collections.abc import Iterator, Sequence
from concurrent.futures import BrokenExecutor, Future
from dataclasses import dataclass
from pathlib import Path
from typing import Final

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
from mjcartpole.learning.training import Training
from mjcartpole.learning.training_grid import training_grid
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.load import load_model, load_named
from mjcartpole.studies import multi_seed_runs
from mjcartpole.studies.finish_training import finish_training
from mjcartpole.studies.seeds import ManyResult, SeedResult, check_seeds, seed_folder
from mjcartpole.studies.side_by_side import Stop, side_by_side

OUT_OF_MEMORY: Final = "out of memory"


@dataclass(frozen=True)
class SeedJob:
    """One seed's training, in a form that another process can be given.

    Attributes:
        config: What to train.
        engine: Who runs the loop.
        document: The model's, where it is loaded already.
        folder: The run's, or that of many runs, `seed-<n>`; None keeps nothing.
        preset: Name of the preset that the config began from.
        every: Seconds between two checkpoints.
        events: Whether TensorBoard events are written.
        allow_assets: Folders in which the files of the models of runs that go on may lie.
        evaluated: Whether greedy episodes are played when it is over; always where it is kept.
    """

    config: TrainConfig
    engine: Engine
    document: str | None
    folder: Path | None = None
    preset: str = "custom"
    every: float = CHECKPOINT_EVERY
    events: bool = False
    allow_assets: tuple[Path, ...] = ()
    evaluated: bool = True

    def of(self, seed: int) -> "SeedJob":
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
        self, job: SeedJob, seeds: int | Sequence[int], workers: int | None = None
    ) -> None:
        """Plan the job with these seeds, or so many from its own on; runs that are there go on.

        As many are at work at once as there are cores, if `workers` is left out.

        Raises:
            ConfigError: The seeds or workers make no sense.
        """
        self.seeds = check_seeds(job.config, seeds)
        self.workers = worker_count(workers, len(self.seeds))
        self._job = job
        self._found: dict[int, SeedResult] = {}

    def run(self, stop: Stop) -> Iterator[SeedResult | None]:
        """Train all seeds, or until `stop()` is true.

        Yields each seed's result when it has come, and None now and then while waiting.
        """
        jobs = (self._job.of(seed) for seed in self.seeds)
        # The compiled engine leaves Python's lock alone.
        threads = self._job.engine == "compiled"
        for found in side_by_side(train_seed, jobs, self.workers, stop, threads=threads):
            result = None if found is None else _result_of(found[1], found[0].config.seed)
            if result is not None:
                self._found[result.seed] = result
            yield result

    def result(self) -> ManyResult:
        """Return the seeds that have come to something, in order."""
        found = tuple(self._found[seed] for seed in self.seeds if seed in self._found)
        return ManyResult(self._job.config, found)


def chosen_for(
    config: TrainConfig, cartpole: CartPole, engine: Engine
) -> tuple[Engine, str | None]:
    """Return for a `SeedJob` by which engine it is done, and the document of its model."""
    its = cartpole if config.backend == "mujoco" else None
    return choose_engine(engine, config.backend, its, config.rules), its.xml if its else None


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
    job = SeedJob(config, *chosen_for(config, cartpole, engine), run_dir)
    runner = SeedRunner(job, seeds, workers)
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


def _result_of(future: Future[SeedResult], seed: int) -> SeedResult:
    try:
        return future.result()
    except (BrokenExecutor, OSError) as error:
        # A worker process was killed from outside, or there is no memory for one.
        return SeedResult(seed, error=f"its process ended: {error}")


def train_seed(job: SeedJob, stop: Stop, cartpole: CartPole | None = None) -> SeedResult:
    """Return what a seed comes to; nothing, if it is to stop before it is done.

    The job's model is given if it is loaded already.
    """
    seed = job.config.seed
    if stop():
        return SeedResult(seed)
    try:
        cartpole = cartpole or model_of(job)
        if job.folder is None:
            return _train_in_memory(job, cartpole, stop)
        return _train_on_disk(job, job.folder, cartpole, stop)
    except MjCartPoleError as error:
        return SeedResult(seed, error=str(error))
    except MemoryError:
        return SeedResult(seed, error=OUT_OF_MEMORY)


def model_of(job: SeedJob) -> CartPole:
    """Return the model of a seed's training; it is its own.

    Raises:
        ModelError: It cannot be used.
    """
    if job.document is None:
        return load_model()
    return load_named(job.document, job.config.model, own_timestep=job.config.own_timestep)


def _train_in_memory(job: SeedJob, cartpole: CartPole, stop: Stop) -> SeedResult:
    training = Training(job.config, engine=job.engine, cartpole=cartpole)
    for _ in training.run():
        if stop():
            return SeedResult(job.config.seed)
    result = training.result()
    if not job.evaluated:
        return SeedResult.of(result, None)
    evaluation = evaluate_where_trained(result.policy, job.config, cartpole, job.engine)
    return SeedResult.of(result, evaluation)


def _train_on_disk(job: SeedJob, folder: Path, cartpole: CartPole, stop: Stop) -> SeedResult:
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
def _begun(job: SeedJob, folder: Path, cartpole: CartPole) -> Iterator[Checkpoint | None]:
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


def _check_same(job: SeedJob, folder: Path, config: TrainConfig) -> None:
    if config != job.config:
        raise RunError(f"'{folder}' holds a run with another config")
