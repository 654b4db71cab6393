"""Tasks: the rules of the game, as numbers and pure functions.

Only the rules: no physics engine, no gymnasium. A `Task` holds all of them; `CARTPOLE_V1` has the
numbers of gymnasium's `CartPole-v1` (Barto, Sutton and Anderson, 1983,
doi:10.1109/TSMC.1983.6313077).
"""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeVar, Unpack

import numpy as np
import numpy.typing as npt

from mjcartpole.errors import ConfigError, check_known
from mjcartpole.rewards import CONSTANT, Reward, named, one_per_step, upright
from mjcartpole.rules import RULES, Changes, checked

CONTROL_STEP: Final = 0.02
"""Seconds between two actions."""

_TURN: Final = 2 * math.pi

_FEWEST_STARTS: Final = 0.01
"""Of all starts, within each limit: the others are over before they have begun."""

Number = TypeVar("Number", float, npt.NDArray[np.float64])
"""One, or many."""


@dataclass(frozen=True)
class Task:
    """The rules of one game.

    >>> TASKS["CartPole-v1"].has_ended(2.5, 0.0)
    True

    Attributes:
        name: What it is called; `mjcartpole/<name>` is its id in gymnasium.
        x_limit: The cart's centre may be this far from the middle of the track, in metres;
            `math.inf` for a track that ends no episode.
        theta_limit: The pole may lean this far, in radians; `math.inf` for any angle, which then
            counts from -pi to pi: in observations, for the reward and for the rules.
        start_low: Lower bound of each of the starting state's values, drawn uniformly.
        start_high: Upper bound.
        reward: Reward of one control step.
        time_limit: Control steps until an episode is truncated.
        reward_threshold: Mean return at which it counts as solved; None where nothing is agreed.
        start_angle: Where poles start, in radians: 0 upright, pi hanging; what is drawn is added. A
            pole on another starts in line with it.
        continuous: Whether an action is any push from -1, action 0's, to 1, action 1's.
    """

    name: str
    x_limit: float = 2.4
    theta_limit: float = 12 * 2 * math.pi / 360
    start_low: float = -0.05
    start_high: float = 0.05
    reward: Reward = one_per_step
    time_limit: int = 500
    reward_threshold: float | None = None
    start_angle: float = 0.0
    continuous: bool = False

    def __post_init__(self) -> None:
        """Refuse rules that make no sense (ConfigError)."""
        # Without the sum, numpy calls 0.0 to -0.0 a range that runs backwards.
        object.__setattr__(self, "start_high", self.start_high + 0.0)
        bounds = self.start_low, self.start_high
        for rule, holds in {
            "x_limit and theta_limit are more than 0, or infinite": self.x_limit > 0
            and self.theta_limit > 0,
            "start_low and start_high are finite, in this order": all(map(math.isfinite, bounds))
            and bounds[0] <= bounds[1],
            "start_angle is finite": math.isfinite(self.start_angle),
            "time_limit is a whole number from 1": isinstance(self.time_limit, int)
            and self.time_limit >= 1,
            "reward is a function of numbers": callable(self.reward),
        }.items():
            if not holds:
                raise ConfigError(f"{rule}; not so in {self}")

    def has_ended(self, x: float, theta: float) -> bool:
        """Return whether the cart (m) has left the track or the pole (rad) has fallen.

        The comparison is strict: a state exactly on a limit is still in play. Of several poles it
        is the one that leans most.
        """
        return abs(x) > self.x_limit or abs(theta) > self.theta_limit

    @property
    def turns(self) -> bool:
        """Whether a pole may turn right round."""
        return math.isinf(self.theta_limit)

    def seen(self, states: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Return states as rules and observations have them, shape (..., 2 + 2 poles).

        Where poles may turn, their angles count from -pi to pi, in a copy.
        """
        if not self.turns:
            return states
        turned = states.copy()
        turned[..., 2::2] = wrapped(turned[..., 2::2])
        return turned

    @property
    def most_return(self) -> float:
        """What no episode's return exceeds; infinite where the reward is one's own function."""
        return CONSTANT.get(self.reward, math.inf) * self.time_limit

    @property
    def return_span(self) -> tuple[float, float] | tuple[None, None]:
        """What returns lie between: known of a step's 1, else left to what is found."""
        return (0, self.time_limit) if self.reward is one_per_step else (None, None)

    def observation_bound(self, poles: int = 1) -> npt.NDArray[np.float32]:
        """Return the upper bound of the observation, shape (2 + 2 poles,); the lower is minus that.

        Positions may be twice as large as the limits that end an episode, so that the observation
        of the last step still lies inside; velocities are unbounded. Of a pole that may turn right
        round it is pi.
        """
        angle = [math.pi if self.turns else self.theta_limit * 2, np.inf]
        return np.array([self.x_limit * 2, np.inf, *angle * poles], dtype=np.float32)

    def with_changes(
        self, *, max_episode_steps: int | None = None, **changes: Unpack[Changes]
    ) -> "Task":
        """Return the same task with other rules, or with episodes of so many control steps.

        At 1 per step as large a share of them counts as solved; of other rewards nothing is agreed.

        >>> CARTPOLE_V1.with_changes(x_limit=1.2, max_episode_steps=1_000).reward_threshold
        950.0

        Args:
            max_episode_steps: The time limit; None leaves it as it is, as everywhere here.
            changes: By the names of the task's attributes; a reward also by its name in `REWARDS`.

        Raises:
            ConfigError: A rule makes no sense, or no episode starts within the limits.
        """
        if unknown := [name for name in changes if name not in Changes.__annotations__]:
            raise TypeError(f"got an unexpected keyword argument {unknown[0]!r}")
        asked: dict[str, Any] = {**changes, "time_limit": max_episode_steps}
        given: dict[str, Any] = {
            name: checked(name, asked[name]) for name in asked if asked[name] is not None
        }
        if all(getattr(self, name) == value for name, value in given.items()):
            return self
        low, high = (given.get(name, getattr(self, name)) for name in ("start_low", "start_high"))
        if low > high:
            raise ConfigError(
                f"start_low ({low:g}) is above start_high ({high:g}); starts lie between"
            )
        changed = dataclasses.replace(self, **given)
        changed._check_starts()
        return dataclasses.replace(changed, reward_threshold=self._threshold_of(changed))

    def _threshold_of(self, changed: "Task") -> float | None:
        """What counts as solved by changed rules, as far as that is agreed."""
        agreed = self.reward_threshold
        if (changed.reward, changed.time_limit) == (self.reward, self.time_limit):
            return agreed
        if agreed is None or not changed.reward is self.reward is one_per_step:
            return None
        return agreed / self.time_limit * changed.time_limit

    def _check_starts(self) -> None:
        for name, middle in ("x", 0.0), ("theta", self.start_angle):
            low, high = middle + self.start_low, middle + self.start_high
            limit = getattr(self, f"{name}_limit")
            within = min(high, limit) - max(low, -limit)
            if within < _FEWEST_STARTS * (high - low) or within < 0:
                unit, share = "m" if name == "x" else "rad", "all" if within < 0 else "nearly all"
                raise ConfigError(
                    f"episodes start between {name} = {low:g} and {high:g} {unit}, {share} beyond "
                    f"{name}_limit, {limit:g}: change start_low, start_high or start_angle, or "
                    f"make {name}_limit larger (inf: none)"
                )

    @property
    def changes(self) -> dict[str, object]:
        """What `resolve` needs beside the name to make it again."""
        own = TASKS.get(self.name, self)
        pairs = ((name, getattr(self, rule), getattr(own, rule)) for name, rule in RULES.items())
        return {name: named(value) for name, value, its in pairs if value != its}

    @property
    def summary(self) -> str:
        """Its name, length and changes, in words."""
        changes = [
            f"{name} {value}" for name, value in self.changes.items() if name != "max_episode_steps"
        ]
        return f"{self.name} ({', '.join([f'{self.time_limit:,} steps', *changes])})"


CARTPOLE_V1: Final = Task("CartPole-v1", reward_threshold=475.0)
"""Gymnasium's rules, with gymnasium's own expression for 12 degrees."""

TASKS: Final[dict[str, Task]] = {}
"""Every task by its name."""


def register(task: Task) -> Task:
    """Make a task known by its name; the same once more changes nothing.

    Raises:
        ConfigError: Another one has that name.
    """
    if TASKS.setdefault(task.name, task) != task:
        raise ConfigError(f"there is a task {task.name!r} already; give the new one another name")
    return task


SWING_UP: Final = Task("SwingUp-v0", theta_limit=math.inf, start_angle=math.pi, reward=upright)
"""A pole that hangs is to be swung up, and kept there."""

CONTINUOUS: Final = dataclasses.replace(CARTPOLE_V1, name="Continuous-v0", continuous=True)
"""CartPole-v1 with any force between those of its two actions."""

register(CARTPOLE_V1)
register(SWING_UP)
register(CONTINUOUS)


def task_named(name: str) -> Task:
    """Return the task of a name.

    Raises:
        ConfigError: There is none.
    """
    check_known("task", name, TASKS)
    return TASKS[name]


def resolve(
    task: Task | str, *, max_episode_steps: int | None = None, **changes: Unpack[Changes]
) -> Task:
    """Return a task that was given itself or by its name, with some rules changed.

    Raises:
        ConfigError: There is none of that name, or a rule makes no sense; see `Task.with_changes`.
    """
    known = task if isinstance(task, Task) else task_named(task)
    return known.with_changes(max_episode_steps=max_episode_steps, **changes)


def control_of(push: Number, controls: Sequence[float] | npt.NDArray[np.float64]) -> Number:
    """Return the control of a push from -1 to 1, between those of the two actions.

    >>> control_of(0.0, (-1.0, 1.0))
    0.0
    """
    left, right = controls
    return ((1.0 - push) * left + (1.0 + push) * right) / 2.0


N_ACTIONS: Final = 2
"""0 pushes to the left (-x), 1 to the right (+x)."""


def frame_rate(control_step: float = CONTROL_STEP) -> int:
    """Return frames per second of a film with a frame per control step of so many seconds."""
    return max(1, round(1 / control_step))


def state_names(poles: int = 1) -> tuple[str, ...]:
    """Return what the values of a state are: m, m/s, then rad and rad/s of each pole.

    >>> state_names(2)
    ('x', 'x_dot', 'theta1', 'theta1_dot', 'theta2', 'theta2_dot')
    """
    angles = ("theta",) if poles == 1 else tuple(f"theta{pole + 1}" for pole in range(poles))
    names = (name for angle in angles for name in (angle, f"{angle}_dot"))
    return ("x", "x_dot", *names)


def for_each_pole(values: tuple[Any, ...], poles: int) -> tuple[Any, ...]:
    """Return four values, of the cart and one pole, as those of the cart and each pole."""
    return values if len(values) != len(state_names()) else values[:2] + values[2:] * poles


def in_words(poles: int) -> str:
    """Return a number of poles in words, for messages."""
    return "1 pole" if poles == 1 else f"{poles} poles"


def max_abs(values: Sequence[float] | npt.NDArray[np.float64]) -> float:
    """Return the largest size among values; NaN if one of them is NaN or infinite."""
    # Comparing would lose a NaN; adding does not.
    largest, total = 0.0, 0.0
    for value in values:
        largest = max(largest, abs(value))
        total += value
    return largest + 0.0 * total


def wrapped(theta: Number) -> Number:
    """Return an angle as it counts from -pi to pi; Numba compiles this as it is."""
    return theta - _TURN * ((theta + math.pi) // _TURN)


def most_leaning(angles: Sequence[float]) -> float:
    """Return the angle of largest size, with its sign; the first of equal ones."""
    return max(angles, key=abs)


def worst_pole(state: Sequence[float]) -> tuple[float, float, float, float]:
    """Return what the rules look at: the state itself, or of several poles the worst of all.

    That is `(x, x_dot, theta, theta_dot)` with the largest angle and the largest angular velocity,
    without signs.
    """
    if len(state) == 4:
        x, x_dot, theta, theta_dot = state
        return x, x_dot, theta, theta_dot
    return state[0], state[1], max_abs(state[2::2]), max_abs(state[3::2])
