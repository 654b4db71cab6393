"""What `train` does and prints."""

import dataclasses
import shlex
import sys
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeRemainingColumn,
)
from rich.text import Text

from mjcartpole.commands.evaluate import RUNS, VIDEOS, counted, print_evaluation, print_seeds
from mjcartpole.commands.render import film_result, remove_film
from mjcartpole.errors import ConfigError
from mjcartpole.files import check_writable, is_file, make_folder
from mjcartpole.learning import runs, tensorboard
from mjcartpole.learning.checkpoints import LATEST
from mjcartpole.learning.compiling import compiling
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.documents import CONFIG
from mjcartpole.learning.engine import Engine
from mjcartpole.learning.folders import SEEDS, free_folder
from mjcartpole.learning.naming import in_flags, namesakes, run_name
from mjcartpole.learning.run_model import check_storable
from mjcartpole.learning.session import CHECKPOINT_EVERY, Session, check_interval
from mjcartpole.learning.training import Training, TrainResult
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.playable import why_unplayable
from mjcartpole.physics.simulation import silence_mujoco
from mjcartpole.signals import Interrupted, StopSignals
from mjcartpole.studies import multi_seed_runs
from mjcartpole.studies.finish_training import finish_training
from mjcartpole.studies.multi_seed import SeedRunner

RUNNING_MEAN = 100
"""Episodes in the progress bar's mean."""

FAILED = 2


@dataclass(frozen=True)
class TrainOptions:
    """How to train; nothing of this changes what is learned.

    Attributes:
        engine: Who runs the loop.
        checkpoint_every: Seconds between two checkpoints.
        workers: How many seeds at once; None: as many as there are cores.
        video: Film the result.
        tensorboard: Write TensorBoard events.
        allow_assets: Other folders in which the files of the model of a resumed run may lie.
    """

    engine: Engine = "compiled"
    checkpoint_every: float = CHECKPOINT_EVERY
    workers: int | None = None
    video: bool = True
    tensorboard: bool = False
    allow_assets: tuple[Path, ...] = ()


@dataclass(frozen=True)
class RunLocation:
    """What a run is called and where it goes.

    Attributes:
        preset: Name of the preset that the config began from.
        run_dir: The folder; None: a new one in runs/.
        overwrite: Replace the run that is there.
    """

    preset: str
    run_dir: Path | None = None
    overwrite: bool = False

    def folder(self, config: TrainConfig, seeds: int = 1) -> Path:
        """The run's folder: with overwrite the very one, else one that is not there yet."""
        name = run_name(self.preset, config, seeds)
        return self.run_dir or (RUNS / name if self.overwrite else free_folder(RUNS, name))

    def about(self, folder: Path, config: TrainConfig, seeds: int = 1) -> str:
        """What a header says of a run: what was changed, and where it goes if its name is taken."""
        first = RUNS / run_name(self.preset, config, seeds)
        if self.run_dir or folder == first:
            return _changes(self.preset, config)
        there = f"\n{first} is there already: this goes to {folder}{_unfinished(folder)}"
        return _changes(self.preset, config) + there


def run_train(config: TrainConfig, how: TrainOptions, where: RunLocation) -> int:
    """Train, evaluate, film; print what came out. Returns the exit code.

    Raises:
        Interrupted: After Ctrl-C, SIGTERM or SIGHUP, when what was learned is kept; says where.
    """
    cartpole = _prepare(config, how)
    folder, preset = where.folder(config), where.preset
    signals = StopSignals()
    with signals.caught(), runs.claimed_folder(folder, overwrite=where.overwrite):
        if how.video:
            check_writable(make_folder(VIDEOS))
        training = Training(config, engine=how.engine, cartpole=cartpole)
        print(
            f"{preset} on {config.backend}: {counted(config.episodes, 'episode')}, "
            f"seed {config.seed}" + where.about(folder, config),
            flush=True,
        )
        remove_film(folder)
        runs.begin_run(folder, config, cartpole, preset=preset, video=how.video)
        session = Session(folder, training, cartpole, every=how.checkpoint_every)
        _conduct(session, folder, cartpole, preset, how, signals)
    return 0


