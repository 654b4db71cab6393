"""Tasks: the rules of the game, as numbers and pure functions.

Only the rules: no physics engine, no gymnasium. A `Task` holds all of them; `CARTPOLE_V1` has the
numbers of gymnasium's `CartPole-v1` (Barto, Sutton and Anderson, 1983,
doi:10.1109/TSMC.1983.6313077).
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, SupportsFloat, TypeAlias

import numpy as np
import numpy.typing as npt

from mjcartpole.errors import ConfigError, check_known

CONTROL_STEP: Final = 0.02
"""Seconds between two actions."""

Reward: TypeAlias = Callable[[float, float, float, float, bool], float]
"""From the state after a step (x, x_dot, theta, theta_dot; m, m/s, rad, rad/s) and whether it ends
the episode by the rules. Of several poles, theta and theta_dot are those of largest size. A plain
function of numbers: the compiled engine compiles it as it is."""


def one_per_step(x: float, x_dot: float, theta: float, theta_dot: float, terminated: bool) -> float:
    """Return 1: CartPole-v1's reward, also of the step that ends the episode."""
    return 1.0


@dataclass(frozen=True)
class Task:
    """The rules of one game.

    >>> TASKS["CartPole-v1"].has_ended(2.5, 0.0)
    True

    Attributes:
        name: What it is called; `mjcartpole/<name>` is its id in gymnasium.
        x_limit: The cart's centre may be this far from the middle of the track, in metres;
            `math.inf` for a track that ends no episode.
        theta_limit: The pole may lean this far, in radians; `math.inf` for any angle.
        start_low: Lower bound of each of the starting state's values, drawn uniformly.
        start_high: Upper bound.
        reward: Reward of one control step.
        time_limit: Control steps until an episode is truncated.
        reward_threshold: Mean return at which it counts as solved; None where nothing is agreed.
    """

    name: str
    x_limit: float = 2.4
    theta_limit: float = 12 * 2 * math.pi / 360
    start_low: float = -0.05
    start_high: float = 0.05
    reward: Reward = one_per_step
    time_limit: int = 500
    reward_threshold: float | None = None

    def has_ended(self, x: float, theta: float) -> bool:
        """Return whether the cart (m) has left the track or the pole (rad) has fallen.

        The comparison is strict: a state exactly on a limit is still in play. Of several poles it
        is the one that leans most.
        """
        return abs(x) > self.x_limit or abs(theta) > self.theta_limit


CARTPOLE_V1: Final = Task("CartPole-v1", reward_threshold=475.0)
"""Gymnasium's rules, with gymnasium's own expression for 12 degrees."""

TASKS: Final[dict[str, Task]] = {}
"""Every task by its name."""


def register(task: Task) -> Task:
    """Make a task known by its name, for `TrainConfig`, the command line and gymnasium."""
    TASKS[task.name] = task
    return task


register(CARTPOLE_V1)


def task_named(name: str) -> Task:
    """Return the task of a name.

    Raises:
        ConfigError: There is none.
    """
    check_known("task", name, TASKS)
    return TASKS[name]


X_LIMIT: Final = 2.4
"""The cart's centre may be this far from the middle of the track, in metres."""

THETA_LIMIT: Final = 12 * 2 * math.pi / 360
"""The pole may lean this far, in radians: 12 degrees, by gymnasium's own expression."""

RESET_LOW: Final = -0.05
RESET_HIGH: Final = 0.05
"""Each of the state's values starts uniformly between these two."""

TIME_LIMIT: Final = 500
"""Control steps until an episode is truncated (the registration's business, not the env's)."""

REWARD_THRESHOLD: Final = 475.0
"""Mean return at which CartPole-v1 counts as solved."""

N_ACTIONS: Final = 2
"""0 pushes to the left (-x), 1 to the right (+x)."""


def start_bounds(options: Mapping[str, Any] | None, *others: str) -> tuple[float, float]:
    """Bounds of the starting state's values, as `reset(options=...)` gives them.

    >>> start_bounds({"low": -0.01})
    (-0.01, 0.05)

    Args:
        options: What `reset` was given.
        others: Options beside "low" and "high" that are read elsewhere.

    Raises:
        ConfigError: An option is unknown, a bound is no finite number, or low is above high.
    """
    known = ("low", "high", *others)
    if not isinstance(options, Mapping | None):
        raise ConfigError(f"options of reset are a dict, not {options!r}")
    for name in options or {}:
        if name not in known:
            raise ConfigError(
                f"reset has no option {name!r}; available: {', '.join(known)}. What belongs to the "
                "model or the rules is given where the environment is made"
            )
    given = {"low": RESET_LOW, "high": RESET_HIGH, **(options or {})}
    low, high = (_finite(name, given[name]) for name in ("low", "high"))
    if low > high:
        raise ConfigError(f"low ({low}) is above high ({high}); the starting state lies between")
    _finite("the distance from low to high", high - low)
    return low, high


def _finite(name: str, value: SupportsFloat | str) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise ConfigError(f"{name} is a finite number, not {value!r}")
    return number


def frame_rate(control_step: float = CONTROL_STEP) -> int:
    """Frames per second of a film with one frame per control step of so many seconds."""
    return max(1, round(1 / control_step))


def state_names(poles: int = 1) -> tuple[str, ...]:
    """What the values of a state are: m, m/s, then rad and rad/s of each pole.

    >>> state_names(2)
    ('x', 'x_dot', 'theta1', 'theta1_dot', 'theta2', 'theta2_dot')
    """
    angles = ("theta",) if poles == 1 else tuple(f"theta{pole + 1}" for pole in range(poles))
    names = (name for angle in angles for name in (angle, f"{angle}_dot"))
    return ("x", "x_dot", *names)


def in_words(poles: int) -> str:
    """A number of poles, for messages."""
    return "1 pole" if poles == 1 else f"{poles} poles"


def observation_bound(
    poles: int = 1, x_limit: float = X_LIMIT, theta_limit: float = THETA_LIMIT
) -> npt.NDArray[np.float32]:
    """Upper bound of the observation, shape (2 + 2 poles,); the lower bound is its negative.

    Positions may be twice as large as the limits that end an episode, so that the observation of
    the last step still lies inside; velocities are unbounded.
    """
    angle = [theta_limit * 2, np.inf]
    return np.array([x_limit * 2, np.inf, *angle * poles], dtype=np.float32)


def has_terminated(x: float, theta: float) -> bool:
    """Whether the cart (m) has left the track or the pole (rad) has fallen.

    The comparison is strict: a state exactly on a limit is still in play. Of several poles it is
    the one that leans most.
    """
    return x < -X_LIMIT or x > X_LIMIT or theta < -THETA_LIMIT or theta > THETA_LIMIT


def max_abs(values: Sequence[float] | npt.NDArray[np.float64]) -> float:
    """The largest size among values; NaN if one of them is NaN or infinite."""
    # Comparing would lose a NaN; adding does not.
    largest, total = 0.0, 0.0
    for value in values:
        largest = max(largest, abs(value))
        total += value
    return largest + 0.0 * total


def reward(terminated: bool, already_over: bool, sutton_barto: bool) -> float:
    """Reward of one control step.

    Args:
        terminated: Whether the state after the step ends the episode.
        already_over: Whether the episode had ended before this step.
        sutton_barto: Use 0 per step and -1 at the end (Sutton and Barto's formulation) instead
            of 1 per step, the last one included.
    """
    if sutton_barto:
        return -1.0 if terminated else 0.0
    return 0.0 if terminated and already_over else 1.0
