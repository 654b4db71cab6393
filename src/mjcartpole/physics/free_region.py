"""Free regions: positions in which a cart-pole reaches no stop and collides with nothing.

Within one its equations hold whatever stands outside. Where it covers the limits that end an
episode, no episode ever meets what stands outside.
"""

import math
from dataclasses import dataclass, replace
from typing import Final, TypeAlias

import mujoco
import numpy as np
import numpy.typing as npt

from mjcartpole.physics.cartpole import CartPole, Vector
from mjcartpole.physics.equations import Parameters, derivative
from mjcartpole.physics.parameters import is_on, joint_label, label
from mjcartpole.physics.simulation import nothing_can_touch
from mjcartpole.task import CARTPOLE_V1, Task

Interval: TypeAlias = tuple[float, float]

ANYWHERE: Final[Interval] = (-math.inf, math.inf)

_GRID: Final = ((97, 0.05), (33, 0.0131))
"""Where contacts are looked for, along the rail and by angle: how many places at the least, and how
far apart they may be, m and rad."""

_LEAST_ROOM: Final = 1e-3
"""Of the task's own room, relative; with less there is nothing to test."""


def wide_box(task: Task = CARTPOLE_V1) -> tuple[float, float, float, float]:
    """Return within ± what states are sampled, far beyond an episode: m, m/s, rad, rad/s."""
    x_limit = task.x_limit if math.isfinite(task.x_limit) else CARTPOLE_V1.x_limit
    return 2 * x_limit, 10.0, math.pi, 10.0


@dataclass(frozen=True)
class FreeRegion:
    """Where a cart-pole of one pole moves freely.

    Attributes:
        x: Of the cart, m.
        theta: Of the pole, rad.
        bounds: What stands outside, one phrase each.
        blocked: What is met even inside the task's limits and leaves no free region.
        task: Whose limits these are.
    """

    x: Interval = ANYWHERE
    theta: Interval = ANYWHERE
    bounds: tuple[str, ...] = ()
    blocked: tuple[str, ...] = ()
    task: Task = CARTPOLE_V1

    @property
    def covers_task(self) -> bool:
        """Whether no episode can leave it before it ends."""
        pairs = zip((self.x, self.theta), _limits(self.task), strict=True)
        return not self.blocked and all(a[0] <= b[0] and a[1] >= b[1] for a, b in pairs)

    def within(self, x: Interval, theta: Interval) -> "FreeRegion":
        """Return the part of it that lies inside other bounds."""
        return replace(self, x=_common(self.x, x), theta=_common(self.theta, theta))

    def box(self, bound: npt.ArrayLike) -> tuple[Vector, Vector]:
        """Return the lowest and highest states within ± a bound, shape (4,), that lie in it."""
        high = np.array(bound, dtype=np.float64)
        low = -high
        inside = self.within((low[0], high[0]), (low[2], high[2]))
        (low[0], high[0]), (low[2], high[2]) = inside.x, inside.theta
        return low, high

    def holds(self, states: Vector) -> npt.NDArray[np.bool_]:
        """Return whether each of many states, shape (..., 4), lies in it."""
        low, high = np.transpose([self.x, self.theta])
        places = states[..., [0, 2]]
        inside: npt.NDArray[np.bool_] = ((low <= places) & (places <= high)).all(axis=-1)
        return inside

    def holds_for_a_step(self, states: Vector, p: Parameters) -> npt.NDArray[np.bool_]:
        """Return whether each state lies in it and stays there for a step, wherever it goes."""
        reach = p.timestep * np.abs(states[:, [1, 3]])
        for force in p.forces:
            speed_up = p.timestep * np.abs(derivative(p, states, force)[:, [1, 3]])
            reach = np.maximum(reach, 2 * p.timestep * (np.abs(states[:, [1, 3]]) + speed_up))
        there, back = states.copy(), states.copy()
        there[:, [0, 2]] += reach
        back[:, [0, 2]] -= reach
        return self.holds(there) & self.holds(back)


