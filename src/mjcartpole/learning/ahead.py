"""A step that is worked out ahead of its action, as compiled code.

Of gymnasium's equations both next states are computed while the action is still looked up, and the
sine of the next angle, which no force changes, sooner still: a processor does all that at once. The
numbers are those of `stepping.advance`, which everything else waits for.
"""

from typing import Any

from mjcartpole.learning.kinds import Rules, State
from mjcartpole.learning.linking import AnyPhysics, for_each, inlined
from mjcartpole.learning.sines import sine_and_cosine
from mjcartpole.learning.stepping import advance
from mjcartpole.physics.cartpole_v1 import cartpole_v1_moved


@inlined
def _both_next(physics: AnyPhysics, state: State, sines: tuple[float, float]) -> Any:
    sin, cos = sines
    x, x_dot, theta, theta_dot = state
    left = cartpole_v1_moved(x, x_dot, theta, theta_dot, physics.left, sin, cos)
    right = cartpole_v1_moved(x, x_dot, theta, theta_dot, physics.right, sin, cos)
    return left, right, sine_and_cosine(left[2])


def _foresee_gym(physics: AnyPhysics, state: State) -> Any:
    return _both_next(physics, state, sine_and_cosine(state[2]))


def _foresee_nothing(physics: AnyPhysics, state: State) -> Any:
    return None


@for_each(_foresee_nothing, _foresee_nothing, GymPhysics=_foresee_gym)
def foresee(physics: AnyPhysics, state: State) -> Any:
    """Return what is known of the next step whatever the action, for `go_on`."""
    raise NotImplementedError  # Numba takes one of those above; so below.


def _go_on_gym(
    physics: AnyPhysics, rules: Rules, state: State, action: int, ahead: Any
) -> tuple[State, Any]:
    state = ahead[1] if action == 1 else ahead[0]
    return state, _both_next(physics, state, ahead[2])


def _go_on(
    physics: AnyPhysics, rules: Rules, state: State, action: int, ahead: Any
) -> tuple[State, Any]:
    return advance(physics, rules, state, action), None


@for_each(_go_on, _go_on, GymPhysics=_go_on_gym)
def go_on(
    physics: AnyPhysics, rules: Rules, state: State, action: int, ahead: Any
) -> tuple[State, Any]:
    """Return the state one control step later, and what is known of the step after it."""
    raise NotImplementedError
