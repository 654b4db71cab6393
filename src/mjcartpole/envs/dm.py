"""CartPole-v1 with MuJoCo underneath, as a `dm_env.Environment` built on dm_control.

Nothing else of this package imports dm_control, which takes a second or two.
"""

import collections
import copy
import math
import operator
import warnings
from typing import Any, Final, Unpack, get_args

import numpy as np
import numpy.typing as npt

from mjcartpole.envs.observations import Observation, with_cosines
from mjcartpole.errors import ConfigError, check_known
from mjcartpole.physics.bodies import starting_state
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.load import Edits, ModelLike, load_model
from mjcartpole.rules import Changes
from mjcartpole.task import (
    CARTPOLE_V1,
    CONTROL_STEP,
    N_ACTIONS,
    TASKS,
    Task,
    worst_pole,
)

try:
    with warnings.catch_warnings():
        # It looks for a window system on import, and warns where there is none.
        warnings.simplefilter("ignore")
        from dm_control import mujoco
        from dm_control.mujoco import wrapper
        from dm_control.rl import control
        from dm_env import specs  # type: ignore[import-untyped]

        # Its list of MuJoCo's fields may be another version's, which shows at the first model.
        mujoco.Physics.from_xml_string("<mujoco/>")
except Exception as error:
    _why = " ".join(f"{type(error).__name__}: {error}".split())
    raise ImportError(
        f"mjcartpole.envs.dm needs dm_control, which does not load: {_why}; it comes along "
        "on Python 3.11 and 3.12, and fits MuJoCo below 4"
    ) from error

BALANCE: Final = "balance"
"""What dm_control's suite calls the task that is CartPole-v1."""

HIGHLIGHT: Final = (0.0, 0.5, 0.3)
"""What poles look like at reward 1, where rewards are to be seen: the suite's own colour."""


class StartingStates(np.random.RandomState):
    """Draws starting states: what dm_control calls a task's `random`.

    It has the methods of a `RandomState`, and the draws of gymnasium's generators: one seed gives
    the same starting states in both worlds.
    """

    def __init__(self, seed: int | np.random.PCG64 | None = None) -> None:
        """Seed it; None draws a seed, and a bit generator is taken as it stands."""
        super().__init__(seed if isinstance(seed, np.random.PCG64) else np.random.PCG64(seed))

    def seed(self, seed: int | None = None) -> None:  # type: ignore[override]
        """Start anew from a seed; None draws one."""
        self._bit_generator.state = np.random.PCG64(seed).state

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy keeps the class, and with it the way of seeding."""
        return type(self), (self._bit_generator,)


class Physics(mujoco.Physics):  # type: ignore[misc]
    """dm_control's physics, with readings that have names."""

    cartpole: CartPole

    @classmethod
    def of(cls, cartpole: CartPole) -> "Physics":
        """Physics of a cart-pole; whatever is changed in its model stays there."""
        physics: Physics = cls.from_model(wrapper.MjModel(copy.copy(cartpole.model)))
        physics.cartpole = cartpole
        return physics

    def copy(self, share_model: bool = False) -> "Physics":
        """A copy that moves on its own; see dm_control."""
        copied: Physics = super().copy(share_model)
        copied.cartpole = self.cartpole
        return copied

    def __getstate__(self) -> tuple[Any, CartPole]:
        return super().__getstate__(), self.cartpole

    def __setstate__(self, state: tuple[Any, CartPole]) -> None:
        data, self.cartpole = state
        super().__setstate__(data)

    def after_reset(self) -> None:
        """Bring all that follows from the state up to date; an episode has no past."""
        super().after_reset()
        # The solver would begin its first step from here, and end at other bits.
        self.data.qacc_warmstart[:] = 0

    @property
    def state(self) -> npt.NDArray[np.float64]:
        """The state `(x, x_dot, theta, theta_dot, …)`, a copy; m, m/s, rad, rad/s."""
        joints = list(self.cartpole.joints)
        return np.column_stack([self.data.qpos[joints], self.data.qvel[joints]]).ravel()

    def set_state(self, state: npt.NDArray[np.float64]) -> None:
        """Put the cart-pole into a state; inside `reset_context`."""
        joints = list(self.cartpole.joints)
        self.data.qpos[joints], self.data.qvel[joints] = state[0::2], state[1::2]

    def cart_position(self) -> float:
        """Where the cart is, m."""
        return float(self.data.qpos[self.cartpole.slider])

    def pole_angles(self) -> npt.NDArray[np.float64]:
        """How far each pole leans, rad, shape (poles,)."""
        angles: npt.NDArray[np.float64] = self.data.qpos[list(self.cartpole.hinges)]
        return angles

    def show(self, reward: float) -> None:
        """Colour the poles by a reward from 0, their own colour, to 1, `HIGHLIGHT`."""
        own, weight = self.cartpole.model.geom_rgba, min(max(reward, 0.0), 1.0) ** 4
        poles = self.cartpole.model.dof_bodyid[list(self.cartpole.hinges)]
        geoms = np.isin(self.cartpole.model.geom_bodyid, poles)
        self.model.geom_rgba[geoms, :3] = (
            weight * np.array(HIGHLIGHT) + (1 - weight) * own[geoms, :3]
        )


