"""CartPole-v1 with MuJoCo underneath, as a `dm_env.Environment` built on dm_control.

Nothing but this file and `dm_physics.py` imports it, since dm_control takes a second or two.
"""

import collections
import functools
import math
import operator
from collections.abc import Mapping
from typing import Any, Final, cast, get_args

import numpy as np
import numpy.typing as npt

from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.envs.disturber import Disturber
from mjcartpole.envs.disturbers import in_step
from mjcartpole.envs.dm_physics import HIGHLIGHT, Physics, StartingStates, control, specs
from mjcartpole.envs.observations import Observation, with_cosines
from mjcartpole.envs.options import added_of
from mjcartpole.errors import ConfigError, check_known
from mjcartpole.physics.bodies import starting_state
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.load import Edits, ModelLike, load_model
from mjcartpole.physics.variants import variant
from mjcartpole.rules import MOST_STEPS, Changes
from mjcartpole.task import (
    CARTPOLE_V1,
    CONTROL_STEP,
    N_ACTIONS,
    TASKS,
    Task,
    control_of,
    worst_pole,
)

BALANCE: Final = "balance"
"""What dm_control's suite calls the task that is CartPole-v1."""

__all__ = [
    "BALANCE",
    "HIGHLIGHT",
    "Balance",
    "DisturbedBalance",
    "Physics",
    "StartingStates",
    "load",
]


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
        """Take what decides an episode; it is cut off after `limit` control steps.

        `random` draws the starting states, or is a seed, or None to draw one. Actions are 0 and 1
        if they are discrete, else controls; angles are observed themselves, or by cosine and sine.

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
        self.steps = 0
        self._show_reward(physics)

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
        self.push(self._control(np.asarray(action)), physics)

    def push(self, control: float, physics: Physics) -> None:
        """Let the motor have a control."""
        physics.set_control([control])

    def after_step(self, physics: Physics) -> None:
        """Count, and show the reward where that is wanted."""
        self.steps += 1
        self._show_reward(physics)

    def get_observation(
        self, physics: Physics
    ) -> "collections.OrderedDict[str, npt.NDArray[np.float64]]":
        """The state, positions and velocities apart."""
        state = self.seen(physics)
        if self._is_trig:
            both = with_cosines(state)
            position = np.delete(both, np.s_[1::3])
            return collections.OrderedDict(position=position, velocity=both[1::3])
        state = self._rules.seen(state)
        return collections.OrderedDict(position=state[0::2], velocity=state[1::2])

    def seen(self, physics: Physics) -> npt.NDArray[np.float64]:
        """What is seen of the state; how angles count is of no account yet."""
        return physics.state

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


class DisturbedBalance(Balance):
    """`Balance` with disturbances, which are those of the gymnasium environment, bit for bit.

    - What lasts from step to step is seen besides: `actions`, the last ones, and `context`, what
      varies, where that is asked for.
    - What an episode has drawn is in `task.disturber.context`.

    Attributes:
        disturber: Adds them.
    """

    def __init__(self, cartpole: CartPole, disturbances: Disturbances, **settings: Any) -> None:  # noqa: ANN401
        super().__init__(cartpole, **settings)
        steps = int(min(self._limit, MOST_STEPS))
        limited = self._rules.with_changes(max_episode_steps=steps)
        self.disturber = Disturber(disturbances, cartpole, limited)
        self._base, self._own_controls = cartpole, cartpole.controls
        self._seen: tuple[int, npt.NDArray[np.float64]] | None = None

    def initialize_episode(self, physics: Physics) -> None:
        """Draw a model and a starting state."""
        random = self.random
        seeded = random.seeded if isinstance(random, StartingStates) else random
        context = self.disturber.draw(seeded)  # type: ignore[arg-type]
        if self.disturber.varies:
            cartpole = in_step(variant(self._base, context), self._base)
            physics.become(cartpole)
            self.disturber.fit(cartpole)
            self._own_controls = cartpole.controls
        self.disturber.forget()
        self._seen = None
        super().initialize_episode(physics)

    def push(self, control: float, physics: Physics) -> None:
        """Let the motor make what it does of a control, and apply the force besides."""
        left, right = self._controls
        made, force = self.disturber.actuate((2.0 * control - left - right) / (right - left))
        physics.data.qfrc_applied[physics.cartpole.slider] = force
        super().push(control_of(made, self._own_controls), physics)

    def seen(self, physics: Physics) -> npt.NDArray[np.float64]:
        """What is seen of the state: the same however often it is looked at."""
        if not self.disturber.is_drawing:
            return super().seen(physics)
        if self._seen is None or self._seen[0] != self.steps:
            self._seen = self.steps, self.disturber.sense(self._rules.seen(physics.state))
        return self._seen[1]

    def get_observation(
        self, physics: Physics
    ) -> "collections.OrderedDict[str, npt.NDArray[np.float64]]":
        """The state, positions and velocities apart, and what is seen besides."""
        observation = super().get_observation(physics)
        besides, actions = self.disturber.seen_besides, self.disturber.effects.actions
        if actions:
            observation["actions"] = np.array(besides[:actions])
        if self.disturber.disturbances.observe_context:
            n = len(self.disturber.disturbances.ranges)
            observation["context"] = np.array(besides[actions:] or [0.0] * n)
        return observation


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
    disturbances: Disturbances | Mapping[str, Any] | None = None,
    **more: Any,  # noqa: ANN401 - rules and disturbances
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
        disturbances: What reality adds; see `DisturbedBalance`.
        more: Each disturbance by itself; and rules that are other than the task's: `x_limit`,
            `theta_limit`, `start_low`, `start_high`, `start_angle`, `reward`; see
            `mjcartpole.Task`.

    Raises:
        ConfigError: There is no such task, or a setting makes no sense.
        ModelError: The model cannot be used.
    """
    known = {BALANCE: CARTPOLE_V1, **TASKS}
    check_known("task", task_name, known)
    added = added_of(more, disturbances, edits)
    task = known[task_name].with_changes(**cast(Changes, more))
    if seed is not None and seed < 0:
        raise ConfigError(f"seed must be a whole number from 0 up, not {seed}")
    cartpole = load_model(model, edits, own_timestep=own_timestep)
    seconds = task.time_limit * CONTROL_STEP if time_limit is None else time_limit
    limit = _steps_in(seconds, cartpole.control_step)
    kind = functools.partial(DisturbedBalance, disturbances=added) if added.are_some else Balance
    balance = kind(
        cartpole, random=seed, limit=limit, discrete=discrete, rules=task, observation=observation
    )
    balance.visualize_reward = visualize_reward
    # Without dm_control's half steps, a step is one call of mj_step, whatever the solver.
    settings = {"legacy_step": False, **(environment_kwargs or {})}
    physics = Physics.of(cartpole)
    return control.Environment(physics, balance, n_sub_steps=cartpole.substeps, **settings)


def _steps_in(seconds: float, control_step: float) -> float:
    """Return how many control steps an episode of so many seconds has, one at least."""
    if not seconds > 0:
        raise ConfigError(f"time_limit must be more than 0 seconds, not {seconds}")
    return seconds if math.isinf(seconds) else max(1, round(seconds / control_step))
