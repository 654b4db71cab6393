"""Many cart-poles at once, as a `gymnasium.vector.VectorEnv` on `mujoco.batch`."""

import functools
from typing import Any, Final, Literal, get_args

import mjcartpole.physics  # noqa: F401 - first: it imports MuJoCo where there is no OpenGL

# isort: split

import mujoco
import numpy as np
import numpy.typing as npt
from gymnasium import logger, spaces
from gymnasium.envs.classic_control.utils import maybe_parse_reset_bounds
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from mujoco.batch import Batch

from mjcartpole import task
from mjcartpole.envs.registration import ENV_ID
from mjcartpole.errors import ConfigError, InvalidActionError, ResetNeededError
from mjcartpole.integrator import Integrator, check_integrator
from mjcartpole.media.renderer import DEFAULT_HEIGHT, DEFAULT_WIDTH, Renderer, open_renderer
from mjcartpole.media.scene import DEFAULT_CAMERA, check_picture
from mjcartpole.physics.model import Edits, ModelLike, load_model
from mjcartpole.physics.simulation import LARGEST_SANE, check_sane, stepping_model

VectorRenderMode = Literal["rgb_array"]

_DEFAULT_PICTURE: Final = (DEFAULT_WIDTH, DEFAULT_HEIGHT, DEFAULT_CAMERA)

_EVERYONE: Final = slice(None)
_NOBODY: Final = np.empty(0, dtype=np.intp)