class Balance(control.Task):  # type: ignore[misc]
    """CartPole-v1's rules as a dm_control task.

    - Action: the actuator's control, shape (1,), between those of CartPole-v1's two actions: for
      the reference model -1 to 1, which its gear makes -10 to 10 N, as in dm_control's suite. What
      lies outside counts as the nearer end. With `discrete`, it is CartPole-v1's own: 0 pushes to
      the left, 1 to the right.
    - Observation: an OrderedDict of `position`, `(x, theta)`, and `velocity`, `(x_dot, theta_dot)`,
      each of shape (2,), float64; one more angle each for each further pole. With `trig`, cosine
      and sine are there in place of each angle: `(x, cos theta, sin theta)`, as in dm_control's.
    - Reward 1 for every step, the last one included. Discount 0 where a pole leans more than 12
      degrees or the cart is more than 2.4 m from the middle, 1 elsewhere, the time limit included.
    - Each of the state's values starts uniformly within ±0.05. A seed gives the starting
      states that the gymnasium environment has after `reset(seed=...)` and further resets.

    Attributes:
        steps: Control steps of this episode.
    """

    def __init__(
        self,
        cartpole: CartPole,
        *,
        random: np.random.RandomState | int | None,
        limit: float,
        discrete: bool,
        rules: Task = CARTPOLE_V1,
        observation: Observation = "state",
    ) -> None:
        """Take what decides an episode.

        Args:
            cartpole: What moves.
            random: Draws the starting states; or a seed, or None to draw one.
            limit: Control steps until an episode is cut off.
            discrete: Whether actions are 0 and 1, instead of controls.
            rules: Limits, starting states and rewards.
            observation: Whether angles are observed themselves, or by cosine and sine.

        Raises:
            ConfigError: There is no such observation.
        """
        # Programs made for dm_control's suite put another one in its place, under this name.
        self._random = (
            random if isinstance(random, np.random.RandomState) else StartingStates(random)
        )
        self.steps = 0
        self._controls = cartpole.controls
        self._limit = limit
        self._rules, self._middle = rules, starting_state(cartpole, rules)
        self._discrete = discrete
        check_known("observation", observation, get_args(Observation))
        self._is_trig = observation == "trig"
        self._visualize_reward = False

    @property
    def random(self) -> np.random.RandomState:
        """Draws the starting states; `task.random.seed(3)` starts it anew."""
        return self._random

    @property
    def visualize_reward(self) -> bool:
        """Whether the poles are coloured by the reward."""
        return self._visualize_reward

    @visualize_reward.setter
    def visualize_reward(self, value: bool) -> None:
        if not isinstance(value, bool):
            raise ConfigError(f"visualize_reward is True or False, not {value!r}")
        self._visualize_reward = value

    def initialize_episode(self, physics: Physics) -> None:
        """Draw a starting state."""
        low, high = self._rules.start_low, self._rules.start_high
        size = 2 * len(physics.cartpole.joints)
        drawn = self.random.uniform(low=low, high=high, size=size)
        physics.set_state(drawn + self._middle)
        self._show_reward(physics)
        self.steps = 0

    def action_spec(self, physics: Physics) -> specs.BoundedArray:
        """What actions look like."""
        if self._discrete:
            return specs.DiscreteArray(N_ACTIONS, dtype=np.int64, name="action")
        low, high = sorted(self._controls)
        return specs.BoundedArray((1,), np.float64, [low], [high], name="action")

    def before_step(self, action: npt.ArrayLike, physics: Physics) -> None:
        """Push.

        Raises:
            ConfigError: A discrete action is neither 0 nor 1, or another is no finite number.
        """
        physics.set_control([self._control(np.asarray(action))])

    def after_step(self, physics: Physics) -> None:
        """Count, and show the reward where that is wanted."""
        self.steps += 1
        self._show_reward(physics)

    def get_observation(
        self, physics: Physics
    ) -> "collections.OrderedDict[str, npt.NDArray[np.float64]]":
        """The state, positions and velocities apart."""
        if self._is_trig:
            both = with_cosines(physics.state)
            position = np.delete(both, np.s_[1::3])
            return collections.OrderedDict(position=position, velocity=both[1::3])
        state = self._rules.seen(physics.state)
        return collections.OrderedDict(position=state[0::2], velocity=state[1::2])

    def get_reward(self, physics: Physics) -> float:
        """Return the task's reward: of CartPole-v1, 1 for every step."""
        x, x_dot, theta, theta_dot = worst_pole(self._rules.seen(physics.state).tolist())
        return self._rules.reward(x, x_dot, theta, theta_dot, self._rules.has_ended(x, theta))

    def get_termination(self, physics: Physics) -> float | None:
        """Return the discount of the step that ends an episode; None while it goes on."""
        x, _, theta, _ = worst_pole(self._rules.seen(physics.state).tolist())
        if self._rules.has_ended(x, theta):
            return 0.0
        return 1.0 if self.steps >= self._limit else None

    def _show_reward(self, physics: Physics) -> None:
        if self._visualize_reward:
            physics.show(self.get_reward(physics))

    def _control(self, action: npt.NDArray[Any]) -> float:
        if self._discrete:
            try:
                return self._controls[(0, 1).index(operator.index(action.item()))]
            except (TypeError, ValueError):
                raise ConfigError(f"{action!r} is no action; the actions are 0 and 1") from None
        if action.size != 1 or not np.isfinite(action).all():
            raise ConfigError(f"an action is one finite control, shape (1,), not {action!r}")
        low, high = sorted(self._controls)
        return min(max(float(action.item()), low), high)


