"""Many seeds at once, as one call."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.engine import Engine
from mjcartpole.learning.run_model import check_storable
from mjcartpole.studies import multi_seed_runs
from mjcartpole.studies.multi_seed import ManyResult, SeedResult, SeedRunner


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
    config.discretizer(cartpole.poles)
    if run_dir is None:
        runner = SeedRunner(config, seeds, cartpole, workers=workers, engine=engine)
        return _finished(runner, runner.run(_never))
    check_storable(cartpole)
    runner = SeedRunner(
        config, seeds, cartpole, workers=workers, engine=engine, folder=run_dir, preset="custom"
    )
    with multi_seed_runs.claimed_seeds(run_dir, overwrite=overwrite):
        multi_seed_runs.begin_seeds(run_dir, config, runner.seeds, cartpole, preset="custom")
        many = _finished(runner, runner.run(_never))
        multi_seed_runs.write_seeds(run_dir, many)
    return many


def _never() -> bool:
    return False


def _finished(runner: SeedRunner, work: Iterator[SeedResult | None]) -> ManyResult:
    for _ in work:
        pass
    return runner.result()
