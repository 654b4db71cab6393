"""What follows from a save of a model that is watched: sketch, parity, training, film."""

import dataclasses
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from PIL import Image

from mjcartpole.commands.films import raise_noted, what_happened, write_film
from mjcartpole.commands.options import VIDEOS
from mjcartpole.commands.watched_file import POLL, SavedAgainError, Watched
from mjcartpole.errors import MjCartPoleError
from mjcartpole.files import atomic_write
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.training import Training, TrainResult
from mjcartpole.media.renderer import open_renderer
from mjcartpole.output import stdout_problem
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.signals import StopSignals
from mjcartpole.studies.evaluation import Evaluation, evaluate
from mjcartpole.studies.film import PolicySetup, play
from mjcartpole.studies.parity import Result, Subject, run_ladder
from mjcartpole.studies.video_options import VideoOptions
from mjcartpole.task import CARTPOLE_V1

RUNGS: Final = (2, 3, 4)
"""Of the ladder: those that take no time."""
LEAN: Final = 0.1
"""How far the pole leans in the sketch, rad."""
EVALUATED: Final = 50
"""Greedy episodes."""
EVALUATION_PATIENCE: Final = 2.0
"""Seconds that these may take, if need be with fewer of them."""
PATIENCE: Final = 6.0
"""Seconds that a training may take at most, if need be with fewer episodes."""
FPS: Final = 25.0
"""Frames per second of the video."""
_TRIAL: Final = 0.5
"""Seconds of training after which it is known how long the rest will take."""
_LEAST_EPISODES: Final = 20
_LEAST_EVALUATED: Final = 3


@dataclass(frozen=True)
class Recipe:
    """What follows from a save.

    Attributes:
        signals: Where a signal that shall end it is noted.
        config: How to train; the model is the file's.
        video: Whether there is a video.
    """

    signals: StopSignals
    config: TrainConfig
    video: bool


def work_on_saves(watched: Watched, recipe: Recipe, once: int | None) -> None:
    """Work on the file as it is, and after every save.

    Args:
        watched: The file.
        recipe: What is done.
        once: How often; None: until Ctrl-C, or until nobody looks any more.
    """
    print(f"watching {watched.path}; Ctrl-C ends it", flush=True)
    done = 0
    watched.take()
    while True:
        try:
            _follow(watched, recipe)
        except SavedAgainError:
            _say("saved", "again before this was done: starting over")
            watched.take()
            continue
        except MjCartPoleError as error:
            if watched.goes_on():
                watched.take()
                continue
            _say("error", f"{error}")
            _say("waiting", "for the next save")
        done += 1
        if once is not None and done >= once:
            return
        while not watched.has_changed():
            if stdout_problem() is not None:
                return  # Nobody looks any more.
            time.sleep(POLL)
        watched.take()


def _follow(watched: Watched, recipe: Recipe) -> None:
    """Do all that follows from a save.

    Raises:
        SavedAgainError: The file was saved meanwhile.
        MjCartPoleError: Something cannot be done with this model.
    """
    started = time.perf_counter()
    print(f"\n{time.strftime('%H:%M:%S')}  {watched.path}", flush=True)
    cartpole, name = recipe.config.load_model(), watched.path.stem
    _sketch(cartpole, VIDEOS / f"{name}-sketch.png", started)
    watched.check()
    _hold_against_itself(cartpole, watched)
    result = _train(recipe.config, cartpole, watched)
    evaluation = evaluate(
        result.policy,
        model=cartpole,
        integrator=result.config.integrator,
        episodes=_count_evaluated(result),
    )
    _say("greedy", _greedy(evaluation))
    watched.check()
    if recipe.video:
        setup = PolicySetup(name, result.policy, "mujoco", cartpole, result.config.integrator)
        _film(setup, VIDEOS / f"{name}.mp4", watched, recipe.signals)
    _say("done", f"in {time.perf_counter() - started:.1f} s")