def run_resume(path: Path, how: TrainOptions) -> int:
    """Continue a training, or that of many seeds, as if it had not been interrupted.

    Raises:
        Interrupted: Again; see `run_train`.
    """
    silence_mujoco()
    _check(how)
    if SEEDS in runs.content_of(path):
        return _resume_seeds(path, how)
    if how.workers is not None:
        raise ConfigError("--workers is for several --seeds")
    folder = runs.run_folder(path)
    if path == folder and runs.is_complete(folder):
        runs.check_complete(folder, how.allow_assets)
        print(f"{folder} is complete: nothing is left to do{_unfinished(folder)}")
        return 0
    signals = StopSignals()
    with signals.caught(), runs.resumed_folder(path, how.allow_assets) as begun:
        config, how = begun.config, dataclasses.replace(how, video=how.video and begun.video)
        training = Training(config, engine=how.engine, cartpole=begun.cartpole)
        session = Session(folder, training, begun.cartpole, every=how.checkpoint_every)
        session.resume(begun.checkpoint)
        print(
            f"{begun.preset} on {config.backend}: goes on after {len(training.log):,} of "
            f"{counted(config.episodes, 'episode')}, seed {config.seed}"
            f"{_changes(begun.preset, config)}",
            flush=True,
        )
        _conduct(session, folder, begun.cartpole, begun.preset, how, signals)
    return 0


def run_seeds(config: TrainConfig, how: TrainOptions, where: RunLocation, *, seeds: int) -> int:
    """Train many seeds side by side, and print statistics over them. Returns the exit code.

    Raises:
        Interrupted: After Ctrl-C, SIGTERM or SIGHUP, when what was learned is kept; says where.
    """
    cartpole = _prepare(config, how)
    folder, preset = where.folder(config, seeds), where.preset
    runner = _runner(config, seeds, cartpole, folder, preset, how)
    signals = StopSignals()
    with signals.caught(), multi_seed_runs.claimed_seeds(folder, overwrite=where.overwrite):
        multi_seed_runs.begin_seeds(folder, config, runner.seeds, cartpole, preset=preset)
        return _conduct_seeds(
            runner, config, where.about(folder, config, seeds), folder, preset, signals
        )


def _resume_seeds(folder: Path, how: TrainOptions) -> int:
    signals = StopSignals()
    with signals.caught(), multi_seed_runs.resumed_seeds(folder, how.allow_assets) as begun:
        runner = _runner(begun.config, begun.seeds, begun.cartpole, folder, begun.preset, how)
        about = _changes(begun.preset, begun.config)
        return _conduct_seeds(runner, begun.config, about, folder, begun.preset, signals)


def _prepare(config: TrainConfig, how: TrainOptions) -> CartPole:
    """Check all that can be checked before a folder is touched; returns the model."""
    silence_mujoco()
    _check(how)
    cartpole = config.load_model()
    config.discretizer(cartpole.poles)
    check_storable(cartpole)
    why = why_unplayable(cartpole, config.integrator) if config.backend == "mujoco" else None
    if why:
        print(f"mjcartpole: {why}", file=sys.stderr)
    return cartpole


def _check(how: TrainOptions) -> None:
    check_interval(how.checkpoint_every)
    if how.tensorboard:
        tensorboard.check_installed()


def _conduct(
    session: Session,
    folder: Path,
    cartpole: CartPole,
    preset: str,
    how: TrainOptions,
    signals: StopSignals,
) -> None:
    """Train to the end or to a signal; write, print, evaluate and film."""
    config = session.training.config
    try:
        with signals.deferred():
            _train_with_progress(session, signals)
            result, summary, greedy = finish_training(
                session,
                folder,
                cartpole,
                preset=preset,
                events=how.tensorboard or runs.has_events(folder),
            )
        _print_learning(result)
        if signals.stop() or greedy is None:
            raise Interrupted(number=signals.number)
        print_evaluation(greedy)
        print(f"\nrun    {folder}", flush=True)
        if how.video:
            film_result(result, cartpole, folder, summary, signals)
        runs.finish_run(folder)
    except Interrupted as interrupted:
        raise Interrupted(
            f"interrupted after {len(session.training.log):,} of "
            f"{counted(config.episodes, 'episode')}" + _kept(folder),
            signals.number,
        ) from interrupted


