"""How a film looks: `VideoOptions`, also the flags of the commands that film."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

import numpy as np
import numpy.typing as npt

from mjcartpole.errors import RenderError
from mjcartpole.task import CONTROL_STEP

if TYPE_CHECKING:
    from mjcartpole.physics.cartpole import CartPole

FALL_SECONDS: Final = 1.0
"""How much of an episode's end a film of its fall shows."""
FALL_SPEED: Final = 0.25

LEAST_FPS: Final = 1
MOST_FPS: Final = 1_000
LEAST_SPEED: Final = 0.001
MOST_SPEED: Final = 1_000


@dataclass(frozen=True)
class VideoOptions:
    """How a film looks."""

    camera: str = "side"
    """A camera of the model."""
    size: str = "640x480"
    """Pixels, width x height, of each run's picture."""
    quality: Literal["draft", "normal", "high"] = "normal"
    """draft is quick, high is fine, normal is what the model's file says."""
    overlay: bool = False
    """Write step, return, state, action and action values into the picture."""
    speed: float = 1.0
    """0.25 is four times slower than the motion."""
    fps: float = 50.0
    """Frames per second."""
    fall: bool = False
    """Show the last second of each episode alone, four times slower."""

    def __post_init__(self) -> None:
        width, _, height = self.size.lower().partition("x")
        if not (width.isdecimal() and height.isdecimal()):
            raise RenderError(
                f"--size is a width and a height in pixels, such as 640x480, not '{self.size}'"
            )

    @property
    def width(self) -> int:
        """Pixels of one picture; a grid of several is larger."""
        return int(self.size.lower().partition("x")[0])

    @property
    def height(self) -> int:
        """Pixels."""
        return int(self.size.lower().partition("x")[2])

    def check(self, cartpole: "CartPole") -> None:
        """Refuse what makes no sense, before anything is played (RenderError)."""
        from mjcartpole.media.scene import check_picture  # noqa: PLC0415 - it imports MuJoCo

        check_picture(cartpole, self.width, self.height, self.camera)
        if not LEAST_FPS <= self.fps <= MOST_FPS:
            raise RenderError(
                f"fps {self.fps:g} makes no sense; use {LEAST_FPS} to {MOST_FPS}, such as 50"
            )
        if not LEAST_SPEED <= self.speed <= MOST_SPEED:
            raise RenderError(
                f"speed {self.speed:g} makes no sense; use {LEAST_SPEED} to {MOST_SPEED}: "
                "0.25 is four times slower, 1 as it was"
            )

    def places(self, states: int, control_step: float = CONTROL_STEP) -> npt.NDArray[np.float64]:
        """Return where in an episode of so many states each frame lies, in control steps."""
        from mjcartpole.media.montage import last_seconds, played  # noqa: PLC0415 - Pillow

        # Played as it was, a film has a frame per control step of 0.02 s at 50 frames per second.
        steps_per_frame = self.speed / (control_step * self.fps)
        if not self.fall:
            return played(states, speed=steps_per_frame)
        return last_seconds(
            states,
            seconds=FALL_SECONDS,
            speed=FALL_SPEED * steps_per_frame,
            steps_per_second=1 / control_step,
        )