def free_region(cartpole: CartPole, *, task: Task = CARTPOLE_V1) -> FreeRegion:
    """Return where a cart-pole of one pole moves freely, by its joints' limits and its geoms.

    Contacts matter within the task's limits, or `wide_box` where it has none.
    """
    region = _by_limits(cartpole, task)
    if region.blocked or _no_contacts(cartpole.model):
        return region
    (x, _, theta, _), searched = wide_box(task), region.within(*_limits(task))
    searched = replace(searched, x=_ended(searched.x, x), theta=_ended(searched.theta, theta))
    if touching := _touching(cartpole, searched):
        return replace(region, blocked=tuple(touching))
    if searched.theta[1] - searched.theta[0] >= 2 * math.pi:
        # A full turn has been searched, and the next one meets nothing new.
        searched = replace(searched, theta=region.theta)
    has_ends = math.isfinite(task.x_limit)
    within = "the task's limits" if has_ends else f"{x:g} m of the track's middle"
    apart = f"geoms that may collide, and do not within {within}"
    return replace(searched, bounds=(*region.bounds, apart))


def _limits(task: Task) -> tuple[Interval, Interval]:
    return (-task.x_limit, task.x_limit), (-task.theta_limit, task.theta_limit)


def _common(a: Interval, b: Interval) -> Interval:
    return max(a[0], b[0]), min(a[1], b[1])


def _ended(interval: Interval, end: float) -> Interval:
    """Return an interval with ± an end where it has none."""
    low, high = interval
    return (low if math.isfinite(low) else -end, high if math.isfinite(high) else end)


def _by_limits(cartpole: CartPole, task: Task) -> FreeRegion:
    model, bit = cartpole.model, mujoco.mjtDisableBit
    bounds, blocked, intervals = [], [], []
    acting = is_on(model, bit.mjDSBL_CONSTRAINT, bit.mjDSBL_LIMIT)
    wide = wide_box(task)[::2]
    for joint, own, end in zip(cartpole.joints[:2], _limits(task), wide, strict=True):
        interval = ANYWHERE
        ends = model.jnt_range[joint]
        if acting and model.jnt_limited[joint] and np.isfinite(ends).any():
            margin = max(float(model.jnt_margin[joint]), 0.0)
            interval = float(ends[0]) + margin, float(ends[1]) - margin
            bounds.append(f"limit of {joint_label(model, joint)} at {ends[0]:g} and {ends[1]:g}")
        room = _common(interval, own)
        if not (room[0] <= 0 <= room[1] and room[1] - room[0] >= _LEAST_ROOM * min(own[1], end)):
            blocked.append(bounds[-1])
        intervals.append(interval)
    return FreeRegion(intervals[0], intervals[1], tuple(bounds), tuple(blocked), task)


def _no_contacts(model: mujoco.MjModel) -> bool:
    bit = mujoco.mjtDisableBit
    return nothing_can_touch(model) or not is_on(model, bit.mjDSBL_CONSTRAINT, bit.mjDSBL_CONTACT)


def _touching(cartpole: CartPole, region: FreeRegion) -> list[str]:
    """Return every pair of geoms that MuJoCo finds in contact on a grid over a finite region."""
    model, data = cartpole.model, mujoco.MjData(cartpole.model)
    places, angles = (
        np.linspace(low, high, max(least, round((high - low) / apart) + 1))
        for (low, high), (least, apart) in zip((region.x, region.theta), _GRID, strict=True)
    )
    pairs: set[tuple[int, int]] = set()
    for x in places:
        for theta in angles:
            data.qpos[cartpole.slider], data.qpos[cartpole.hinges[0]] = x, theta
            mujoco.mj_fwdPosition(model, data)
            acting = data.contact.efc_address >= 0
            for one, other in data.contact.geom[acting].tolist():
                pairs.add((one, other))
    return [f"contact between {_names(model, sorted(pair))}" for pair in sorted(pairs)]


def _names(model: mujoco.MjModel, geoms: list[int]) -> str:
    if min(geoms) < 0:
        return "a deformable body and others"
    names = [label(model, mujoco.mjtObj.mjOBJ_GEOM, geom, "") for geom in geoms]
    return f"geoms {' and '.join(names)}"
