"""Many cart-poles at once, as a `gymnasium.vector.VectorEnv` on `mujoco.batch`."""

import copy
import functools
from collections.abc import Mapping
from typing import Any, Final, cast

import numpy as np
import numpy.typing as npt
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.envs.actions import action_space, controls_of_choices, controls_of_pushes
from mjcartpole.envs.disturbers import Disturbers
from mjcartpole.envs.names import FixedNames
from mjcartpole.envs.observations import Observation, observation_space, observed
from mjcartpole.envs.options import added_of, rules_of, start_bounds
from mjcartpole.envs.vector_pictures import VectorPictures, VectorRenderMode, check_render_mode
from mjcartpole.errors import ConfigError, ResetNeededError
from mjcartpole.integrator import Integrator
from mjcartpole.media.renderer import DEFAULT_HEIGHT, DEFAULT_WIDTH
from mjcartpole.media.scene import DEFAULT_CAMERA
from mjcartpole.physics.batch_simulation import BatchSimulation
from mjcartpole.physics.bodies import starting_state
from mjcartpole.physics.load import Edits, ModelLike, load_model
from mjcartpole.rewards import CONSTANT
from mjcartpole.rules import Changes
from mjcartpole.task import CARTPOLE_V1, Task, frame_rate, state_names, worst_pole

_EVERYONE: Final = slice(None)
_NOBODY: Final = np.empty(0, dtype=np.intp)


