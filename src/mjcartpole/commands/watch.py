"""What `mjcartpole watch` does and prints: on every save of a model, all that follows from it."""

import contextlib
import dataclasses
import hashlib
import time
from collections.abc import Callable, Generator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from PIL import Image

from mjcartpole.commands.evaluate import VIDEOS
from mjcartpole.errors import ConfigError, MjCartPoleError
from mjcartpole.files import atomic_write, check_writable, make_folder
from mjcartpole.integrator import Integrator, check_integrator
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.training import Training, TrainResult
from mjcartpole.media.renderer import open_renderer
from mjcartpole.media.video import write_video
from mjcartpole.output import stdout_problem
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.includes import read_whole
from mjcartpole.physics.load import find_model
from mjcartpole.physics.simulation import silence_mujoco
from mjcartpole.signals import Interrupted, StopSignals
from mjcartpole.studies.evaluation import Evaluation, evaluate
from mjcartpole.studies.film import Film, Frame, PolicySetup, VideoOptions, play
from mjcartpole.studies.parity import Result, Subject, run_ladder
from mjcartpole.task import CARTPOLE_V1

POLL: Final = 0.2
"""Seconds between two looks at the file."""
SETTLE: Final = 0.05
"""Seconds that a file must stay as it is: some editors empty it before they write it."""
PIECES: Final = 0.4
"""Seconds after which a broken file is taken for whole: some programs write in pieces."""
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


class _SavedAgainError(Exception):
    """The file is not what it was when the work began."""


class Watched:
    """A model's file, together with what it includes.

    Attributes:
        path: Where it is.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._seen = ""
        self._looked = 0.0

    def is_there(self) -> bool:
        """Whether there is a file at this moment; editors replace it by renaming another."""
        return self.path.is_file()

    def take(self) -> None:
        """Take what is there now as known."""
        self._seen = self._mark()

    def has_changed(self) -> bool:
        """Whether something else is there than what was taken, and is no longer being written."""
        if self._mark() == self._seen or not self.is_there():
            return False
        before = None
        while (mark := self._mark()) != before:
            before = mark
            time.sleep(SETTLE)
        return mark != self._seen and self.is_there()

    def goes_on(self) -> bool:
        """Whether more of the file is written in a moment."""
        until = time.monotonic() + PIECES
        while self._mark() == self._seen:
            if time.monotonic() > until:
                return False
            time.sleep(SETTLE)
        return True

    def check(self) -> None:
        """Raise `_SavedAgainError` if it has changed; it looks only now and then."""
        now = time.monotonic()
        if now - self._looked >= POLL:
            self._looked = now
            if self.has_changed():
                raise _SavedAgainError

    def _mark(self) -> str:
        """What the file and its includes say, in short: a touched file is no change."""
        try:
            text = self.path.read_bytes()
        except OSError:
            return "nothing"
        mark = hashlib.sha256(text)
        if b"<include" in text:
            try:
                whole = read_whole(text.decode("utf-8"), str(self.path), self.path.parent).text
            except (UnicodeDecodeError, MjCartPoleError) as error:
                whole = str(error)
            mark.update(whole.encode())
        return mark.hexdigest()


@dataclass(frozen=True)
class Recipe:
    """What follows from a save.

    Attributes:
        signals: Where a signal that shall end it is noted.
        config: How to train; the model is the file's.
        video: Whether there is a video.
        videos: Folder for sketch and video.
    """

    signals: StopSignals
    config: TrainConfig
    video: bool = True
    videos: Path = VIDEOS


def run_watch(
    path: Path,
    *,
    preset: str = "tuned",
    episodes: int | None = None,
    integrator: Integrator = "gym",
    own_timestep: bool = False,
    seed: int = 0,
    video: bool = True,
    once: int | None = None,
    videos: Path = VIDEOS,
) -> int:
    """Show what a model comes to, now and after every save. Returns the exit code.

    Args:
        path: An MJCF file; also the name of a model that comes with the package.
        preset: How to train; see `TrainConfig.preset`.
        episodes: Episodes to train; the preset's if left out.
        integrator: See `Simulation`.
        own_timestep: See `load_model`.
        seed: Seeds the training.
        video: Film the result.
        once: End after so many saves, the first look included; None: go on until Ctrl-C.
        videos: Folder for sketch and video.

    Raises:
        ModelNotFoundError: There is no such file.
        ConfigError: A setting makes no sense.
        Interrupted: After Ctrl-C, SIGTERM or SIGHUP.
    """
    silence_mujoco()
    check_integrator(integrator)
    if once is not None and once < 1:
        raise ConfigError(f"once must be a whole number from 1 up, not {once}")
    changes: dict[str, Any] = {} if episodes is None else {"episodes": episodes}
    file = find_model(path)
    config = TrainConfig.preset(
        preset,
        model=str(file),
        integrator=integrator,
        own_timestep=own_timestep,
        seed=seed,
        **changes,
    )
    check_writable(make_folder(videos))
    signals = StopSignals()
    with signals.caught():
        try:
            _watch(Watched(file), Recipe(signals, config, video, videos), once)
        except Interrupted:
            raise Interrupted(f"no longer watching {file}", signals.number) from None
    return 0


def _watch(watched: Watched, recipe: Recipe, once: int | None) -> None:
    print(f"watching {watched.path}; Ctrl-C ends it", flush=True)
    done = 0
    watched.take()
    while True:
        try:
            _follow(watched, recipe)
        except _SavedAgainError:
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
        _SavedAgainError: The file was saved meanwhile.
        MjCartPoleError: Something cannot be done with this model.
    """
    started = time.perf_counter()
    print(f"\n{time.strftime('%H:%M:%S')}  {watched.path}", flush=True)
    cartpole, name = recipe.config.load_model(), watched.path.stem
    _sketch(cartpole, recipe.videos / f"{name}-sketch.png", started)
    watched.check()
    _hold_against_itself(cartpole, watched.check)
    result = _train(recipe.config, cartpole, watched.check)
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
        path = recipe.videos / f"{name}.mp4"
        _film(setup, path, watched.check, recipe.signals)
    _say("done", f"in {time.perf_counter() - started:.1f} s")


