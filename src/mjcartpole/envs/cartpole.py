"""CartPole-v1 with MuJoCo underneath, as a `gymnasium.Env`."""

from collections.abc import Callable, Mapping
from typing import Any, cast

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium import logger

from mjcartpole.disturbances.contexts import Context
from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.envs.actions import STEP_AFTER_END, action_space, invalid
from mjcartpole.envs.copied import Copied, needs_reset
from mjcartpole.envs.disturber import Disturber
from mjcartpole.envs.editable import Editable
from mjcartpole.envs.names import CartPoleNames, refuse_slip
from mjcartpole.envs.observations import Observation, observed, observer
from mjcartpole.envs.options import added_of, rules_of, start_bounds
from mjcartpole.envs.pictures import InNotebooks, Pictures, RenderMode, warn_without_mode
from mjcartpole.envs.spec import PortableSpec
from mjcartpole.errors import ConfigError
from mjcartpole.integrator import Integrator
from mjcartpole.media.renderer import DEFAULT_HEIGHT, DEFAULT_WIDTH
from mjcartpole.media.scene import DEFAULT_CAMERA
from mjcartpole.physics.bodies import starting_state
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.load import Edits, ModelLike, load_shared
from mjcartpole.physics.simulation import FARTHEST_SANE, Simulation, State, as_seen, check_sane
from mjcartpole.rewards import CONSTANT
from mjcartpole.rules import Changes
from mjcartpole.task import CARTPOLE_V1, Task, frame_rate

# What `step` needs, as plain globals: the fewest look-ups and no sign to change.
_INT64 = np.int64
_FARTHEST = FARTHEST_SANE