class CartPoleVectorEnv(
    VectorPictures,
    FixedNames,
    VectorEnv[npt.NDArray[np.float32], npt.NDArray[np.integer[Any]], npt.NDArray[Any]],
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
    next `reset`, also where an environment restarts by itself. `options={"reset_mask": ...}`, a
    boolean array, restarts those where it is true.

    ## Arguments

    | Parameter             | Type                   | Default     | Description                   |
    |-----------------------|------------------------|-------------|-------------------------------|
    | `num_envs`            | int                    | 1           | How many environments         |
    | `max_episode_steps`   | int or None            | None        | Steps until truncation; None: the task's 500 |
    | `model`               | str, path, MjSpec      | "cartpole"  | As in `CartPoleEnv`           |
    | `edits`               | dict                   | None        | Edits of the model, such as `{"pole.length": 1.5}` |
    | `own_timestep`        | bool                   | False       | One physics step of the file per action, instead of 0.02 s |
    | `integrator`          | "gym" or "mujoco"      | "gym"       | As in `CartPoleEnv`           |
    | `task`                | str, Task              | "CartPole-v1" | As in `CartPoleEnv`         |
    | `x_limit`, `theta_limit`, `start_low`, `start_high`, `start_angle`, `reward` | | the task's | As in `CartPoleEnv` |
    | `sutton_barto_reward` | bool                   | False       | 0 per step and -1 at termination, instead of 1 per step |
    | `observation`         | "state" or "trig"      | "state"     | As in `CartPoleEnv`           |
    | `disturbances`        | dict, Disturbances     | None        | As in `CartPoleEnv`, each also by itself; every environment has its own |
    | `threads`             | int or None            | None        | Threads that step; None: as many as pay, which the time decides |
    | `render_mode`         | None, "rgb_array", "rgb_array_list" | None | Nothing, or one picture per environment (the two are the same, as in gymnasium's vector) |
    | `width`, `height`     | int                    | 640, 480    | Size of a picture, in pixels  |
    | `camera`              | str                    | "side"      | A camera of the model         |

    `envs.state` reads and sets the float64 states, shape `(4, num_envs)` for a model with one pole,
    as in gymnasium's `CartPoleVectorEnv`; each further pole has two more rows. A copy of the vector
    (`copy.deepcopy`, `pickle`) goes on by itself, bit for bit as the original would.

    >>> envs.state = [(0, 0, 0), (0, 0, 0), (0.1, 0.1, 0.1), (0, 0, 0)]
    >>> [round(float(value), 4) for value in envs.step([1, 0, 1])[0][0]]
    [0.0, 0.1936, 0.1, -0.2595]
    >>> envs.close()

    ## Version History

    * v1: the rules of CartPole-v1.
    """  # noqa: E501 - a table's rows cannot be wrapped

    metadata: dict[str, Any] = {  # noqa: RUF012 - gymnasium's own declaration
        "render_modes": ["rgb_array"],
        "render_fps": frame_rate(),
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        num_envs: int = 1,
        *,
        max_episode_steps: int | None = None,
        model: ModelLike = "cartpole",
        edits: Edits = None,
        own_timestep: bool = False,
        integrator: Integrator = "gym",
        task: Task | str = CARTPOLE_V1,
        sutton_barto_reward: bool = False,
        observation: Observation = "state",
        threads: int | None = None,
        render_mode: VectorRenderMode | None = None,
        width: int = DEFAULT_WIDTH,
        height: int = DEFAULT_HEIGHT,
        camera: str = DEFAULT_CAMERA,
        disturbances: Disturbances | Mapping[str, Any] | None = None,
        **more: Any,  # noqa: ANN401 - rules and disturbances
    ) -> None:
        """Load the model; nothing is drawn and no OpenGL is touched until `render`.

        Raises:
            ModelError: The model cannot be found, has an error, or is no cart-pole.
            ConfigError: The integrator, the task, the observation or the render mode is unknown, a
                rule makes no sense, or `num_envs`, `max_episode_steps` or `threads` is no whole
                number from 1.
            RenderError: The size of a picture makes no sense, or the model has no such camera.
        """
        self.num_envs = _count("num_envs", num_envs)
        added = added_of(more, disturbances, edits)
        self._task = rules_of(task, cast(Changes, more), sutton_barto_reward=sutton_barto_reward)
        self._observation = observation
        steps = self._task.time_limit if max_episode_steps is None else max_episode_steps
        self.max_episode_steps = _count("max_episode_steps", steps)
        threads = None if threads is None else _count("threads", threads)
        check_render_mode(render_mode)
        self.cartpole = load_model(model, edits, own_timestep=own_timestep)
        self._simulation = BatchSimulation(self.cartpole, self.num_envs, integrator, threads)
        self._prepare_pictures(render_mode, width, height, camera)
        self.metadata = self.metadata | {"render_fps": frame_rate(self.cartpole.control_step)}
        self._make_spaces(added)
        self._prepare_episodes()

    def _make_spaces(self, added: Disturbances) -> None:
        """Say what is seen, and what an action may be and comes to."""
        controls = self.cartpole.controls
        space = observation_space(self._task, self.cartpole.poles, self._observation)
        self._disturbers = None
        if added.are_some:
            limited = self._task.with_changes(max_episode_steps=self.max_episode_steps)
            self._disturbers = Disturbers(added, self.cartpole, limited, self.num_envs)
            controls, space = (-1.0, 1.0), self._disturbers.members[0].space(space)
        self.single_observation_space = space
        self.single_action_space = action_space(self._task)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        interpret = controls_of_pushes if self._task.continuous else controls_of_choices
        self._controls_of = functools.partial(
            interpret, space=self.action_space, controls=np.array(controls)
        )

    def _prepare_episodes(self) -> None:
        """Make what lives from step to step."""
        self._bounds = self._task.start_low, self._task.start_high
        self._middle = starting_state(self.cartpole, self._task)
        self._has_state = False
        # Steps so far, and at which of them each episode is truncated.
        self._clock = 0
        self._deadlines = np.full(self.num_envs, self.max_episode_steps)
        # Indices of the environments whose last step ended an episode.
        self._ended = _NOBODY

    def __getstate__(self) -> dict[str, Any]:
        """All but the renderer, which belongs to one thread: a copy opens its own."""
        return {**self.__dict__, "_renderer": None}

    def __copy__(self) -> "CartPoleVectorEnv":
        """A copy that goes on by itself."""
        return copy.deepcopy(self)

    @property
    def state(self) -> npt.NDArray[np.float64] | None:
        """The float64 states, shape (4, num_envs) with one pole; None before a reset.

        The rows are `x, x_dot, theta, theta_dot, …`: m, m/s, rad, rad/s, as in gymnasium's vector.
        It is a copy, and read-only, so that nobody writes into it in vain: states are set as a
        whole. That leaves nothing of the motion before; the episodes go on, and those that are over
        restart with the next step.
        """
        if not self._has_state:
            return None
        state = self._simulation.state.T.copy()
        state.flags.writeable = False
        return state

    @state.setter
    def state(self, states: npt.ArrayLike) -> None:
        values, shape = np.asarray(states, dtype=np.float64), self._simulation.state.T.shape
        if values.shape != shape:
            raise ConfigError(
                f"states have the shape {shape}: one row each of "
                f"{', '.join(state_names(self.cartpole.poles))}, one column per environment, "
                f"not the shape {values.shape}"
            )
        self._simulation.set_state(_EVERYONE, values.T)
        if self._disturbers:
            self._disturbers.forget()
        self._has_state = True

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[npt.NDArray[np.float32], dict[str, Any]]:
        """Start an episode in every environment, or in some.

        Args:
            seed: Seeds the generator that all environments share, as gymnasium describes.
            options: `"low"` and `"high"`, bounds of the starting states until the next reset;
                `"reset_mask"`, a boolean array of shape (num_envs,): who starts, instead of all.

        Returns:
            Observations, shape (num_envs, 4) with one pole, and an empty dict.

        Raises:
            ConfigError: An option is unknown, or makes no sense.
            ResetNeededError: Some are to start before all have started once.
        """
        given = {} if options is None else options
        usual = self._task.start_low, self._task.start_high
        bounds = start_bounds(given, usual, "reset_mask")
        who = self._mask(given.get("reset_mask"))
        super().reset(seed=seed)
        self._bounds = bounds
        self._restart(who)
        self._has_state = True
        self._deadlines[who] = self._clock + self.max_episode_steps
        self._ended = np.setdiff1d(self._ended, who, assume_unique=True)
        return self._observe(), self._info(who)

    def _mask(self, mask: object) -> npt.NDArray[np.intp]:
        """Indices of the environments that a reset is for."""
        if mask is None:
            return np.arange(self.num_envs)
        if not (
            isinstance(mask, np.ndarray)
            and mask.dtype == np.bool_
            and mask.shape == (self.num_envs,)
            and mask.any()
        ):
            raise ConfigError(
                f"reset_mask is a numpy array of {self.num_envs} booleans, one at least True, "
                f"not {mask!r}"
            )
        if not self._has_state:
            raise ResetNeededError("Call reset without reset_mask first: all need a state.")
        return mask.nonzero()[0]

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
            actions: Integers of shape (num_envs,); of a task that takes pushes, these, float32 of
                shape (num_envs, 1).

        Returns:
            Observations, shape (num_envs, 4) with one pole; rewards, terminations and truncations,
            shape (num_envs,); and an empty dict.

        Raises:
            InvalidActionError: The actions are not in the action space.
            ResetNeededError: There is no state yet.
            SimulationError: The physics of an environment diverged; all need a reset.
        """
        controls = self._controls_of(actions)
        if not self._has_state:
            raise ResetNeededError("Call reset before using step method.")
        restarted = self._ended
        if self._disturbers:
            controls = self._disturbers.act(controls, restarted, self._simulation)
        self._simulation.step(controls)
        self._clock += 1
        if restarted.size:
            # Their step is thrown away, as gymnasium does: cheaper than to choose who steps.
            self._restart(restarted)
            self._deadlines[restarted] = self._clock + self.max_episode_steps
        terminations = self._have_terminated()
        truncations = self._deadlines <= self._clock
        rewards = self._rewards(terminations)
        if restarted.size:
            rewards[restarted] = 0.0
            terminations[restarted] = False
        self._ended = np.logical_or(terminations, truncations).nonzero()[0]
        return self._observe(), rewards, terminations, truncations, self._info(restarted)

    def _restart(self, who: npt.NDArray[np.intp]) -> None:
        if self._disturbers:
            self._disturbers.begin(who.tolist(), self._simulation, self.np_random)
        self._simulation.set_state(who, self._draw(who.size))

    def _observe(self) -> npt.NDArray[np.float32]:
        states = self._simulation.state
        if self._disturbers:
            return self._disturbers.observe(range(self.num_envs), states, self._observation)
        return observed(states, self._task, self._observation)

    def _info(self, started: npt.NDArray[np.intp]) -> dict[str, Any]:
        """What is told of environments that begin an episode."""
        info: dict[str, Any] = {}
        if self._disturbers and self._disturbers.vary:
            for index, own in self._disturbers.infos(started.tolist()):
                info = self._add_info(info, own, index)
        return info

    def _have_terminated(self) -> npt.NDArray[np.bool_]:
        """Whose state is beyond a limit, shape (num_envs,); a new array."""
        sizes = self._simulation.sizes()
        over = sizes[:, 0] > self._task.x_limit
        for pole in range(self.cartpole.poles):
            over |= sizes[:, 2 + 2 * pole] > self._task.theta_limit
        return over

    def _rewards(self, terminations: npt.NDArray[np.bool_]) -> npt.NDArray[np.float32]:
        reward = self._task.reward
        if reward in CONSTANT:
            rewards = np.full(self.num_envs, CONSTANT[reward], dtype=np.float32)
            if terminations.any():
                rewards[terminations] = reward(0.0, 0.0, 0.0, 0.0, True)
            return rewards
        pairs = zip(
            self._task.seen(self._simulation.state).tolist(), terminations.tolist(), strict=True
        )
        values = [reward(*worst_pole(state), over) for state, over in pairs]
        return np.array(values, dtype=np.float32)

    def _draw(self, n: int) -> npt.NDArray[np.float64]:
        """Starting states of n environments, one row each, drawn in gymnasium's order."""
        low, high = self._bounds
        size = self._simulation.state.shape[1], n
        drawn = self.np_random.uniform(low=low, high=high, size=size).T
        return drawn + self._middle if self._task.start_angle else drawn


def _count(name: str, value: int) -> int:
    """A whole number from 1, or ConfigError."""
    if not isinstance(value, int | np.integer) or value < 1:
        raise ConfigError(f"{name} {value!r} makes no sense; it is a whole number from 1")
    return int(value)
