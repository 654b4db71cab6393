"""Greedy episodes as pictures: played first, then drawn frame by frame."""

import contextlib
import functools
import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from mjcartpole.envs.backend import make_env
from mjcartpole.learning.episodes import ENDINGS, Episode
from mjcartpole.learning.evaluation import check_count, player
from mjcartpole.learning.loop import play_episode
from mjcartpole.learning.policy import Policy
from mjcartpole.media.hud import Moment
from mjcartpole.media.montage import equally_spaced, sheet, side_by_side, state_at, time_label
from mjcartpole.media.overlay import Overlay
from mjcartpole.media.renderer import open_renderer
from mjcartpole.media.turns import Renderer
from mjcartpole.studies.policy_setup import PolicySetup
from mjcartpole.studies.video_options import VideoOptions
from mjcartpole.task import worst_pole

_ROUNDING: Final = 1e-6
"""More than what a place can be off by, in control steps."""

Frame = npt.NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Rollout:
    """One episode as it was played.

    Attributes:
        setup: Who played, and where.
        episode: What it came to.
        states: From the first to the last, one row each, shape (steps + 1, 4) with one pole.
        seen: What the policy saw before each step.
    """

    setup: PolicySetup
    episode: Episode
    states: npt.NDArray[np.float64] = field(repr=False)
    seen: list[npt.NDArray[np.float32]] = field(repr=False)

    def places(self, look: VideoOptions) -> npt.NDArray[np.float64]:
        """Where in the episode each frame of a film lies, in control steps."""
        return look.places(len(self.states), self.setup.cartpole.control_step)

    @functools.cached_property
    def totals(self) -> list[float]:
        """The return so far at each state, shape (steps + 1,)."""
        rewards, last = [0.0], len(self.states) - 1
        seen = self.setup.task.seen(self.states).tolist()
        for step, state in enumerate(seen[1:], start=1):
            terminated = step == last and self.episode.ending != ENDINGS[0]
            rewards.append(self.setup.task.reward(*worst_pole(state), terminated))
        return list(itertools.accumulate(rewards))

    def moment(self, place: float) -> Moment:
        """What an overlay says at a place between control steps."""
        step, policy = int(place + _ROUNDING), self.setup.policy
        state = state_at(self.states, place)
        if step >= self.episode.steps:
            return Moment(self.episode.steps, self.episode.total, state)
        observation = self.seen[step]
        values = policy.values(observation) if isinstance(policy, Policy) else None
        return Moment(step, self.totals[step], state, policy(observation), values)


def play(setup: PolicySetup, episodes: int = 1) -> list[Rollout]:
    """Play the first episodes that an evaluation with the same seed plays.

    Raises:
        ConfigError: There is no episode to be played, the seed is negative, or the policy is one
            for another number of poles.
        SimulationError: The physics diverged.
    """
    check_count(episodes, setup.seed)
    setup.policy.check_fits(setup.cartpole.poles, setup.cartpole.name)
    act, takes, varies = player(setup.policy, setup.task), [], bool(setup.disturbances.vary)
    with contextlib.closing(make_env(*setup.world)) as env:
        for number in range(episodes):
            seed, seen = setup.seed if number == 0 else None, list[npt.NDArray[np.float32]]()
            episode, states = play_episode(env, _noting(act, seen), number=number, seed=seed)
            drawn: Any = env.unwrapped
            own = replace(setup, model=drawn.simulation.cartpole) if varies else setup
            takes.append(Rollout(own, episode, np.array(states), seen))
    return takes


def _noting(act: Callable[[Any], Any], seen: list[Any]) -> Callable[[Any], Any]:
    """Return what acts the same and notes what it saw."""

    def acts(observation: npt.NDArray[np.float32]) -> Any:  # noqa: ANN401 - an action
        seen.append(observation)
        return act(observation)

    return acts


class Film:
    """The takes of one or several stages, ready to be drawn; a context manager.

    Attributes:
        length: Frames.
        drawn_by: Which renderer draws.
    """

    def __init__(self, casts: Sequence[Sequence[Rollout]], look: VideoOptions) -> None:
        """Open a renderer for each stage; several are shown side by side.

        The casts are the takes of each stage, as many of each, one after the other in time: each
        starts when all that are shown beside the one before have ended.

        Raises:
            RenderError: The look makes no sense for a model.
        """
        self._casts = casts
        self._look = look
        with contextlib.ExitStack() as opened:
            self._stages = [_Stage(takes[0].setup, look, opened) for takes in casts]
            self._open = opened.pop_all()
        self.length = sum(
            max(len(take.places(look)) for take in takes) for takes in zip(*casts, strict=True)
        )
        self.drawn_by: str = self._stages[0].renderer.kind

    def __enter__(self) -> "Film":
        return self

    def __exit__(self, *_: object) -> None:
        self._open.close()

    def frames(self) -> Iterator[Frame]:
        """Draw it, one frame at a time; an array may be used again for the next one."""
        labels = [takes[0].setup.name for takes in self._casts]
        for takes in zip(*self._casts, strict=True):
            streams = [self._draw(*pair) for pair in zip(takes, self._stages, strict=True)]
            yield from streams[0] if len(streams) == 1 else side_by_side(streams, labels)

    def contact_sheet(self, count: int) -> Frame:
        """Equally spaced moments of the first stage's first episode, as one picture."""
        take, stage = self._casts[0][0], self._stages[0]
        places, control_step = take.places(self._look), take.setup.cartpole.control_step
        chosen = [float(places[index]) for index in equally_spaced(len(places), count)]
        frames = [frame.copy() for frame in self._draw_places(take, stage, chosen)]
        return sheet(frames, [time_label(place, control_step) for place in chosen])

    def _draw(self, take: Rollout, stage: "_Stage") -> Iterator[Frame]:
        return self._draw_places(take, stage, take.places(self._look))

    def _draw_places(
        self, take: Rollout, stage: "_Stage", places: Sequence[float] | npt.NDArray[np.float64]
    ) -> Iterator[Frame]:
        renderer = stage.showing(take.setup)
        overlay = Overlay(renderer.scene) if self._look.overlay else None
        for place in places:
            frame = renderer.render(state_at(take.states, place))
            yield frame if overlay is None else overlay.draw(frame, take.moment(place))


class _Stage:
    """What draws one episode after the other, each with the model that moves in it."""

    def __init__(
        self, setup: PolicySetup, look: VideoOptions, opened: contextlib.ExitStack
    ) -> None:
        self._look, self._opened = look, opened.enter_context(contextlib.ExitStack())
        self._open(setup)

    def _open(self, setup: PolicySetup) -> None:
        self._cartpole = setup.cartpole
        self.renderer = self._opened.enter_context(_open_renderer(setup, self._look))

    def showing(self, setup: PolicySetup) -> Renderer:
        """Return what draws a setup's model."""
        if self._cartpole is not setup.cartpole:
            self._opened.close()
            self._open(setup)
        return self.renderer


def _open_renderer(setup: PolicySetup, look: VideoOptions) -> Renderer:
    look.check(setup.cartpole)
    return open_renderer(
        setup.cartpole,
        width=look.width,
        height=look.height,
        camera=look.camera,
        quality=look.quality,
        task=setup.task,
    )
