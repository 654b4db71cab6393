"""CartPole-v1 for actions that are any push, as a `gymnasium.Env`."""

from typing import Any

import numpy as np
import numpy.typing as npt

from mjcartpole.envs.actions import push_of
from mjcartpole.envs.cartpole import CartPoleEnv
from mjcartpole.task import CONTINUOUS, Task, control_of


class ContinuousCartPoleEnv(CartPoleEnv):
    """`CartPoleEnv` in which an action is any push between those of its two actions.

    Everything else is as there, bit for bit: at the ends of the action space both move alike.

    >>> import gymnasium, mjcartpole
    >>> env = gymnasium.make("mjcartpole/Continuous-v0")
    >>> env.action_space
    Box(-1.0, 1.0, (1,), float32)
    >>> _ = env.reset(seed=0)
    >>> env.step(np.array([0.5], dtype=np.float32))[1]
    1.0

    Args:
        task: The rules, with continuous actions.
        settings: As in `CartPoleEnv`.
    """

    def __init__(self, *, task: Task | str = CONTINUOUS, **settings: Any) -> None:  # noqa: ANN401
        super().__init__(task=task, **settings)

    def step(  # type: ignore[override]
        self, action: npt.NDArray[np.float32]
    ) -> tuple[npt.NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Advance one control step; see `CartPoleEnv.step`.

        Raises:
            InvalidActionError: The action is not in the action space.
        """
        # Action 0 has the push of this step.
        push = push_of(action)
        controls = self.simulation.cartpole.controls
        self._left = push if self.disturber else control_of(push, controls)
        return super().step(0)
