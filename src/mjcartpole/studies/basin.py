"""From which starts does a policy last? Greedy episodes from a grid of starting states, at once."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
import numpy.typing as npt

from mjcartpole.errors import ConfigError
from mjcartpole.learning.config import POOL
from mjcartpole.learning.engine import Engine
from mjcartpole.learning.evaluation import play_all
from mjcartpole.learning.slices import Axes, check_of_state, choose_axes, names_of, states_over
from mjcartpole.media.grid_plot import Field, Grid
from mjcartpole.studies.policy_setup import PolicySetup
from mjcartpole.task import Task

POINTS: Final = 61
"""Starts along each dimension."""
MOST_POINTS: Final = 1_000
"""A million episodes."""

Floats = npt.NDArray[np.float64]


def basin(
    setup: PolicySetup,
    *,
    dims: Sequence[str] = (),
    at: Mapping[str, float] | None = None,
    points: int = POINTS,
) -> Grid:
    """Return how long episodes last from so many starts along each of two dimensions.

    For `dims`, and for the others, which are held, see `choose_axes`.

    Raises:
        ConfigError: There is no such dimension, or the points make no sense.
        SimulationError: The physics diverged.
    """
    if not 2 <= points <= MOST_POINTS:
        raise ConfigError(f"points must be a whole number from 2 to {MOST_POINTS:,}, not {points}")
    policy, task, setup = setup.table, setup.task, _with_pool(setup)
    policy.check_fits(setup.cartpole.poles, setup.cartpole.name)
    check_of_state(policy.discretizer, (*dims, *(at or {})))
    axes = choose_axes(policy.discretizer, dims, "none", at)
    a, b = (np.linspace(*_range(axes, place, setup), points + 1) for place in axes.dims)
    names = names_of(policy.discretizer)[: 2 + 2 * policy.poles]
    starts = states_over((a, b), axes.dims, axes.held[: len(names)])
    steps = survival(setup, starts).astype(np.float64).reshape(points, points)
    shown = names[axes.dims[0]], names[axes.dims[1]]
    held = [f"{name} = {axes.held[i]:.3g}" for i, name in enumerate(names) if i not in axes.dims]
    return Grid(
        setup.name,
        shown,
        [[Field("steps", "", (a, b), steps)]],
        most=task.time_limit,
        notes=[
            f"starts at {', '.join(held)}; {(steps >= task.time_limit).mean():.0%} last",
            *setup.notes,
        ],
    )


def _with_pool(setup: PolicySetup) -> PolicySetup:
    """Return the same with models that vary from a pool: one for each start would take minutes."""
    added = setup.disturbances
    if not added.vary or added.pool is not None:
        return setup
    return replace(setup, disturbances=replace(added, pool=POOL))


def _range(axes: Axes, dimension: int, setup: PolicySetup) -> tuple[float, float]:
    """Return from where to where starts lie: up to the limit, or as far as the table reaches."""
    limit = limit_along(dimension, setup.task)
    grid = setup.table.discretizer
    return (-limit, limit) if limit else (grid.low[dimension], grid.high[dimension])


def limit_along(dimension: int, task: Task) -> float | None:
    """Return how far a state may go along a dimension; None where nothing ends an episode."""
    limit = task.x_limit if dimension == 0 else task.theta_limit
    return limit if dimension % 2 == 0 and np.isfinite(limit) else None


def survival(
    setup: PolicySetup, starts: Floats, engine: Engine = "compiled"
) -> npt.NDArray[np.int64]:
    """Return after how many steps greedy episodes end, shape (n,); at most the time limit.

    Starting states have the shape (n, 2 + 2 poles).

    Raises:
        SimulationError: The physics diverged; names episode and step.
    """
    log = play_all(setup.world, setup.table, starts, setup.seed, engine)
    return log.columns.steps.astype(np.int64)
