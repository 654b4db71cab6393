"""CartPole-v1 with MuJoCo underneath, as a `gymnasium.Env`."""

import functools
from collections.abc import Callable
from typing import Any, Literal, get_args

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium import logger, spaces
from gymnasium.envs.classic_control.utils import maybe_parse_reset_bounds

from mjcartpole import task
from mjcartpole.envs.registration import ENV_ID
from mjcartpole.errors import ConfigError, InvalidActionError, ResetNeededError
from mjcartpole.integrator import Integrator
from mjcartpole.media.renderer import DEFAULT_HEIGHT, DEFAULT_WIDTH, Renderer, open_renderer
from mjcartpole.media.scene import DEFAULT_CAMERA, check_picture
from mjcartpole.media.window import Window, open_window
from mjcartpole.physics.model import Edits, ModelLike, load_model
from mjcartpole.physics.simulation import (
    FARTHEST_SANE,
    Simulation,
    State,
    check_sane,
)

RenderMode = Literal["human", "rgb_array"]

# What `step` needs, as plain globals: the fewest look-ups and no sign to change.
_INT64 = np.int64
_X_MIN, _X_MAX = -task.X_LIMIT, task.X_LIMIT
_FARTHEST = FARTHEST_SANE
_THETA_MIN, _THETA_MAX = -task.THETA_LIMIT, task.THETA_LIMIT

_DEFAULT_PICTURE = {"width": DEFAULT_WIDTH, "height": DEFAULT_HEIGHT, "camera": DEFAULT_CAMERA}

_STEP_AFTER_END = (
    "You are calling 'step()' even though this environment has already returned "
    "terminated = True. You should always call 'reset()' once you receive "
    "'terminated = True' -- any further steps are undefined behavior."
)


