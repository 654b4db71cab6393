"""Actions: their spaces, and what the motor makes of them."""

from collections.abc import Callable
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from mjcartpole.errors import InvalidActionError
from mjcartpole.task import N_ACTIONS, Task, control_of

STEP_AFTER_END: Final = (
    "You are calling 'step()' even though this environment has already returned "
    "terminated = True. You should always call 'reset()' once you receive "
    "'terminated = True' -- any further steps are undefined behavior."
)
"""Gymnasium's own words."""


def action_space(task: Task) -> spaces.Space[Any]:
    """Return the space of a task's actions: two, or any push from -1 to 1."""
    return (
        spaces.Box(-1.0, 1.0, (1,), np.float32) if task.continuous else spaces.Discrete(N_ACTIONS)
    )


def invalid(action: object, known: str = "the actions are 0 and 1") -> InvalidActionError:
    """Return the error for what is no action."""
    return InvalidActionError(f"{action!r} ({type(action)}) invalid; {known}")


def push_of(action: npt.ArrayLike) -> float:
    """Return the push that an action of one environment is, shape (1,).

    Raises:
        InvalidActionError: It is none.
    """
    pushes = _pushes(action, 1)
    if pushes is None or pushes.shape != (1,):
        raise invalid(action, "an action is a push from -1 to 1, shape (1,)")
    return float(pushes[0])


def _pushes(actions: npt.ArrayLike, n: int) -> npt.NDArray[np.float64] | None:
    """Return n numbers from -1 to 1, as they are; None if they are something else."""
    pushes = np.asarray(actions)
    is_one = pushes.dtype.kind in "fiu" and pushes.size == n and (np.abs(pushes) <= 1.0).all()
    return pushes.astype(np.float64) if is_one else None


Controls = npt.NDArray[np.float64]


def controls_of_all(
    task: Task, space: spaces.Space[Any], controls: tuple[float, float]
) -> Callable[[npt.ArrayLike], Controls]:
    """Return what makes controls, shape (n,), of the actions of n environments.

    It raises InvalidActionError for what is not in the space.

    Args:
        task: Says which kind of actions.
        space: All that they can be: shape (n,), or (n, 1) for pushes.
        controls: Those of the two actions.
    """
    n, ends = (space.shape or (0,))[0], np.array(controls)

    def of_pushes(actions: npt.ArrayLike) -> Controls:
        pushes = _pushes(actions, n)
        if pushes is None or pushes.shape != (n, 1):
            raise invalid(actions, f"actions are {n} pushes from -1 to 1, shape ({n}, 1)")
        return control_of(pushes[:, 0], controls)

    def of_choices(actions: npt.ArrayLike) -> Controls:
        is_plain = (
            isinstance(actions, np.ndarray)
            and actions.dtype.kind == "i"
            and actions.shape == (n,)
            # Together they have no bit but the lowest: each is 0 or 1.
            and np.bitwise_or.reduce(actions) in (0, 1)
        )
        if not is_plain and not space.contains(actions):
            raise invalid(actions, f"actions are {n} integers, each 0 or 1")
        return ends.take(np.asarray(actions))

    return of_pushes if task.continuous else of_choices
