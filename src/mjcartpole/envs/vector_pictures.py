"""Pictures of many environments that move as one."""

import functools
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from mjcartpole.envs.disturbers import Disturbers
from mjcartpole.envs.pictures import USUAL, warn_without_mode
from mjcartpole.errors import ConfigError
from mjcartpole.media.renderer import open_renderer
from mjcartpole.media.scene import check_picture
from mjcartpole.media.turns import Renderer
from mjcartpole.physics.batch_simulation import BatchSimulation
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.task import Task

VectorRenderMode = Literal["rgb_array", "rgb_array_list"]


class VectorPictures:
    """Draws each environment of a vector."""

    render_mode: str | None
    cartpole: CartPole
    _task: Task
    _simulation: BatchSimulation
    _disturbers: Disturbers | None
    _has_state: bool
    _renderer: Renderer | None = None

    def _prepare_pictures(self, mode: str | None, width: int, height: int, camera: str) -> None:
        """Check what was asked for; no OpenGL is touched."""
        if mode is not None or (width, height, camera) != USUAL:
            check_picture(self.cartpole, width, height, camera)
        self.render_mode = mode
        self._open_renderer = functools.partial(
            open_renderer, width=width, height=height, camera=camera, task=self._task
        )

    def render(self) -> tuple[npt.NDArray[np.uint8], ...] | None:
        """Draw the current states.

        Returns:
            One array of shape (height, width, 3) per environment; None without a render mode,
            which warns, and before the first reset.

        Raises:
            RenderError: No picture can be made.
        """
        if self.render_mode is None:
            warn_without_mode("gymnasium.make_vec")
            return None
        if not self._has_state:
            return None
        states = self._simulation.state
        if self._disturbers and self._disturbers.vary:
            return tuple(map(self._draw_one, self._disturbers.cartpoles, states))
        renderer = self._renderer = self._renderer or self._open_renderer(self.cartpole)
        return tuple(renderer.render(state) for state in states)

    def _draw_one(
        self, cartpole: CartPole, state: npt.NDArray[np.float64]
    ) -> npt.NDArray[np.uint8]:
        with self._open_renderer(cartpole) as renderer:
            return renderer.render(state).copy()

    def close(self, **kwargs: object) -> None:
        """Free the renderer, if there is one."""
        if self._renderer is not None:
            self._renderer.close()
        self._renderer = None
        super().close(**kwargs)  # type: ignore[misc]


def check_render_mode(render_mode: str | None) -> None:
    """Refuse a render mode that a vector does not have (ConfigError)."""
    if render_mode is not None and render_mode not in get_args(VectorRenderMode):
        raise ConfigError(
            f"render_mode {render_mode!r} is not for a vector that moves as one; available: None, "
            + ", ".join(repr(mode) for mode in get_args(VectorRenderMode))
            + '; make_vec(..., vectorization_mode="sync") takes those of a single environment'
        )
