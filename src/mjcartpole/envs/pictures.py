"""What an environment draws with: a renderer, or a window, opened when it is first needed."""

from typing import Any, Final, Literal, get_args

import numpy as np
import numpy.typing as npt
from gymnasium import logger

from mjcartpole.envs.registration import ENV_ID
from mjcartpole.errors import ConfigError
from mjcartpole.media.renderer import DEFAULT_HEIGHT, DEFAULT_WIDTH, open_renderer
from mjcartpole.media.scene import DEFAULT_CAMERA, check_picture
from mjcartpole.media.turns import Renderer
from mjcartpole.media.window import Window, open_window
from mjcartpole.physics.bodies import starting_state
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.simulation import Simulation
from mjcartpole.task import Task

RenderMode = Literal["human", "rgb_array"]

USUAL: Final = (DEFAULT_WIDTH, DEFAULT_HEIGHT, DEFAULT_CAMERA)


class InNotebooks:
    """Shows an environment's state as a picture that needs no OpenGL."""

    simulation: Simulation
    state: Any
    _task: Task

    def _repr_html_(self) -> str:
        from mjcartpole.media.notebook import with_frame  # noqa: PLC0415 - notebooks only

        cartpole, task = self.simulation.cartpole, self._task
        state = starting_state(cartpole, task) if self.state is None else self.state
        with open_renderer(cartpole, width=320, height=240, kind="sketch", task=task) as renderer:
            return with_frame(repr(cartpole), renderer.render(state))


class Pictures:
    """Pictures of one size, from one camera. A copy opens a renderer of its own."""

    def __init__(
        self,
        cartpole: CartPole,
        mode: RenderMode | None,
        width: int,
        height: int,
        camera: str,
        task: Task,
    ) -> None:
        """Check what was asked for; no OpenGL is touched.

        Raises:
            ConfigError: The render mode is unknown, or a window is to have a size.
            RenderError: The size of a picture makes no sense, or the model has no such camera.
        """
        _check_render_mode(mode, width, height)
        if mode == "rgb_array" or (width, height, camera) != USUAL:
            check_picture(cartpole, width, height, camera)
        self._width, self._height, self._camera, self._task = width, height, camera, task
        self._renderer: Renderer | None = None
        self._window: Window | None = None

    def draw(self, cartpole: CartPole, state: npt.ArrayLike) -> npt.NDArray[np.uint8]:
        """A picture of a state, shape (height, width, 3)."""
        # Held by a name of its own: another thread may close it meanwhile.
        renderer = self._renderer = self._renderer or open_renderer(
            cartpole, width=self._width, height=self._height, camera=self._camera, task=self._task
        )
        return renderer.render(state)

    def show(self, cartpole: CartPole, state: npt.NDArray[np.float64]) -> None:
        """Show a state in the window."""
        if self._window is None:
            self._window = open_window(cartpole, self._camera)
        self._window.show(state)

    def close(self) -> None:
        """Free the renderer and the window, if there are any; the next picture opens others."""
        for picture in (self._renderer, self._window):
            if picture is not None:
                picture.close()
        self._renderer = self._window = None

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_renderer": None, "_window": None}


def warn_without_mode(make: str = "gymnasium.make") -> None:
    """Say that there is nothing to render without a render mode, as gymnasium does."""
    logger.warn(
        "You are calling render method without specifying any render mode. "
        f'Specify it when you make the env: {make}("{ENV_ID}", render_mode="rgb_array")'
    )


def _check_render_mode(render_mode: str | None, width: int, height: int) -> None:
    if render_mode is not None and render_mode not in get_args(RenderMode):
        raise ConfigError(
            f"render_mode {render_mode!r} is unknown; available: None, "
            + ", ".join(repr(mode) for mode in get_args(RenderMode))
        )
    if render_mode == "human" and (width, height) != (DEFAULT_WIDTH, DEFAULT_HEIGHT):
        raise ConfigError(
            f"a window has the size that the screen gives it, not {width}x{height}; "
            'width and height are for render_mode="rgb_array"'
        )
