"""From which starts does a policy last? Greedy episodes from a grid of starting states, at once."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from mjcartpole.errors import ConfigError
from mjcartpole.learning.many_states import actions_in
from mjcartpole.learning.slices import Axes, choose_axes, names_of, states_over
from mjcartpole.media.grid_plot import Field, Grid
from mjcartpole.physics.batch_simulation import BatchSimulation
from mjcartpole.physics.cartpole_v1 import FORCE, cartpole_v1_step
from mjcartpole.studies.policy_setup import PolicySetup
from mjcartpole.task import Task

POINTS: Final = 61
"""Starts along each dimension."""
MOST_POINTS: Final = 1_000

Floats = npt.NDArray[np.float64]
Step = Callable[[Floats, npt.NDArray[np.int64]], Floats]


def basin(
    setup: PolicySetup,
    *,
    dims: Sequence[str] = (),
    at: Mapping[str, float] | None = None,
    points: int = POINTS,
) -> Grid:
    """Return how long episodes last from starts over two dimensions, the others held.

    Args:
        setup: The policy and where it is played.
        dims: See `choose_axes`.
        at: See `choose_axes`.
        points: Starts along each dimension.

    Raises:
        ConfigError: There is no such dimension, or the points make no sense.
        SimulationError: The physics diverged.
    """
    if not 2 <= points <= MOST_POINTS:
        raise ConfigError(f"points must be a whole number from 2 to {MOST_POINTS:,}, not {points}")
    policy, task = setup.table, setup.task
    policy.check_fits(setup.cartpole.poles, setup.cartpole.name)
    axes = choose_axes(policy.discretizer, dims, "none", at)
    a, b = (np.linspace(*_range(axes, place, setup), points + 1) for place in axes.dims)
    starts = states_over((a, b), axes.dims, axes.held)
    steps = survival(setup, starts).astype(np.float64).reshape(points, points)
    names = names_of(policy.discretizer)
    shown = names[axes.dims[0]], names[axes.dims[1]]
    held = [f"{name} = {axes.held[i]:.3g}" for i, name in enumerate(names) if i not in axes.dims]
    return Grid(
        setup.name,
        shown,
        [[Field("steps", "", (a, b), steps)]],
        most=task.time_limit,
        notes=[f"starts at {', '.join(held)}; {(steps >= task.time_limit).mean():.0%} last"],
    )


def _range(axes: Axes, dimension: int, setup: PolicySetup) -> tuple[float, float]:
    """Return from where to where starts lie: up to the limit, or as far as the table reaches."""
    limit = limit_along(dimension, setup.task)
    grid = setup.table.discretizer
    return (-limit, limit) if limit else (grid.low[dimension], grid.high[dimension])


def limit_along(dimension: int, task: Task) -> float | None:
    """Return how far a state may go along a dimension; None where nothing ends an episode."""
    limit = task.x_limit if dimension == 0 else task.theta_limit
    return limit if dimension % 2 == 0 and np.isfinite(limit) else None


def survival(setup: PolicySetup, starts: Floats) -> npt.NDArray[np.int64]:
    """Return after how many steps greedy episodes end, shape (n,); at most the time limit.

    Args:
        setup: The policy and where it is played.
        starts: Starting states, shape (n, 2 + 2 poles).

    Raises:
        SimulationError: The physics diverged.
    """
    grid, table, task = setup.table.discretizer, setup.table.q_table, setup.task
    step = _mover(setup, starts)
    states, lasting = starts, np.ones(len(starts), np.bool_)
    steps = np.zeros(len(starts), np.int64)
    for _ in range(task.time_limit):
        states = step(states, actions_in(grid, table, states))
        steps += lasting
        lasting &= ~_is_over(states, task)
        if not lasting.any():
            break
    return steps


def _is_over(states: Floats, task: Task) -> npt.NDArray[np.bool_]:
    over: npt.NDArray[np.bool_] = np.abs(states[:, 0]) > task.x_limit
    return over | (np.abs(states[:, 2::2]) > task.theta_limit).any(axis=1)


def _mover(setup: PolicySetup, starts: Floats) -> Step:
    """Return what moves all states one step on; who has ended is put at rest, and moves on."""
    task = setup.task

    def at_rest(states: Floats) -> Floats:
        return np.where(_is_over(states, task)[:, None], 0.0, states)

    if setup.backend == "gym":
        moved: Any = cartpole_v1_step  # of floats, and as well of arrays

        def step(states: Floats, actions: npt.NDArray[np.int64]) -> Floats:
            return np.array(moved(*at_rest(states).T, np.where(actions == 1, FORCE, -FORCE))).T

        return step
    batch = BatchSimulation(setup.cartpole, len(starts), setup.integrator)
    batch.set_state(slice(None), starts)
    controls = np.array(setup.cartpole.controls)

    def batch_step(states: Floats, actions: npt.NDArray[np.int64]) -> Floats:
        if (ended := np.flatnonzero(_is_over(states, task))).size:
            batch.set_state(ended, np.zeros((ended.size, states.shape[1])))
        batch.step(controls[actions])
        batch.sizes()
        return batch.state.copy()

    return batch_step
