"""One training, new or continued: trained, evaluated, filmed, and told of."""

from pathlib import Path

from mjcartpole.commands.options import VIDEOS
from mjcartpole.commands.own_films import remove_film
from mjcartpole.commands.printing import counted, print_evaluation
from mjcartpole.commands.progress import train_session
from mjcartpole.commands.train_options import RunLocation, TrainOptions
from mjcartpole.commands.train_shared import (
    about,
    changes,
    check,
    draw_curve,
    go_on,
    prepare,
    unfinished,
)
from mjcartpole.errors import RenderError
from mjcartpole.files import check_writable, make_folder
from mjcartpole.learning import runs
from mjcartpole.learning.checkpoints import LATEST
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.runs import Begun
from mjcartpole.learning.session import Session
from mjcartpole.learning.training import Training, TrainResult
from mjcartpole.packages import is_installed, missing
from mjcartpole.signals import Interrupted, StopSignals
from mjcartpole.studies.finish_training import finish_training


def train(config: TrainConfig, how: TrainOptions, where: RunLocation) -> int:
    """Train, evaluate, film; print what came out. Returns the exit code.

    Raises:
        Interrupted: After Ctrl-C, SIGTERM or SIGHUP, when what was learned is kept; says where.
    """
    cartpole = prepare(config, how)
    folder = where.folder(config)
    begun = Begun(folder, where.preset, how.video, config, cartpole, checkpoint=None)
    _check_film(begun, how)
    signals = StopSignals()
    with signals.caught(), runs.claimed_folder(folder, overwrite=where.overwrite):
        if how.video:
            check_writable(make_folder(VIDEOS))
        session = _session(begun, how)
        print(
            f"{where.preset} on {config.backend}: {counted(config.episodes, config.episode)}, "
            f"seed {config.seed}{about(where, folder, config)}",
            flush=True,
        )
        remove_film(folder)
        runs.begin_run(folder, config, cartpole, preset=where.preset, video=how.video)
        _finish(session, begun, how, signals)
    return 0


def resume(path: Path, how: TrainOptions) -> int:
    """Continue a training as if it had not been interrupted. Returns the exit code.

    Raises:
        Interrupted: Again; see `train`.
    """
    check(how)
    folder = runs.run_folder(path)
    if path == folder and runs.is_complete(folder):
        runs.check_complete(folder, how.allow_assets)
        print(f"{folder} is complete: nothing is left to do{unfinished(folder)}")
        return 0
    signals = StopSignals()
    with signals.caught(), runs.resumed_folder(path, how.allow_assets) as begun:
        _check_film(begun, how)
        config, session = begun.config, _session(begun, how)
        print(
            f"{begun.preset} on {config.backend}: goes on after {_done(session)}, "
            f"seed {config.seed}{changes(begun.preset, config)}",
            flush=True,
        )
        _finish(session, begun, how, signals)
    return 0


def _check_film(begun: Begun, how: TrainOptions) -> None:
    """Refuse a film that could not be drawn, before anything is trained."""
    if how.video and begun.video and not is_installed("PIL"):
        raise RenderError(f"{missing('a film', 'PIL')}; or leave it out: --no-video")


def _session(begun: Begun, how: TrainOptions) -> Session:
    training = Training(begun.config, engine=how.engine, cartpole=begun.cartpole)
    session = Session(begun.folder, training, begun.cartpole, every=how.checkpoint_every)
    session.resume(begun.checkpoint)
    return session


def _finish(session: Session, begun: Begun, how: TrainOptions, signals: StopSignals) -> None:
    """Train to the end or to a signal; write, print, evaluate and film."""
    folder = begun.folder
    try:
        with signals.deferred():
            train_session(session, signals)
            events = how.tensorboard or runs.has_events(folder)
            result, summary, greedy = finish_training(
                session, folder, begun.cartpole, preset=begun.preset, events=events
            )
        _print_learning(result)
        if "stopped" in summary:
            after = f"{result.config.episode} {summary['episodes']:,}"
            print(f"\nstopped after {after}: {summary['stopped']}")
        if signals.stop() or greedy is None:
            raise Interrupted(number=signals.number)
        print_evaluation(greedy)
        print(f"\nrun    {folder}", flush=True)
        if how.video and begun.video:
            from mjcartpole.commands.films import film_result

            film_result(result, begun.cartpole, folder, summary, signals)
        runs.finish_run(folder)
        draw_curve(folder, how)
    except Interrupted as interrupted:
        said = f"interrupted after {_done(session)}{_kept(folder)}"
        raise Interrupted(said, signals.number) from interrupted


def _done(session: Session) -> str:
    training = session.training
    return f"{len(training.log):,} of {counted(training.config.episodes, training.config.episode)}"


def _kept(folder: Path) -> str:
    if not (folder / LATEST).exists():
        return ", before anything was saved"
    return f"; what was learned is kept in {folder}; go on with: {go_on(folder)}"


def _print_learning(result: TrainResult) -> None:
    """Print the article's table, mean return of each `log_every` episodes, and greedy means."""
    if result.seen is not None:
        episodes, steps = result.seen
        print(
            f"\nfitted to {counted(steps, 'step')} in {counted(episodes, 'episode')} of the world; "
            "the returns below are dreamt in that model, greedy ones are real"
        )
    returns, every = result.returns, result.config.log_every
    # The last evaluation of each block stands beside it.
    greedy = {(point.episodes - 1) // every: point.mean for point in result.evaluations}
    print(f"\n episode   mean return{'   greedy mean' if greedy else ''}")
    for number, start in enumerate(range(0, len(returns), every)):
        block = returns[start : start + every]
        beside = f" {greedy[number]:13.1f}" if number in greedy else ""
        print(f"{start + len(block):8,} {block.mean():13.1f}{beside}")
