"""Greedy episodes as pictures: played first, then drawn frame by frame."""

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from mjcartpole.envs.backend import Backend, make_env
from mjcartpole.errors import RenderError
from mjcartpole.integrator import Integrator
from mjcartpole.learning.episodes import Episode
from mjcartpole.learning.loop import play_episode
from mjcartpole.learning.policy import Policy
from mjcartpole.media.montage import (
    equally_spaced,
    last_seconds,
    played,
    sheet,
    side_by_side,
    state_at,
    time_label,
)
from mjcartpole.media.overlay import Overlay
from mjcartpole.media.quality import DEFAULT_QUALITY, Quality
from mjcartpole.media.renderer import DEFAULT_HEIGHT, DEFAULT_WIDTH, Renderer, open_renderer
from mjcartpole.media.scene import DEFAULT_CAMERA, check_picture
from mjcartpole.media.strip import Moment
from mjcartpole.media.video import DEFAULT_FPS
from mjcartpole.physics.model import CartPole, ModelLike, load_model
from mjcartpole.studies.evaluation import SEED
from mjcartpole.task import CONTROL_STEP, N_ACTIONS

FALL_SECONDS: Final = 1.0
"""How much of an episode's end a film of its fall shows."""
FALL_SPEED: Final = 0.25

Frame = npt.NDArray[np.uint8]


@dataclass(frozen=True)
class Stage:
    """A policy and where it is played.

    Attributes:
        name: What a person calls it.
        policy: The policy.
        backend: Who does the physics.
        model: What moves, for backend mujoco; gymnasium's cart-pole is drawn as the reference.
        integrator: See `Simulation`.
        seed: Seeds the first episode's starting state.
    """

    name: str
    policy: Policy
    backend: Backend = "mujoco"
    model: ModelLike = "cartpole"
    integrator: Integrator = "gym"
    seed: int = SEED

    @property
    def cartpole(self) -> CartPole:
        """What is drawn."""
        return load_model(self.model)


@dataclass(frozen=True)
class Look:
    """How a film looks.

    Attributes:
        width: Pixels of one picture; a grid of several is larger.
        height: Pixels.
        camera: A camera of the model.
        quality: See `open_renderer`.
        overlay: Write step, return, state, action and action values into the picture.
        speed: 0.25 is four times slower than the motion.
        fps: Frames per second of the film.
        fall: Show the end of each episode alone, in slow motion.
    """

    width: int = DEFAULT_WIDTH
    height: int = DEFAULT_HEIGHT
    camera: str = DEFAULT_CAMERA
    quality: Quality = DEFAULT_QUALITY
    overlay: bool = False
    speed: float = 1.0
    fps: float = DEFAULT_FPS
    fall: bool = False

    def check(self, cartpole: CartPole) -> None:
        """Refuse what makes no sense, before anything is played.

        Raises:
            RenderError: See above.
        """
        check_picture(cartpole, self.width, self.height, self.camera)
        if not 0 < self.fps <= 1_000:
            raise RenderError(f"fps {self.fps:g} makes no sense; use 1 to 1000, such as 50")
        self.places(2)

    def places(self, states: int) -> npt.NDArray[np.float64]:
        """Where in an episode of so many states each frame lies, in control steps."""
        # Played as it was, a film has a frame per control step at 50 frames per second.
        steps_per_frame = self.speed / (CONTROL_STEP * self.fps)
        if self.fall:
            return last_seconds(states, seconds=FALL_SECONDS, speed=FALL_SPEED * steps_per_frame)
        return played(states, speed=steps_per_frame)


@dataclass(frozen=True, eq=False)
class Take:
    """One episode as it was played.

    Attributes:
        stage: Who played, and where.
        episode: What it came to.
        states: From the first to the last, shape (steps + 1, 4).
    """

    stage: Stage
    episode: Episode
    states: npt.NDArray[np.float64]

    def moment(self, place: float) -> Moment:
        """What an overlay says at a place between control steps."""
        step, policy = int(place), self.stage.policy
        state = state_at(self.states, place)
        if step >= self.episode.steps:
            return Moment(self.episode.steps, self.episode.total, state)
        observation = self.states[step].astype(np.float32)
        row = policy.discretizer(observation.tolist())
        left, right = policy.q_table.reshape(-1, N_ACTIONS)[row].tolist()
        return Moment(step, float(step), state, policy(observation), (left, right))


def play(stage: Stage, episodes: int = 1) -> list[Take]:
    """Play the first episodes that an evaluation with the same seed plays.

    Raises:
        RenderError: There is no episode to be played.
        SimulationError: The physics diverged.
    """
    if episodes < 1:
        raise RenderError(f"{episodes} episodes cannot be filmed; use 1 or more")
    env = make_env(stage.backend, stage.model, stage.integrator)
    takes = []
    for number in range(episodes):
        seed = stage.seed if number == 0 else None
        episode, states = play_episode(env, stage.policy, number=number, seed=seed)
        takes.append(Take(stage, episode, np.array(states)))
    env.close()
    return takes


class Film:
    """The takes of one or several stages, ready to be drawn; a context manager.

    Attributes:
        length: Frames.
        drawn_by: Which renderer draws.
    """

    def __init__(self, casts: Sequence[Sequence[Take]], look: Look) -> None:
        """Open a renderer for each stage; several are shown side by side.

        Args:
            casts: The takes of each stage, one after the other in time.
            look: How it looks.

        Raises:
            RenderError: The look makes no sense for a model.
        """
        self._casts = casts
        self._look = look
        self._renderers: list[Renderer] = []
        self._open = contextlib.ExitStack()
        for takes in casts:
            cartpole = takes[0].stage.cartpole
            look.check(cartpole)
            renderer = open_renderer(
                cartpole,
                width=look.width,
                height=look.height,
                camera=look.camera,
                quality=look.quality,
            )
            self._renderers.append(self._open.enter_context(contextlib.closing(renderer)))
        self.length = max(sum(len(look.places(len(t.states))) for t in takes) for takes in casts)
        self.drawn_by: str = self._renderers[0].kind

    def __enter__(self) -> "Film":
        return self

    def __exit__(self, *_: object) -> None:
        self._open.close()

    def frames(self) -> Iterator[Frame]:
        """Draw it, one frame at a time; an array may be used again for the next one."""
        streams = [
            self._draw(takes, renderer)
            for takes, renderer in zip(self._casts, self._renderers, strict=True)
        ]
        if len(streams) == 1:
            return streams[0]
        return side_by_side(streams, [takes[0].stage.name for takes in self._casts])

    def contact_sheet(self, count: int) -> Frame:
        """Equally spaced moments of the first stage's first episode, as one picture."""
        take, renderer = self._casts[0][0], self._renderers[0]
        places = self._look.places(len(take.states))
        chosen = [float(places[index]) for index in equally_spaced(len(places), count)]
        frames = [frame.copy() for frame in self._draw_places(take, renderer, chosen)]
        return sheet(frames, [time_label(place) for place in chosen])

    def _draw(self, takes: Sequence[Take], renderer: Renderer) -> Iterator[Frame]:
        for take in takes:
            yield from self._draw_places(take, renderer, self._look.places(len(take.states)))

    def _draw_places(
        self, take: Take, renderer: Renderer, places: Sequence[float] | npt.NDArray[np.float64]
    ) -> Iterator[Frame]:
        overlay = Overlay(renderer.scene) if self._look.overlay else None
        for place in places:
            frame = renderer.render(state_at(take.states, place))
            yield frame if overlay is None else overlay.draw(frame, take.moment(place))