def _kept(folder: Path) -> str:
    if not (folder / LATEST).exists():
        return ", before anything was saved"
    return f"; what was learned is kept in {folder}; go on with: {_resume(folder)}"


def _resume(folder: Path) -> str:
    return f"mjcartpole train --resume {shlex.quote(str(folder))}"


def _changes(preset: str, config: TrainConfig) -> str:
    flags = in_flags(preset, config)
    return f", with {flags}" if flags else ""


def _unfinished(folder: Path) -> str:
    """How to go on with runs of the same name, but for its number, that are not complete."""
    begun = [path for path in namesakes(folder) if is_file(path / CONFIG)]
    hints = [_resume(path) for path in begun if path != folder and not runs.is_complete(path)]
    return f"; unfinished beside it: {', '.join(hints)}" if hints else ""


def _train_with_progress(session: Session, signals: StopSignals) -> None:
    columns = (
        _Doing(),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("episodes, mean return {task.fields[mean]:5.1f}"),
        TimeRemainingColumn(),
    )
    training = session.training
    with _progress(*columns) as progress:
        done = len(training.log)
        bar = progress.add_task("", total=training.config.episodes, completed=done, mean=0.0)
        for finished in session.run(signals.stop):
            recent = training.log.storage.totals[max(0, finished - RUNNING_MEAN) : finished]
            progress.update(bar, completed=finished, mean=recent.mean())
    if progress.console.is_terminal:
        # No two runs take the same time: what stdout says is the same each time.
        result = training.result()
        rate = result.steps / result.seconds if result.seconds else 0.0
        speed = f"{result.steps:,} steps in {result.seconds:.1f} s ({rate:,.0f} per second)"
        print(speed, file=sys.stderr, flush=True)


def _runner(
    config: TrainConfig,
    seeds: int | tuple[int, ...],
    cartpole: CartPole,
    folder: Path,
    preset: str,
    how: TrainOptions,
) -> SeedRunner:
    return SeedRunner(
        config,
        seeds,
        cartpole,
        workers=how.workers,
        engine=how.engine,
        folder=folder,
        preset=preset,
        every=how.checkpoint_every,
        events=how.tensorboard,
        allow_assets=how.allow_assets,
    )


def _conduct_seeds(
    runner: SeedRunner,
    config: TrainConfig,
    about: str,
    folder: Path,
    preset: str,
    signals: StopSignals,
) -> int:
    """Train all seeds or to a signal; write and print."""
    print(
        f"{preset} on {config.backend}: {counted(len(runner.seeds), 'seed')} from "
        f"{runner.seeds[0]}, "
        f"{counted(config.episodes, 'episode')} each, {runner.workers} at once{about}\n",
        flush=True,
    )
    columns = (_Doing(), BarColumn(), MofNCompleteColumn(), TextColumn("seeds"))
    with _progress(*columns) as progress, signals.deferred():
        bar = progress.add_task("", total=len(runner.seeds))
        for found in runner.run(signals.stop):
            progress.update(bar, advance=0 if found is None else 1)
    many = runner.result()
    multi_seed_runs.write_seeds(folder, many)
    print_seeds(many)
    print(f"\nruns   {folder}", flush=True)
    if signals.stop():
        done = len(many.scores)
        raise Interrupted(
            f"interrupted with {done} of {len(runner.seeds)} seeds done; what was learned is kept "
            f"in {folder}; go on with: {_resume(folder)}",
            signals.number,
        )
    for found in many.failed:
        print(f"mjcartpole: error: seed {found.seed} failed: {found.error}", file=sys.stderr)
    return FAILED if many.failed else 0


def _print_learning(result: TrainResult) -> None:
    """The article's table: mean return of each `log_every` episodes."""
    returns, every = result.returns, result.config.log_every
    print("\n episode   mean return")
    for start in range(0, len(returns), every):
        block = returns[start : start + every]
        print(f"{start + len(block):8,} {block.mean():13.1f}")


class _Doing(ProgressColumn):
    def render(self, task: Task) -> Text:
        return Text("compiling" if compiling else "training")


def _progress(*columns: ProgressColumn) -> Progress:
    console = Console(stderr=True)
    return Progress(*columns, console=console, transient=True, disable=not console.is_terminal)