def _sketch(cartpole: CartPole, path: Path, started: float) -> None:
    """A picture that needs no OpenGL, and no waiting."""
    with open_renderer(cartpole, kind="sketch") as renderer:
        picture = Image.fromarray(renderer.render((0.0, 0.0, *(LEAN, 0.0) * cartpole.poles)))
    with atomic_write(path) as temporary:
        picture.save(temporary)
    _say("sketch", f"{path}, {time.perf_counter() - started:.1f} s")


def _hold_against_itself(cartpole: CartPole, check: Callable[[], None]) -> None:
    try:
        subject = Subject(cartpole, "itself", quick=True)
        results = []
        for result in run_ladder(subject, RUNGS):
            results.append(result)
            check()
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


def _train(config: TrainConfig, cartpole: CartPole, check: Callable[[], None]) -> TrainResult:
    """Train; with fewer episodes where this model would take too long."""
    training = Training(config, cartpole=cartpole)
    for _ in training.run():
        check()
        episodes = _affordable(training.result())
        if episodes < config.episodes:
            _say("training", f"{episodes:,} episodes instead of {config.episodes:,}: it is slow")
            training = Training(dataclasses.replace(config, episodes=episodes), cartpole=cartpole)
            for _ in training.run():
                check()
            break
    result = training.result()
    recent = result.returns[-100:]
    _say(
        "training",
        f"{len(result.returns):,} episodes in {result.seconds:.1f} s, "
        f"mean return of the last {len(recent)}: {recent.mean():.1f}",
    )
    return result


def _affordable(now: TrainResult) -> int:
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


def _film(setup: PolicySetup, path: Path, check: Callable[[], None], signals: StopSignals) -> None:
    take = play(setup)[0]
    check()
    # Shadows and smooth edges would cost more time than all the rest, a sky nearly as much.
    look = VideoOptions(quality="draft", fps=FPS)
    # A signal raised in the midst of OpenGL would be lost: it is looked at between frames.
    with signals.deferred(), Film([[take]], look) as film:
        with contextlib.closing(_checked(film, check, signals)) as frames:
            video = write_video(path, frames, fps=FPS)
        drawn_by = film.drawn_by
    about = f"{take.episode.steps} steps, {take.episode.ending}"
    _say("video", f"{video.path} ({about}; drawn by {drawn_by})")


def _checked(film: Film, check: Callable[[], None], signals: StopSignals) -> Generator[Frame]:
    for frame in film.frames():
        check()
        if signals.stop():
            raise Interrupted(number=signals.number)
        yield frame
    if signals.stop():
        raise Interrupted(number=signals.number)


def _say(what: str, text: str) -> None:
    print(f"  {what:9s} {text}", flush=True)