class CartPoleEnv(
    InNotebooks,
    PortableSpec,
    Copied,
    gymnasium.Env[npt.NDArray[np.float32], np.int64 | int],
    CartPoleNames,
):
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
    theta_dot; `reset(options={"low": ..., "high": ...})` draws from other bounds, and
    `reset(options={"edits": {"pole.length": 1.5}})` edits the model, each until the next reset.

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
    | `task`                | str, Task              | "CartPole-v1" | Other rules: limits, starting states, rewards; see `mjcartpole.Task` |
    | `x_limit`, `theta_limit` | float               | the task's  | How far the cart (m) and a pole (rad) may go; `math.inf` for any distance, any angle |
    | `start_low`, `start_high`, `start_angle` | float | the task's | Bounds of the starting state's values; where a pole starts (rad), to which they are added |
    | `reward`              | str, function          | the task's  | "one-per-step", "minus-one-at-the-end", "upright", or one's own; see `mjcartpole.Task` |
    | `sutton_barto_reward` | bool                   | False       | See Rewards                   |
    | `observation`         | "state" or "trig"      | "state"     | "trig": `x, x_dot`, and of each pole `cos theta, sin theta, theta_dot` |
    | `disturbances`        | dict, Disturbances     | None        | What reality adds: `vary`, `delay`, `noise`, …, each also by itself; see docs/robustness.md |
    | `render_mode`         | None, "rgb_array", "human" | None    | Nothing, arrays, or a window (where there is a screen) |
    | `width`, `height`     | int                    | 640, 480    | Size of a picture, in pixels  |
    | `camera`              | str                    | "side"      | A camera of the model         |

    `env.unwrapped.state` reads and sets the float64 state. What `CartPole-v1` has as attributes is
    there too: `gravity`, `masscart`, `masspole`, `length` (half the pole's), `force_mag`, `tau`,
    `kinematics_integrator`, and `total_mass` and `polemass_length`, which follow from these.
    Reading them says what the model has; setting one edits the model's document, with effect from
    the next reset. `x_threshold` and `theta_threshold_radians` hold from the next step; pictures
    keep showing the task's.

    >>> env.unwrapped.state = (0.0, 0.0, 0.1, 0.0)
    >>> [round(float(value), 4) for value in env.step(1)[0]]
    [0.0, 0.1936, 0.1, -0.2595]
    >>> env.close()

    ## Version History

    * v1: the rules of CartPole-v1.
    """  # noqa: E501 - a table's rows cannot be wrapped

    metadata: dict[str, Any] = {  # noqa: RUF012 - gymnasium's own declaration
        "render_modes": ["human", "rgb_array"],
        "render_fps": frame_rate(),
    }

    def __init__(
        self,
        *,
        model: ModelLike = "cartpole",
        edits: Edits = None,
        own_timestep: bool = False,
        integrator: Integrator = "gym",
        task: Task | str = CARTPOLE_V1,
        sutton_barto_reward: bool = False,
        observation: Observation = "state",
        render_mode: RenderMode | None = None,
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
                rule makes no sense, or a window is to have a size.
            RenderError: The size of a picture makes no sense, or the model has no such camera.
        """
        cartpole = load_shared(model, edits, own_timestep=own_timestep)
        self._model = Editable(cartpole, integrator)
        # Made when it is first needed: it takes several times as long as all the rest.
        self._simulation: Simulation | None = None
        added = added_of(more, disturbances, edits)
        self._task = rules_of(task, cast(Changes, more), sutton_barto_reward=sutton_barto_reward)
        self.disturber = Disturber.where_needed(added, cartpole, self._task)
        self._observation = observation
        if self._task.continuous and type(self) is CartPoleEnv:
            raise ConfigError(f"{self._task.name} takes pushes; see ContinuousCartPoleEnv")
        self._bounds = self._task.start_low, self._task.start_high
        self._set_limits(self._task.x_limit, self._task.theta_limit)
        self.action_space = action_space(self._task)
        self.render_mode = render_mode
        self._pictures = Pictures(cartpole, render_mode, width, height, camera, self._task)
        self._advance: Callable[[float], State] = needs_reset
        self._steps_after_end: list[int | None] = [None]
        self._left, self._right = cartpole.controls
        self._set_frame_rate(cartpole)

    def _set_frame_rate(self, cartpole: CartPole) -> None:
        self.metadata = self.metadata | {"render_fps": frame_rate(cartpole.control_step)}

    @property
    def simulation(self) -> Simulation:
        """The physics: MuJoCo's model and data, and the cart-pole that they are of."""
        return self._begin() if self._simulation is None else self._simulation

    @simulation.setter
    def simulation(self, simulation: Simulation) -> None:
        self._simulation, self._model.is_stale = simulation, False
        self._wire(simulation)

    def _begin(self, edits: Edits = None, context: Context | None = None) -> Simulation:
        """Simulate the model as it is now, with edits and a context that last one episode."""
        before, simulation = self._simulation, self._model.begin(edits, context)
        if self.disturber:
            self.disturber.fit(simulation.cartpole)
        self._simulation = simulation
        self._wire(simulation)
        self._pictures.close()
        if before and before.cartpole.control_step != simulation.cartpole.control_step:
            self._set_frame_rate(simulation.cartpole)
        return simulation

    def _wire(self, simulation: Simulation) -> None:
        """Keep what `step` needs of a simulation at hand."""
        poles = simulation.cartpole.poles
        self._move: Callable[[float], State] = as_seen(simulation, self._task)
        self._middle = starting_state(simulation.cartpole, self._task)
        self._left, self._right = simulation.cartpole.controls
        observation = np.zeros(4, dtype=np.float32)
        # A view that takes single floats several times faster than the array does.
        cells: memoryview[float] = observation.data.cast("B").cast("f")
        observe: Callable[[], npt.NDArray[np.float32]] = observation.copy
        if poles > 1 or self._observation != "state":
            observe = observer(simulation, self._task, self._observation)
        if self.disturber:
            self._move, observe = self.disturber.wires(simulation, self._move, self._observation)
            self._left, self._right = -1.0, 1.0
        self._at_hand = (*self._limits, cells, observe, CONSTANT.get(self._task.reward))

    def _set_limits(self, x: float, theta: float) -> None:
        super()._set_limits(x, theta)
        if self._simulation is not None:
            self._wire(self._simulation)

    def __setattr__(self, name: str, value: object) -> None:
        own = name[0] == "_" or type(self) is not CartPoleEnv or hasattr(CartPoleEnv, name)
        if not own and name not in gymnasium.Env.__annotations__:
            refuse_slip(name)
        super().__setattr__(name, value)

    @property
    def state(self) -> npt.NDArray[np.float64] | None:
        """The float64 state, two values for the cart and for each pole; None before a reset.

        It is `(x, x_dot, theta, theta_dot)`: m, m/s, rad, rad/s; shape (4,) with one pole.
        """
        return None if self._advance is needs_reset else self.simulation.state

    @state.setter
    def state(self, state: npt.ArrayLike) -> None:
        self.simulation.state = state
        if self.disturber:
            self.disturber.forget()
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
            raise invalid(action)
        # A numpy integer tells whether it is zero much sooner than whether it equals one.
        if not action:
            control = self._left
        elif action == 1:
            control = self._right
        else:
            raise invalid(action)
        advance = self._advance
        x, x_dot, theta, theta_dot = advance(control)
        x_min, x_max, theta_min, theta_max, cells, observe, reward = self._at_hand
        if (
            x_min <= x <= x_max
            and theta_min <= theta <= theta_max
            # Neither velocity is NaN, or so large that the physics have diverged.
            and -_FARTHEST < x_dot - theta_dot < _FARTHEST
        ):
            terminated = False
        else:
            terminated, reward = True, self._end((x, x_dot, theta, theta_dot))
        if reward is None:
            reward = self._task.reward(x, x_dot, theta, theta_dot, False)
        # None is told apart sooner than a word is.
        if self.render_mode is not None and self.render_mode == "human":
            self.render()
        cells[0] = x
        cells[1] = x_dot
        cells[2] = theta
        cells[3] = theta_dot
        return observe(), reward, terminated, False, {}

    def _end(self, state: tuple[float, float, float, float]) -> float:
        """Return the reward of a step that ends the episode, or comes after its end."""
        check_sane(tuple(self.simulation.state.tolist()), self.simulation.cartpole.name)
        count = self._steps_after_end
        if count[0] is None:
            count[0] = 0
            return self._task.reward(*state, True)
        if count[0] == 0:
            logger.warn(STEP_AFTER_END)
        count[0] += 1
        # Nothing is earned after the end.
        return min(0.0, self._task.reward(*state, True))

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[npt.NDArray[np.float32], dict[str, Any]]:
        """Start an episode.

        Args:
            seed: Seeds the env's generator, as gymnasium describes.
            options: `{"low": float, "high": float, "edits": …}`: bounds of the starting state and
                edits of the model (see `load_model`), all of them until the next reset.

        Raises:
            ConfigError: There is no such option, a bound is no finite number, low is above high,
                or an edit makes no sense; nothing has changed then.
            ModelError: The edits make the model one that cannot be used.
        """
        (low, high), edits = self._bounds, None
        if options is not None:
            low, high = start_bounds(options, self._bounds, "edits")
            edits = options.get("edits")
        simulation, disturber = self._simulation, self.disturber
        varies = disturber is not None and disturber.varies
        if not varies and (simulation is None or self._model.is_stale or edits):
            simulation = self._begin(edits)
        super().reset(seed=seed)
        if disturber is not None:
            context = disturber.draw(self.np_random, edits)
            simulation = self._begin(edits, context) if varies else simulation
        assert simulation
        state = self.np_random.uniform(low=low, high=high, size=simulation.size)
        if self._task.start_angle:
            state += self._middle
        simulation.set_state(state.tolist())
        # Attributes are set where they change only: that takes as long as a step's arithmetic.
        if self._advance is not self._move:
            self._advance = self._move
        self._steps_after_end[0] = None
        if self.render_mode == "human":
            self.render()
        if disturber is not None:
            return disturber.first(self._task.seen(state), self._observation)
        return observed(state, self._task, self._observation), {}

    def render(self) -> npt.NDArray[np.uint8] | None:
        """Draw the current state.

        Returns:
            An array of shape (height, width, 3) in mode "rgb_array"; None in mode "human", which
            shows a window, without a render mode, which warns, and before the first reset.

        Raises:
            RenderError: No picture can be made.
        """
        if self.render_mode is None:
            warn_without_mode()
            return None
        if self.state is None:
            return None
        if self.render_mode == "human":
            self._pictures.show(self.simulation.cartpole, self.state)
            return None
        return self._pictures.draw(self.simulation.cartpole, self.state)

    def close(self) -> None:
        """Free the renderer and the window, if there are any."""
        self._pictures.close()
