"""dm_control's physics of a cart-pole, and what draws its starting states."""

import copy
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.dm_control import control, mujoco, specs, wrapper
from mjcartpole.physics.variants import write_numbers

__all__ = ["HIGHLIGHT", "Physics", "StartingStates", "control", "specs"]

HIGHLIGHT: Final = (0.0, 0.5, 0.3)
"""What poles look like at reward 1, where rewards are to be seen: the suite's own colour."""


class StartingStates(np.random.RandomState):
    """Draws starting states: what dm_control calls a task's `random`.

    It has the methods of a `RandomState`, and the draws of gymnasium's generators: one seed gives
    the same starting states in both worlds.

    Attributes:
        seeded: Another one with this seed, for what is drawn apart from them; never drawn from.
    """

    def __init__(self, seed: int | np.random.PCG64 | None = None) -> None:
        """Seed it; None draws a seed, and a bit generator is taken as it stands."""
        bits = seed if isinstance(seed, np.random.PCG64) else np.random.PCG64(seed)
        super().__init__(bits)
        self.seeded = np.random.Generator(bits)

    def seed(self, seed: int | None = None) -> None:  # type: ignore[override]
        """Start anew from a seed; None draws one."""
        bits = np.random.PCG64(seed)
        self._bit_generator.state = bits.state
        self.seeded = np.random.Generator(bits)

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

    def become(self, cartpole: CartPole) -> None:
        """Move another cart-pole from here on, whose model differs by its numbers only."""
        write_numbers(cartpole.model, self.model.ptr)
        self.cartpole = cartpole

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
