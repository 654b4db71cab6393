"""Limits of what a memory may hold: they stand in the types of its fields.

Compiled code checks no index, and a checkpoint may hold whatever somebody else has put together. A
training is saved between two episodes, when some fields have one possible value only.
"""

from collections.abc import Callable
from typing import Annotated, Any, TypeAlias

import numpy as np

from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.methods.action_values import FloatMemory, IntMemory
from mjcartpole.task import N_ACTIONS

Limits: TypeAlias = Callable[[Discretizer], tuple[int, int]]
"""From a grid to the least and the largest value."""

Actions = Annotated[IntMemory, lambda grid: (0, N_ACTIONS - 1)]
Flags = Annotated[IntMemory, lambda grid: (0, 1)]
States = Annotated[IntMemory, lambda grid: (0, grid.n_states - 1)]
Pairs = Annotated[IntMemory, lambda grid: (0, N_ACTIONS * grid.n_rows - 1)]
PairCounts = Annotated[IntMemory, lambda grid: (0, N_ACTIONS * grid.n_rows)]
"""How many of all pairs of a state and an action."""
StepCounts = Annotated[IntMemory, lambda grid: (0, 2**53)]
"""How many of all steps: more than anybody waits for, and floats still tell them apart."""
NoAction = Annotated[IntMemory, lambda grid: (-1, -1)]
NoSteps = Annotated[IntMemory, lambda grid: (0, 0)]
NoTraces = Annotated[FloatMemory, lambda grid: (0, 0)]
"""Between two episodes."""


def check_limits(memory: Any, grid: Discretizer) -> None:
    """Refuse values beyond their field's limits, or not finite (ValueError; names the field)."""
    for name, kind in type(memory).__annotations__.items():
        values = np.asarray(getattr(memory, name))
        refuse(name, "has values that are not finite", ~np.isfinite(values))
        for limits in getattr(kind, "__metadata__", ()):
            low, high = limits(grid)
            said = f"has values that are not from {low} to {high}"
            refuse(name, said, (values < low) | (values > high))


def refuse(name: str, why: str, found: Any) -> None:
    """Raise ValueError for a field, and why, if anything was found: True, or an array with one."""
    if np.any(found):
        raise ValueError(f"{name} {why}")