def load(
    task_name: str = "balance",
    *,
    model: ModelLike = "cartpole",
    edits: Edits = None,
    own_timestep: bool = False,
    seed: int | None = None,
    discrete: bool = False,
    time_limit: float | None = None,
    environment_kwargs: dict[str, Any] | None = None,
    visualize_reward: bool = False,
    observation: Observation = "state",
    **rules: Unpack[Changes],
) -> control.Environment:
    """Make CartPole-v1 as a dm_control environment; see `Balance` for its rules.

    The integrator is the one that the model's file names, as everywhere in dm_control: states are
    those of `mj_step`, and of the gymnasium environment with `integrator="mujoco"`, bit for bit.

    >>> env = load("balance", seed=0)
    >>> env.reset().observation["position"].round(4)
    array([ 0.0137, -0.0459])
    >>> env.step(env.action_spec().maximum).reward
    1.0

    Args:
        task_name: `balance`, which is CartPole-v1, or the name of another task.
        model: See `load_model`.
        edits: Changes of it; see `load_model`.
        own_timestep: See `load_model`.
        seed: Seeds the starting states; None draws one.
        discrete: Take CartPole-v1's actions 0 and 1 instead of a control between their two.
        time_limit: Seconds until an episode is cut off, the task's if left out; `float("inf")`
            for never.
        environment_kwargs: More for dm_control's `Environment`, such as `flat_observation`.
        visualize_reward: Colour the poles by the reward, in pictures.
        observation: `trig` for cosine and sine in place of each angle.
        rules: Those that are other than the task's: `x_limit`, `theta_limit`, `start_low`,
            `start_high`, `start_angle`, `reward`; see `mjcartpole.Task`.

    Raises:
        ConfigError: There is no such task, or a setting makes no sense.
        ModelError: The model cannot be used.
    """
    known = {BALANCE: CARTPOLE_V1, **TASKS}
    check_known("task", task_name, known)
    task = known[task_name].with_changes(**rules)
    if time_limit is None:
        time_limit = task.time_limit * CONTROL_STEP
    if not time_limit > 0:
        raise ConfigError(f"time_limit must be more than 0 seconds, not {time_limit}")
    if seed is not None and seed < 0:
        raise ConfigError(f"seed must be a whole number from 0 up, not {seed}")
    cartpole = load_model(model, edits, own_timestep=own_timestep)
    limit = time_limit
    if not math.isinf(time_limit):
        limit = max(1, round(time_limit / cartpole.control_step))
    balance = Balance(
        cartpole,
        random=seed,
        limit=limit,
        discrete=discrete,
        rules=task,
        observation=observation,
    )
    balance.visualize_reward = visualize_reward
    # Without dm_control's half steps, a step is one call of mj_step, whatever the solver.
    settings = {"legacy_step": False, **(environment_kwargs or {})}
    physics = Physics.of(cartpole)
    return control.Environment(physics, balance, n_sub_steps=cartpole.substeps, **settings)