class CartPoleVectorEnv(
    VectorEnv[npt.NDArray[np.float32], npt.NDArray[np.integer[Any]], npt.NDArray[Any]]
):
    """Many copies of CartPole-v1, moved together by MuJoCo on all cores.

    ## Description

    Each environment of the vector moves as a `CartPoleEnv` with the same model does, to the last
    bit, on however many threads. Spaces, starting states, rewards, endings and restarts are those
    of gymnasium's `CartPoleVectorEnv`, so the same seed starts the same episodes.

    >>> import gymnasium, mjcartpole
    >>> envs = gymnasium.make_vec("mjcartpole/CartPole-v1", num_envs=3)
    >>> reference = gymnasium.make_vec("CartPole-v1", num_envs=3)
    >>> observations, info = envs.reset(seed=0)
    >>> bool((observations == reference.reset(seed=0)[0]).all())
    True
    >>> observations, rewards, terminations, truncations, info = envs.step([0, 1, 1])
    >>> rewards
    array([1., 1., 1.], dtype=float32)

    Returned arrays belong to the caller: no later step writes into them.

    ## Spaces

    Actions are integers of shape `(num_envs,)`, 0 to the left (-x) and 1 to the right (+x);
    observations are `float32` of shape `(num_envs, 4)`, as `CartPoleEnv` describes them.

    >>> envs.action_space
    MultiDiscrete([2 2 2])
    >>> envs.observation_space == reference.observation_space
    True

    ## Episodes

    An environment terminates by the rules of `CartPoleEnv` and is truncated after
    `max_episode_steps`. It restarts by itself in the step after that: its action is ignored, it
    returns a new starting state, reward 0 and no ending (`AutoresetMode.NEXT_STEP`).

    `reset(seed=..., options={"low": ..., "high": ...})` restarts all; the bounds hold until the
    next `reset`, also where an environment restarts by itself.

    ## Arguments

    | Parameter             | Type                   | Default     | Description                   |
    |-----------------------|------------------------|-------------|-------------------------------|
    | `num_envs`            | int                    | 1           | How many environments         |
    | `max_episode_steps`   | int                    | 500         | Steps until truncation        |
    | `model`               | str, path, MjSpec      | "cartpole"  | As in `CartPoleEnv`           |
    | `edits`               | dict                   | None        | Edits of the model, such as `{"pole.length": 1.5}` |
    | `own_timestep`        | bool                   | False       | One physics step of the file per action, instead of 0.02 s |
    | `integrator`          | "gym" or "mujoco"      | "gym"       | As in `CartPoleEnv`           |
    | `sutton_barto_reward` | bool                   | False       | 0 per step and -1 at termination, instead of 1 per step |
    | `threads`             | int or None            | None        | Threads that step; None: one per core |
    | `render_mode`         | None or "rgb_array"    | None        | Nothing, or one picture per environment |
    | `width`, `height`     | int                    | 640, 480    | Size of a picture, in pixels  |
    | `camera`              | str                    | "side"      | A camera of the model         |

    `envs.state` reads and sets the float64 states, shape `(num_envs, 4)` for a model with one pole;
    each further pole has two more values.

    >>> envs.state = [(0.0, 0.0, 0.1, 0.0)] * 3
    >>> [round(float(value), 4) for value in envs.step([1, 0, 1])[0][0]]
    [0.0, 0.1936, 0.1, -0.2595]
    >>> envs.close()

    ## Version History

    * v1: the rules of CartPole-v1.
    """  # noqa: E501 - a table's rows cannot be wrapped

    metadata: dict[str, Any] = {  # noqa: RUF012 - gymnasium's own declaration
        "render_modes": list(get_args(VectorRenderMode)),
        "render_fps": task.frame_rate(),
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        num_envs: int = 1,
        *,
        max_episode_steps: int = task.TIME_LIMIT,
        model: ModelLike = "cartpole",
        edits: Edits = None,
        own_timestep: bool = False,
        integrator: Integrator = "gym",
        sutton_barto_reward: bool = False,
        threads: int | None = None,
        render_mode: VectorRenderMode | None = None,
        width: int = DEFAULT_WIDTH,
        height: int = DEFAULT_HEIGHT,
        camera: str = DEFAULT_CAMERA,
    ) -> None:
        """Load the model; nothing is drawn and no OpenGL is touched until `render`.

        Raises:
            ModelError: The model cannot be found, has an error, or is no cart-pole.
            ConfigError: The integrator or the render mode is unknown, or `num_envs`,
                `max_episode_steps` or `threads` is no whole number from 1.
            RenderError: The size of a picture makes no sense, or the model has no such camera.
        """
        self.num_envs = _count("num_envs", num_envs)
        self.max_episode_steps = _count("max_episode_steps", max_episode_steps)
        check_integrator(integrator)
        _check_render_mode(render_mode)
        self.render_mode = render_mode
        self.cartpole = load_model(model, edits, own_timestep=own_timestep)
        if render_mode is not None or (width, height, camera) != _DEFAULT_PICTURE:
            check_picture(self.cartpole, width, height, camera)
        self.metadata = self.metadata | {"render_fps": task.frame_rate(self.cartpole.control_step)}
        bound = task.observation_bound(self.cartpole.poles)
        self.single_observation_space = spaces.Box(-bound, bound, dtype=np.float32)
        self.single_action_space = spaces.Discrete(task.N_ACTIONS)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._sutton_barto_reward = sutton_barto_reward
        self._prepare_physics(integrator, 0 if threads is None else _count("threads", threads))
        self._prepare_episodes()
        self._open_renderer = functools.partial(
            open_renderer, self.cartpole, width=width, height=height, camera=camera
        )
        self._renderer: Renderer | None = None

    def _prepare_physics(self, integrator: Integrator, threads: int) -> None:
        """Make the batch, and views of what is read and written in each step."""
        cartpole = self.cartpole
        model = stepping_model(cartpole.model, integrator)
        self._batch = batch = Batch(model, self.num_envs, threads, _needs_own_data(model))
        self._explicit = integrator == "gym"
        self._timestep = cartpole.timestep
        self._fresh = batch.state[0].copy()
        qpos, qvel = batch.bind("qpos"), batch.bind("qvel")
        # The batch keeps one row per environment; these are columns of it, shape (num_envs,).
        self._columns = [(qpos[:, joint], qvel[:, joint]) for joint in cartpole.joints]
        self._control = batch.bind("ctrl")[:, 0]
        self._controls = np.array(cartpole.controls)

    def _prepare_episodes(self) -> None:
        """Make the arrays that live from step to step."""
        n, joints = self.num_envs, len(self.cartpole.joints)
        self._bounds = task.RESET_LOW, task.RESET_HIGH
        self._has_state = False
        # The same numbers as in the batch, side by side: what numpy is quick with.
        self._state = np.zeros((n, 2 * joints))
        self._positions, self._velocities = self._state[:, 0::2], self._state[:, 1::2]
        self._sizes = np.empty_like(self._state)
        self._moves = np.empty((n, joints))
        # Steps since the reset of all, and at which of them each episode is truncated.
        self._clock = 0
        self._deadlines = np.full(n, self.max_episode_steps)
        # Indices of the environments whose last step ended an episode.
        self._ended = _NOBODY

    @property
    def state(self) -> npt.NDArray[np.float64] | None:
        """The float64 states, shape (num_envs, 4) with one pole, a copy; None before a reset.

        Each is `(x, x_dot, theta, theta_dot, …)`: m, m/s, rad, rad/s. Setting it leaves nothing of
        the motion before; the episodes go on, and those that are over restart with the next step.
        """
        return self._state.copy() if self._has_state else None

    @state.setter
    def state(self, states: npt.ArrayLike) -> None:
        values = np.asarray(states, dtype=np.float64)
        if values.shape != self._state.shape:
            raise ConfigError(
                f"states have the shape {self._state.shape}: "
                f"({', '.join(task.state_names(self.cartpole.poles))}) of each environment, "
                f"not the shape {values.shape}"
            )
        self._place(_EVERYONE, values)
        self._has_state = True

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[npt.NDArray[np.float32], dict[str, Any]]:
        """Start an episode in every environment.

        Args:
            seed: Seeds the generator that all environments share, as gymnasium describes.
            options: `{"low": float, "high": float}`, bounds of the starting states until the
                next reset.

        Returns:
            Observations, shape (num_envs, 4) with one pole, and an empty dict.

        Raises:
            ValueError: A bound is no number, or low is above high.
        """
        super().reset(seed=seed)
        self._bounds = maybe_parse_reset_bounds(options, task.RESET_LOW, task.RESET_HIGH)
        self.state = self._draw(self.num_envs)
        self._clock = 0
        self._deadlines.fill(self.max_episode_steps)
        self._ended = _NOBODY
        return self._state.astype(np.float32), {}

    def step(
        self, actions: npt.ArrayLike
    ) -> tuple[
        npt.NDArray[np.float32],
        npt.NDArray[np.float32],
        npt.NDArray[np.bool_],
        npt.NDArray[np.bool_],
        dict[str, Any],
    ]:
        """Advance one control step; restart environments whose episode ended in the step before.

        Args:
            actions: Integers of shape (num_envs,).

        Returns:
            Observations, shape (num_envs, 4) with one pole; rewards, terminations and truncations,
            shape (num_envs,); and an empty dict.

        Raises:
            InvalidActionError: The actions are not in the action space.
            ResetNeededError: There is no state yet.
            SimulationError: The physics of an environment diverged; all need a reset.
        """
        controls = self._controls.take(self._valid(actions))
        if not self._has_state:
            raise ResetNeededError("Call reset before using step method.")
        self._control[...] = controls
        if self._explicit:
            self._explicit_euler()
        else:
            self._own_integrator()
        self._clock += 1
        restarted = self._ended
        if restarted.size:
            # Their step is thrown away, as gymnasium does: cheaper than to choose who steps.
            self._place(restarted, self._draw(restarted.size))
            self._deadlines[restarted] = self._clock + self.max_episode_steps
        terminations = self._have_terminated()
        truncations = self._deadlines <= self._clock
        rewards = self._rewards(terminations)
        if restarted.size:
            rewards[restarted] = 0.0
            terminations[restarted] = False
        self._ended = np.logical_or(terminations, truncations).nonzero()[0]
        return self._state.astype(np.float32), rewards, terminations, truncations, {}

    def _valid(self, actions: npt.ArrayLike) -> npt.NDArray[np.integer[Any]]:
        """The actions as an array, if `action_space.contains` them."""
        if (
            isinstance(actions, np.ndarray)
            and actions.dtype.kind == "i"
            and actions.shape == (self.num_envs,)
            # Together they have no bit but the lowest: each is 0 or 1.
            and np.bitwise_or.reduce(actions) in (0, 1)
        ):
            return actions
        if not self.action_space.contains(actions):
            raise InvalidActionError(
                f"{actions!r} ({type(actions)}) invalid; "
                f"actions are {self.num_envs} integers, each 0 or 1"
            )
        return np.asarray(actions)

    def _explicit_euler(self) -> None:
        """Positions move by the old velocities, velocities as MuJoCo says."""
        for _ in range(self.cartpole.substeps):
            np.multiply(self._velocities, self._timestep, out=self._moves)
            self._positions += self._moves
            self._batch.step()
            for joint, (qpos, qvel) in enumerate(self._columns):
                qpos[...] = self._positions[:, joint]
                self._velocities[:, joint] = qvel

    def _own_integrator(self) -> None:
        self._batch.step(nstep=self.cartpole.substeps)
        for joint, (qpos, qvel) in enumerate(self._columns):
            self._positions[:, joint], self._velocities[:, joint] = qpos, qvel

    def _have_terminated(self) -> npt.NDArray[np.bool_]:
        """Whose state is beyond a limit, shape (num_envs,); a new array.

        Raises:
            SimulationError: A state is NaN or beyond all bounds.
        """
        sizes = np.abs(self._state, out=self._sizes)
        # One look at the largest number finds NaN and infinity too.
        if not sizes.max() < LARGEST_SANE:
            self._refuse_diverged()
        over = sizes[:, 0] > task.X_LIMIT
        for pole in range(self.cartpole.poles):
            over |= sizes[:, 2 + 2 * pole] > task.THETA_LIMIT
        return over

    def _refuse_diverged(self) -> None:
        index = int(np.flatnonzero(~(self._sizes < LARGEST_SANE).all(axis=1))[0])
        name = f"{self.cartpole.name} (environment {index} of {self.num_envs})"
        check_sane(tuple(self._state[index].tolist()), name)

    def _rewards(self, terminations: npt.NDArray[np.bool_]) -> npt.NDArray[np.float32]:
        if self._sutton_barto_reward:
            return np.subtract(0.0, terminations, dtype=np.float32)
        return np.ones(self.num_envs, dtype=np.float32)

    def _draw(self, n: int) -> npt.NDArray[np.float64]:
        """Starting states of n environments, one row each, drawn in gymnasium's order."""
        low, high = self._bounds
        return self.np_random.uniform(low=low, high=high, size=(self._state.shape[1], n)).T

    def _place(self, ids: npt.NDArray[np.intp] | slice, states: npt.NDArray[np.float64]) -> None:
        """Put environments into states, one row each; nothing of their past remains."""
        if self._batch.persistent:
            self._batch.reset(
                np.arange(self.num_envs)[ids], stage=int(mujoco.mjtStage.mjSTAGE_NONE)
            )
        else:
            # The row is all there is, and to copy it is a hundred times quicker than `reset`.
            self._batch.state[ids] = self._fresh
        for joint, (qpos, qvel) in enumerate(self._columns):
            qpos[ids], qvel[ids] = states[:, 2 * joint], states[:, 2 * joint + 1]
        self._state[ids] = states

    def render(self) -> tuple[npt.NDArray[np.uint8], ...] | None:
        """Draw the current states.

        Returns:
            One array of shape (height, width, 3) per environment; None without a render mode,
            which warns, and before the first reset.

        Raises:
            RenderError: No picture can be made.
        """
        if self.render_mode is None:
            logger.warn(
                "You are calling render method without specifying any render mode. "
                f'Specify it when you make the env: gymnasium.make_vec("{ENV_ID}", '
                'render_mode="rgb_array")'
            )
            return None
        if not self._has_state:
            return None
        renderer = self._renderer = self._renderer or self._open_renderer()
        return tuple(renderer.render(state) for state in self._state)

    def close(self, **kwargs: object) -> None:
        """Free the renderer, if there is one."""
        if self._renderer is not None:
            self._renderer.close()
        self._renderer = None
        super().close(**kwargs)


def _needs_own_data(model: mujoco.MjModel) -> bool:
    """Whether a model remembers more than its state, so that each environment needs an MjData."""
    remembering = int(mujoco.mjtEnableBit.mjENBL_SLEEP) | int(mujoco.mjtEnableBit.mjENBL_IPC)
    return bool(model.opt.enableflags & remembering) or model.nplugin > 0


def _count(name: str, value: int) -> int:
    """A whole number from 1, or ConfigError."""
    if not isinstance(value, int | np.integer) or value < 1:
        raise ConfigError(f"{name} {value!r} makes no sense; it is a whole number from 1")
    return int(value)


def _check_render_mode(render_mode: str | None) -> None:
    if render_mode is not None and render_mode not in get_args(VectorRenderMode):
        raise ConfigError(
            f"render_mode {render_mode!r} is unknown for a vector; available: None, "
            + ", ".join(repr(mode) for mode in get_args(VectorRenderMode))
        )
