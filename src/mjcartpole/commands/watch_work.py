"""What follows from a save of a model that is watched: sketch, parity, training, film."""

import dataclasses
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from mjcartpole.commands.films import what_happened, write_film
from mjcartpole.commands.options import VIDEOS
from mjcartpole.commands.watched_file import POLL, SavedAgainError, Watched
from mjcartpole.errors import MjCartPoleError
from mjcartpole.files import atomic_write
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.evaluation import Evaluation
from mjcartpole.learning.training import Training, TrainResult
from mjcartpole.media.pillow import Image
from mjcartpole.media.renderer import open_renderer
from mjcartpole.output import stdout_problem
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.signals import StopSignals
from mjcartpole.studies.film import play
from mjcartpole.studies.parity import Result, Subject, run_ladder
from mjcartpole.studies.policy_setup import PolicySetup, where_trained
from mjcartpole.studies.video_options import VideoOptions
from mjcartpole.task import Task

RUNGS: Final = (2, 3, 4)
"""Of the ladder: those that take no time."""
VERDICTS: Final = {
    "holds": "as the equations say",
    "fails": "FAILS",
    "beyond": "beyond the equations",
    "skipped": "skipped",
}
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
class WatchWork:
    """All that follows from each save of a file.

    Attributes:
        watched: The file.
        config: How to train on it.
        video: Whether it is filmed.
        signals: Where a signal that shall end it is noted.
    """

    watched: Watched
    config: TrainConfig
    video: bool
    signals: StopSignals

    def go_on(self, once: int | None) -> None:
        """Work on the file now and after every save: so many times, or while somebody looks."""
        print(f"watching {self.watched.path}; Ctrl-C ends it", flush=True)
        done = 0
        while once is None or done < once:
            if done and not self._await_save():
                return
            self.watched.take()
            while not self._is_done():
                self.watched.take()
            done += 1

    def _await_save(self) -> bool:
        """Wait for a save; return false if nobody looks any more."""
        while not self.watched.has_changed():
            if stdout_problem() is not None:
                return False
            time.sleep(POLL)
        return True

    def _is_done(self) -> bool:
        """Work on the file as it is; return false if it was not whole, or is another by now."""
        try:
            self._work()
        except SavedAgainError:
            _say("saved", "again before this was done: starting over")
            return False
        except MjCartPoleError as error:
            if self.watched.goes_on():
                return False
            _say("error", f"{error}")
            _say("waiting", "for the next save")
        return True

    def _work(self) -> None:
        started, name = time.perf_counter(), self.watched.path.stem
        print(f"\n{time.strftime('%H:%M:%S')}  {self.watched.path}", flush=True)
        cartpole = self.config.load_model()
        sketch = VIDEOS / f"{name}-sketch.png"
        _draw_sketch(cartpole, sketch, self.config.rules)
        _say("sketch", f"{sketch}, {time.perf_counter() - started:.1f} s")
        self.watched.check()
        self._hold_against_itself(cartpole)
        result = self._train(cartpole)
        setup = where_trained(name, result.policy, result.config, cartpole)
        _say("greedy", _greedy(setup.evaluate(_count_evaluated(result))))
        self.watched.check()
        if self.video:
            self._film(setup, VIDEOS / f"{name}.mp4")
        _say("done", f"in {time.perf_counter() - started:.1f} s")

    def _hold_against_itself(self, cartpole: CartPole) -> None:
        results = []
        try:
            for result in run_ladder(Subject(cartpole, "itself", quick=True), RUNGS):
                results.append(result)
                self.watched.check()
        except MjCartPoleError as error:
            # A cart-pole whose parameters cannot be read may balance all the same.
            _say("parity", f"the equations do not apply: {error}")
            return
        _say("parity", _verdicts(results))

    def _train(self, cartpole: CartPole) -> TrainResult:
        """Train; with fewer episodes where this model would take too long."""
        asked = episodes = self.config.episodes
        training = Training(self.config, cartpole=cartpole)
        for _ in training.run():
            self.watched.check()
            episodes = affordable(training.result())
            if episodes < asked:
                break
        if episodes < asked:
            _say("training", f"{episodes:,} episodes instead of {asked:,}: it is slow")
            shorter = dataclasses.replace(self.config, episodes=episodes)
            training = Training(shorter, cartpole=cartpole)
            for _ in training.run():
                self.watched.check()
        result = training.result()
        recent = result.returns[-100:]
        _say(
            "training",
            f"{len(result.returns):,} episodes in {result.seconds:.1f} s, "
            f"mean return of the last {len(recent)}: {recent.mean():.1f}",
        )
        return result

    def _film(self, setup: PolicySetup, path: Path) -> None:
        casts = [play(setup)]
        self.watched.check()
        # Shadows and smooth edges would cost more time than all the rest, a sky nearly as much.
        look = VideoOptions(quality="draft", fps=FPS)
        video, drawn_by = write_film(casts, look, path, self.signals, self.watched.check)
        self.signals.raise_noted()
        _say("video", f"{video.path} ({what_happened(casts)}; drawn by {drawn_by})")


def _draw_sketch(cartpole: CartPole, path: Path, task: Task) -> None:
    """Draw a picture that needs no OpenGL, and no waiting."""
    with open_renderer(cartpole, kind="sketch", task=task) as renderer:
        picture = Image.fromarray(renderer.render((0.0, 0.0, *(LEAN, 0.0) * cartpole.poles)))
    with atomic_write(path) as temporary:
        picture.save(temporary)


def _verdicts(results: list[Result]) -> str:
    """Return one line: what holds, and why the rest does not."""
    phrases = []
    for verdict, words in VERDICTS.items():
        rungs = [str(result.rung) for result in results if result.verdict == verdict]
        if rungs:
            phrases.append(f"{words} (rung {', '.join(rungs)})")
    return "; ".join([*phrases, *sorted({result.skipped for result in results} - {""})])


def affordable(now: TrainResult) -> int:
    """Return how many episodes there is time for, should all of them last to the time limit."""
    asked = now.config.episodes
    if now.seconds < _TRIAL:
        return asked
    seconds_per_episode = now.seconds / now.steps * now.config.rules.time_limit
    left = asked - len(now.returns)
    if now.seconds + left * seconds_per_episode <= PATIENCE:
        return asked
    return min(asked, max(_LEAST_EPISODES, int(PATIENCE / seconds_per_episode)))


def _count_evaluated(result: TrainResult) -> int:
    """Return how many greedy episodes there is time for, should all last to the time limit."""
    seconds_per_episode = result.seconds / max(result.steps, 1) * result.config.rules.time_limit
    return max(_LEAST_EVALUATED, min(EVALUATED, int(EVALUATION_PATIENCE / seconds_per_episode)))


def _greedy(evaluation: Evaluation) -> str:
    returns = evaluation.returns
    endings = ", ".join(f"{count} {how}" for how, count in evaluation.endings.items() if count)
    return (
        f"mean return {returns.mean():.1f}, minimum {returns.min():.0f} "
        f"of {len(returns)} episodes ({endings})"
    )


def _say(what: str, text: str) -> None:
    print(f"  {what:9s} {text}", flush=True)
