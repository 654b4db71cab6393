"""Actions: their spaces, and what the motor makes of them."""

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
    pushes = _pushes(action)
    if pushes is None or pushes.shape != (1,):
        raise invalid(action, "an action is a push from -1 to 1, shape (1,)")
    return float(pushes[0])


def _pushes(actions: npt.ArrayLike) -> npt.NDArray[np.float64] | None:
    """Return numbers from -1 to 1, as they are; None if they are something else."""
    pushes = np.asarray(actions)
    are_such = pushes.dtype.kind in "fiu" and (np.abs(pushes) <= 1.0).all()
    return pushes.astype(np.float64) if are_such else None


Controls = npt.NDArray[np.float64]


def controls_of_pushes(
    actions: npt.ArrayLike, space: spaces.Space[Any], controls: Controls
) -> Controls:
    """Return the controls of many pushes, shape (n,), between those of action 0 and 1.

    Actions have the shape (n, 1), as their space has.

    Raises:
        InvalidActionError: They are not in the space.
    """
    n, pushes = (space.shape or (0,))[0], _pushes(actions)
    if pushes is None or pushes.shape != space.shape:
        raise invalid(actions, f"actions are {n} pushes from -1 to 1, shape ({n}, 1)")
    return control_of(pushes[:, 0], controls)


def controls_of_choices(
    actions: npt.ArrayLike, space: spaces.Space[Any], controls: Controls
) -> Controls:
    """Do the same for actions that are 0 or 1, shape (n,)."""
    is_plain = (
        isinstance(actions, np.ndarray)
        and actions.dtype.kind == "i"
        and actions.shape == space.shape
        # Together they have no bit but the lowest: each is 0 or 1.
        and np.bitwise_or.reduce(actions) in (0, 1)
    )
    if not is_plain and not (_are_whole(actions) and space.contains(actions)):
        n = (space.shape or (0,))[0]
        raise invalid(actions, f"actions are {n} integers, each 0 or 1")
    return controls.take(np.asarray(actions))


def _are_whole(actions: npt.ArrayLike) -> bool:
    """Return whether all are whole numbers; gymnasium before 1.4 takes fractions for such."""
    return np.can_cast(np.asarray(actions).dtype, np.int64)
