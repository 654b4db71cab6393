"""Positions in which a cart-pole moves freely: no stop is reached and nothing collides.

Within them its equations hold whatever stands outside. Where they cover the limits that end an
episode, no episode ever meets what stands outside.
"""

import math
from dataclasses import dataclass
from typing import Final, TypeAlias

import mujoco
import numpy as np
import numpy.typing as npt

from mjcartpole import task
from mjcartpole.physics.equations import Parameters, derivative
from mjcartpole.physics.load import CartPole
from mjcartpole.physics.parameters import is_on, joint_label, label
from mjcartpole.physics.simulation import nothing_can_touch

Vector: TypeAlias = npt.NDArray[np.float64]

Interval: TypeAlias = tuple[float, float]

TASK: Final[tuple[Interval, Interval]] = (
    (-task.X_LIMIT, task.X_LIMIT),
    (-task.THETA_LIMIT, task.THETA_LIMIT),
)
"""Where the rules let the cart (m) and the pole (rad) be."""

WIDE_BOX: Final = (2 * task.X_LIMIT, 10.0, math.pi, 10.0)
"""States are sampled within ± this, far beyond an episode: m, m/s, rad, rad/s."""

_GRID: Final = (97, 33)
"""Places along the rail and angles at which contacts are looked for."""

_LEAST_ROOM: Final = 1e-3
"""Of the task's own room, relative; with less there is nothing to test."""


@dataclass(frozen=True)
class FreeRegion:
    """Where a cart-pole of one pole moves freely.

    Attributes:
        x: Of the cart, m.
        theta: Of the pole, rad.
        bounds: What stands outside, one phrase each.
        blocked: What is met even inside the task's limits and leaves no free region.
    """

    x: Interval = (-math.inf, math.inf)
    theta: Interval = (-math.inf, math.inf)
    bounds: tuple[str, ...] = ()
    blocked: tuple[str, ...] = ()

    @property
    def covers_task(self) -> bool:
        """Whether no episode can leave it before it ends."""
        pairs = zip((self.x, self.theta), TASK, strict=True)
        return not self.blocked and all(a[0] <= b[0] and a[1] >= b[1] for a, b in pairs)

    def within(self, x: Interval, theta: Interval) -> "FreeRegion":
        """The part of it that lies inside other bounds."""
        return FreeRegion(_common(self.x, x), _common(self.theta, theta), self.bounds, self.blocked)

    def box(self, bound: npt.ArrayLike) -> tuple[Vector, Vector]:
        """The lowest and highest states within ± a bound, shape (4,), that lie in it."""
        high = np.array(bound, dtype=np.float64)
        low = -high
        inside = self.within((low[0], high[0]), (low[2], high[2]))
        (low[0], high[0]), (low[2], high[2]) = inside.x, inside.theta
        return low, high

    def holds(self, states: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
        """Whether each of many states, shape (..., 4), lies in it."""
        x, theta = states[..., 0], states[..., 2]
        inside: npt.NDArray[np.bool_] = (
            (x >= self.x[0])
            & (x <= self.x[1])
            & (theta >= self.theta[0])
            & (theta <= self.theta[1])
        )
        return inside

    def holds_for_a_step(self, states: Vector, p: Parameters) -> npt.NDArray[np.bool_]:
        """Whether each of many states lies in it and stays there for a step, wherever it goes."""
        reach = p.timestep * np.abs(states[:, [1, 3]])
        for force in p.forces:
            speed_up = p.timestep * np.abs(derivative(p, states, force)[:, [1, 3]])
            reach = np.maximum(reach, 2 * p.timestep * (np.abs(states[:, [1, 3]]) + speed_up))
        there, back = states.copy(), states.copy()
        there[:, [0, 2]] += reach
        back[:, [0, 2]] -= reach
        return self.holds(there) & self.holds(back)


def free_region(cartpole: CartPole) -> FreeRegion:
    """Where a cart-pole of one pole moves freely, by its joints' limits and its geoms."""
    region = _by_limits(cartpole)
    if region.blocked or _no_contacts(cartpole.model):
        return region
    inside = region.within(*TASK)
    if touching := _touching(cartpole, inside):
        return FreeRegion(region.x, region.theta, region.bounds, tuple(touching))
    apart = "geoms that may collide, and do not within the task's limits"
    return FreeRegion(inside.x, inside.theta, (*region.bounds, apart))


def _by_limits(cartpole: CartPole) -> FreeRegion:
    model, bit = cartpole.model, mujoco.mjtDisableBit
    bounds, blocked, intervals = [], [], []
    acting = is_on(model, bit.mjDSBL_CONSTRAINT) and is_on(model, bit.mjDSBL_LIMIT)
    for joint, own in zip((cartpole.slider, cartpole.hinges[0]), TASK, strict=True):
        interval = (-math.inf, math.inf)
        ends = model.jnt_range[joint]
        if acting and model.jnt_limited[joint] and np.isfinite(ends).any():
            margin = max(float(model.jnt_margin[joint]), 0.0)
            interval = float(ends[0]) + margin, float(ends[1]) - margin
            bounds.append(f"limit of {joint_label(model, joint)} at {ends[0]:g} and {ends[1]:g}")
        room = _common(interval, own)
        if not (room[0] <= 0 <= room[1] and room[1] - room[0] >= _LEAST_ROOM * own[1]):
            blocked.append(bounds[-1])
        intervals.append(interval)
    return FreeRegion(intervals[0], intervals[1], tuple(bounds), tuple(blocked))


def _common(a: Interval, b: Interval) -> Interval:
    return max(a[0], b[0]), min(a[1], b[1])


def _no_contacts(model: mujoco.MjModel) -> bool:
    bit = mujoco.mjtDisableBit
    acting = is_on(model, bit.mjDSBL_CONSTRAINT) and is_on(model, bit.mjDSBL_CONTACT)
    return not acting or nothing_can_touch(model)


def _touching(cartpole: CartPole, region: FreeRegion) -> list[str]:
    """Every pair of geoms that MuJoCo finds in contact somewhere on a grid over a region."""
    model, data = cartpole.model, mujoco.MjData(cartpole.model)
    pairs: dict[tuple[int, int], None] = {}
    for x in np.linspace(*region.x, _GRID[0]):
        for theta in np.linspace(*region.theta, _GRID[1]):
            data.qpos[cartpole.slider], data.qpos[cartpole.hinges[0]] = x, theta
            mujoco.mj_fwdPosition(model, data)
            acting = data.contact.efc_address >= 0
            for one, other in data.contact.geom[acting].tolist():
                pairs.setdefault((one, other))
    return [f"contact between {_names(model, sorted(pair))}" for pair in sorted(pairs)]


def _names(model: mujoco.MjModel, geoms: list[int]) -> str:
    if min(geoms) < 0:
        return "a deformable body and others"
    names = [label(model, mujoco.mjtObj.mjOBJ_GEOM, geom, "") for geom in geoms]
    return f"geoms {' and '.join(names)}"