class CartPoleEnv(gymnasium.Env[npt.NDArray[np.float32], np.int64 | int]):
    """CartPole-v1, moved by MuJoCo.

    ## Description

    A cart slides on a rail; a pole stands on it by a hinge that no motor turns. The pole starts
    nearly upright, and the task is to keep it so by pushing the cart to the left or to the right.
    Spaces, starting states, rewards and endings are those of gymnasium's `CartPole-v1`; the
    motion comes from an MJCF model, and with the reference model one step differs from
    gymnasium's by rounding alone.

    >>> import gymnasium, mjcartpole
    >>> env = gymnasium.make("mjcartpole/CartPole-v1")
    >>> reference = gymnasium.make("CartPole-v1")
    >>> observation, info = env.reset(seed=0)
    >>> bool((observation == reference.reset(seed=0)[0]).all())
    True
    >>> env.step(1)[1:]
    (1.0, False, False, {})

    ## Action Space

    `Discrete(2)`: 0 pushes the cart to the left (-x), 1 to the right (+x). An action drives the
    actuator to one end of its control range; in the reference model that is a force of 10 N.

    >>> env.action_space
    Discrete(2)

    ## Observation Space

    A `float32` array of shape `(4,)`; the state itself is `float64`.

    | Num | Observation           | Min                 | Max               |
    |-----|-----------------------|---------------------|-------------------|
    | 0   | Cart position         | -4.8 m              | 4.8 m             |
    | 1   | Cart velocity         | -Inf                | Inf               |
    | 2   | Pole angle            | ~ -0.418 rad (-24°) | ~ 0.418 rad (24°) |
    | 3   | Pole angular velocity | -Inf                | Inf               |

    A positive angle leans the pole to the right (+x). The bounds of positions are twice the
    limits that end an episode, so the last observation lies inside.

    >>> env.observation_space == reference.observation_space
    True

    A model with several poles has two more values for each, in the order of the document; all rules
    for the pole hold for each of them. The angle of a pole that stands on another is counted from
    that one's direction.

    ## Rewards

    1 for every step, the terminating one included. With `sutton_barto_reward=True`: 0 for every
    step and -1 for the terminating one.

    ## Starting State

    Each of the values is drawn uniformly from (-0.05, 0.05) in the order x, x_dot, theta,
    theta_dot; `reset(options={"low": ..., "high": ...})` draws from other bounds.

    ## Episode End

    1. Termination: the pole leans more than 12° (0.2094 rad).
    2. Termination: the cart's centre is more than 2.4 m from the middle.
    3. Truncation: 500 steps, by the time limit that `gymnasium.make` adds.

    Limits are strict and compared with the float64 state. A step after termination warns once and
    gives reward 0, as in CartPole-v1.

    ## Arguments

    | Parameter             | Type                   | Default     | Description                   |
    |-----------------------|------------------------|-------------|-------------------------------|
    | `model`               | str, path, MjSpec      | "cartpole"  | A shipped model's name, an MJCF file, an XML document, or an MjSpec |
    | `edits`               | dict                   | None        | Edits of the model, such as `{"pole.length": 1.5}` |
    | `own_timestep`        | bool                   | False       | One physics step of the file per action, instead of 0.02 s |
    | `integrator`          | "gym" or "mujoco"      | "gym"       | Explicit Euler as CartPole-v1, or the integrator that the file names |
    | `sutton_barto_reward` | bool                   | False       | See Rewards                   |
    | `render_mode`         | None, "rgb_array", "human" | None    | Nothing, arrays, or a window (where there is a screen) |
    | `width`, `height`     | int                    | 640, 480    | Size of a picture, in pixels  |
    | `camera`              | str                    | "side"      | A camera of the model         |

    `env.unwrapped.state` reads and sets the float64 state.

    >>> env.unwrapped.state = (0.0, 0.0, 0.1, 0.0)
    >>> [round(float(value), 4) for value in env.step(1)[0]]
    [0.0, 0.1936, 0.1, -0.2595]
    >>> env.close()

    ## Version History

    * v1: the rules of CartPole-v1.
    """  # noqa: E501 - a table's rows cannot be wrapped

    metadata: dict[str, Any] = {  # noqa: RUF012 - gymnasium's own declaration
        "render_modes": ["human", "rgb_array"],
        "render_fps": task.frame_rate(),
    }

    def __init__(
        self,
        *,
        model: ModelLike = "cartpole",
        edits: Edits = None,
        own_timestep: bool = False,
        integrator: Integrator = "gym",
        sutton_barto_reward: bool = False,
        render_mode: RenderMode | None = None,
        width: int = DEFAULT_WIDTH,
        height: int = DEFAULT_HEIGHT,
        camera: str = DEFAULT_CAMERA,
    ) -> None:
        """Load the model; nothing is drawn and no OpenGL is touched until `render`.

        Raises:
            ModelError: The model cannot be found, has an error, or is no cart-pole.
            ConfigError: The integrator or the render mode is unknown, or a window is to have a
                size.
            RenderError: The size of a picture makes no sense, or the model has no such camera.
        """
        _check_render_mode(render_mode, width, height)
        cartpole = load_model(model, edits, own_timestep=own_timestep)
        self.simulation, poles = Simulation(cartpole, integrator), cartpole.poles
        self.metadata = self.metadata | {"render_fps": task.frame_rate(cartpole.control_step)}
        bound = task.observation_bound(poles)
        self.observation_space = spaces.Box(-bound, bound, dtype=np.float32)
        self.action_space = spaces.Discrete(task.N_ACTIONS)
        self.render_mode = render_mode
        step = self.simulation.step
        self._move: Callable[[float], State] = step if poles == 1 else _as_one_pole(step)
        self._advance: Callable[[float], State] = _needs_reset
        self._left, self._right = self.simulation.cartpole.controls
        self._step_reward, self._end_reward, self._late_reward = (
            task.reward(terminated=over, already_over=late, sutton_barto=sutton_barto_reward)
            for over, late in ((False, False), (True, False), (True, True))
        )
        self._steps_after_end: int | None = None
        observation = np.zeros(4, dtype=np.float32)
        # A view that takes single floats several times faster than the array does.
        self._cells: memoryview[float] = observation.data.cast("B").cast("f")
        self._new_observation = (
            observation.copy if poles == 1 else functools.partial(_observe, self.simulation)
        )
        picture = {"width": width, "height": height, "camera": camera}
        if render_mode == "rgb_array" or picture != _DEFAULT_PICTURE:
            check_picture(self.simulation.cartpole, width, height, camera)
        self._open_renderer = functools.partial(
            open_renderer, self.simulation.cartpole, width=width, height=height, camera=camera
        )
        self._open_window = functools.partial(open_window, self.simulation.cartpole, camera)
        self._renderer: Renderer | None = None
        self._window: Window | None = None

    @property
    def state(self) -> npt.NDArray[np.float64] | None:
        """The float64 state, two values for the cart and for each pole; None before a reset.

        It is `(x, x_dot, theta, theta_dot)`: m, m/s, rad, rad/s; shape (4,) with one pole.
        """
        return None if self._advance is _needs_reset else self.simulation.state

    @state.setter
    def state(self, state: npt.ArrayLike) -> None:
        self.simulation.state = state
        self._advance = self._move

    def step(
        self, action: np.int64 | int
    ) -> tuple[npt.NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Advance one control step: 0.02 s, unless the file's own timestep was asked for.

        Raises:
            InvalidActionError: The action is not in the action space.
            ResetNeededError: There is no state yet.
            SimulationError: The physics diverged.
        """
        # The hot path: plain floats and no look-up that can be spared. A stored function is taken
        # out before it is called, since `self.name()` looks for a method in all classes first.
        kind = type(action)
        if kind is not int and kind is not _INT64 and not self.action_space.contains(action):
            raise _invalid(action)
        # A numpy integer tells whether it is zero much sooner than whether it equals one.
        if not action:
            control = self._left
        elif action == 1:
            control = self._right
        else:
            raise _invalid(action)
        advance = self._advance
        x, x_dot, theta, theta_dot = advance(control)
        if (
            _X_MIN <= x <= _X_MAX
            and _THETA_MIN <= theta <= _THETA_MAX
            # Neither velocity is NaN, or so large that the physics have diverged.
            and -_FARTHEST < x_dot - theta_dot < _FARTHEST
        ):
            terminated, reward = False, self._step_reward
        else:
            terminated, reward = True, self._end()
        # None is told apart sooner than a word is.
        if self.render_mode is not None and self.render_mode == "human":
            self.render()
        cells, new_observation = self._cells, self._new_observation
        cells[0] = x
        cells[1] = x_dot
        cells[2] = theta
        cells[3] = theta_dot
        return new_observation(), reward, terminated, False, {}

    def _end(self) -> float:
        """Reward of a step that ends the episode, or comes after its end."""
        check_sane(tuple(self.simulation.state.tolist()), self.simulation.cartpole.name)
        if self._steps_after_end is None:
            self._steps_after_end = 0
            return self._end_reward
        if self._steps_after_end == 0:
            logger.warn(_STEP_AFTER_END)
        self._steps_after_end += 1
        return self._late_reward

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[npt.NDArray[np.float32], dict[str, Any]]:
        """Start an episode.

        Args:
            seed: Seeds the env's generator, as gymnasium describes.
            options: `{"low": float, "high": float}`, bounds of the starting state.

        Raises:
            ValueError: A bound is no number, or low is above high.
        """
        super().reset(seed=seed)
        low, high = maybe_parse_reset_bounds(options, task.RESET_LOW, task.RESET_HIGH)
        state = self.np_random.uniform(low=low, high=high, size=self.simulation.size)
        self.simulation.put(state.tolist())
        self._advance = self._move
        self._steps_after_end = None
        if self.render_mode == "human":
            self.render()
        return state.astype(np.float32), {}

    def render(self) -> npt.NDArray[np.uint8] | None:
        """Draw the current state.

        Returns:
            An array of shape (height, width, 3) in mode "rgb_array"; None in mode "human", which
            shows a window, without a render mode, which warns, and before the first reset.

        Raises:
            RenderError: No picture can be made.
        """
        if self.render_mode is None:
            logger.warn(
                "You are calling render method without specifying any render mode. "
                f'Specify it when you make the env: gymnasium.make("{ENV_ID}", '
                'render_mode="rgb_array")'
            )
            return None
        if self.state is None:
            return None
        if self.render_mode == "human":
            if self._window is None:
                self._window = self._open_window()
            self._window.show(self.state)
            return None
        # Held by a name of its own: another thread may close it meanwhile.
        renderer = self._renderer = self._renderer or self._open_renderer()
        return renderer.render(self.state)

    def close(self) -> None:
        """Free the renderer and the window, if there are any."""
        for picture in (self._renderer, self._window):
            if picture is not None:
                picture.close()
        self._renderer = self._window = None


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


def _observe(simulation: Simulation) -> npt.NDArray[np.float32]:
    """The observation, also of several poles."""
    return simulation.state.astype(np.float32)


def _as_one_pole(step: Callable[[float], State]) -> Callable[[float], State]:
    """Steps of several poles that return what the rules look at: the worst of all poles.

    That is `(x, x_dot, theta, theta_dot)` with the largest angle and the largest angular velocity,
    without signs.
    """

    def advance(control: float) -> State:
        state = step(control)
        return state[0], state[1], task.farthest(state[2::2]), task.farthest(state[3::2])

    return advance


def _needs_reset(control: float) -> State:
    raise ResetNeededError("Call reset before using step method.")


def _invalid(action: object) -> InvalidActionError:
    return InvalidActionError(f"{action!r} ({type(action)}) invalid; the actions are 0 and 1")