def _sketch(cartpole: CartPole, path: Path, started: float) -> None:
    """A picture that needs no OpenGL, and no waiting."""
    with open_renderer(cartpole, kind="sketch") as renderer:
        picture = Image.fromarray(renderer.render((0.0, 0.0, *(LEAN, 0.0) * cartpole.poles)))
    with atomic_write(path) as temporary:
        picture.save(temporary)
    _say("sketch", f"{path}, {time.perf_counter() - started:.1f} s")


def _hold_against_itself(cartpole: CartPole, watched: Watched) -> None:
    try:
        subject = Subject(cartpole, "itself", quick=True)
        results = []
        for result in run_ladder(subject, RUNGS):
            results.append(result)
            watched.check()
    except MjCartPoleError as error:
        # A cart-pole whose parameters cannot be read may balance all the same.
        _say("parity", f"the equations do not apply: {error}")
        return
    _say("parity", _verdicts(results))


def _verdicts(results: list[Result]) -> str:
    """One line: what holds, and why the rest does not."""
    phrases = []
    for verdict, words in (
        ("holds", "as the equations say"),
        ("fails", "FAILS"),
        ("beyond", "beyond the equations"),
        ("skipped", "skipped"),
    ):
        rungs = [str(result.rung) for result in results if result.verdict == verdict]
        if rungs:
            phrases.append(f"{words} (rung {', '.join(rungs)})")
    reasons = {result.skipped for result in results if result.skipped}
    return "; ".join([*phrases, *sorted(reasons)])


def _train(config: TrainConfig, cartpole: CartPole, watched: Watched) -> TrainResult:
    """Train; with fewer episodes where this model would take too long."""
    training = Training(config, cartpole=cartpole)
    for _ in training.run():
        watched.check()
        episodes = affordable(training.result())
        if episodes < config.episodes:
            _say("training", f"{episodes:,} episodes instead of {config.episodes:,}: it is slow")
            training = Training(dataclasses.replace(config, episodes=episodes), cartpole=cartpole)
            for _ in training.run():
                watched.check()
            break
    result = training.result()
    recent = result.returns[-100:]
    _say(
        "training",
        f"{len(result.returns):,} episodes in {result.seconds:.1f} s, "
        f"mean return of the last {len(recent)}: {recent.mean():.1f}",
    )
    return result


def affordable(now: TrainResult) -> int:
    """How many episodes there is time for, should all of them last to the time limit."""
    asked = now.config.episodes
    if now.seconds < _TRIAL:
        return asked
    seconds_per_episode = now.seconds / now.steps * CARTPOLE_V1.time_limit
    left = asked - len(now.returns)
    if now.seconds + left * seconds_per_episode <= PATIENCE:
        return asked
    return min(asked, max(_LEAST_EPISODES, int(PATIENCE / seconds_per_episode)))


def _count_evaluated(result: TrainResult) -> int:
    """How many greedy episodes there is time for, should all of them last to the time limit."""
    seconds_per_episode = result.seconds / max(result.steps, 1) * CARTPOLE_V1.time_limit
    return max(_LEAST_EVALUATED, min(EVALUATED, int(EVALUATION_PATIENCE / seconds_per_episode)))


def _greedy(evaluation: Evaluation) -> str:
    returns = evaluation.returns
    endings = ", ".join(f"{count} {how}" for how, count in evaluation.endings.items() if count)
    return (
        f"mean return {returns.mean():.1f}, minimum {returns.min():.0f} "
        f"of {len(returns)} episodes ({endings})"
    )


def _film(setup: PolicySetup, path: Path, watched: Watched, signals: StopSignals) -> None:
    casts = [play(setup)]
    watched.check()
    # Shadows and smooth edges would cost more time than all the rest, a sky nearly as much.
    look = VideoOptions(quality="draft", fps=FPS)
    video, drawn_by = write_film(casts, look, path, signals, watched.check)
    raise_noted(signals)
    _say("video", f"{video.path} ({what_happened(casts)}; drawn by {drawn_by})")


def _say(what: str, text: str) -> None:
    print(f"  {what:9s} {text}", flush=True)
