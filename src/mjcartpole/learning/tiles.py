"""Tile coding: the value of an action as the sum over several grids, each a little offset.

Albus (1975); Sutton and Barto (2018), section 9.5.4. Each of 2^bits tilings is a grid of the same
bins, moved by another multiple of the 2^bits-th part of a bin: in dimension d by the odd number
2 d + 1 times the tiling's own number, which spreads them better than one diagonal does (Miller and
Glanz, 1996). Where the bins begin and end all tilings have the same edge.

A state is a cell of the one fine grid that all their edges make; its rows in the tilings follow
from its number alone. Numba compiles the functions here as they are.
"""

from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from mjcartpole.learning.discretizer import Discretizer, folded

Table: TypeAlias = "memoryview[float] | npt.NDArray[np.float64]"
"""A flat table, shape (2 rows,), the values of a row at 2 row and 2 row + 1: the compiled loop has
the array, Python a quicker view."""


class Tiles(NamedTuple):
    """Several offset grids."""

    bits: int
    """There are 2^bits of them."""
    bins: tuple[int, ...]
    """Of each, in the dimensions that have more than one."""


def tiles_of(discretizer: Discretizer) -> Tiles | None:
    """Return the tilings of a discretizer; None where there is one."""
    if discretizer.tilings == 1:
        return None
    bins = (discretizer.bins[dimension] for dimension in discretizer.grid.dimensions)
    return Tiles(discretizer.tilings.bit_length() - 1, tuple(bins))


def place(tiles: Any, s: int) -> tuple[int, int]:
    """Return the row of a state in the tiling that is not moved, and how far it is into its bins.

    That is a number of `bits` bits for each dimension, six bits apart.
    """
    row, within, stride = 0, 0, 1
    for axis in range(len(tiles.bins) - 1, -1, -1):
        cells = ((tiles.bins[axis] - 1) << tiles.bits) + 1
        cell, s = s % cells, s // cells
        row += stride * (cell >> tiles.bits)
        within = within << 6 | cell & ((1 << tiles.bits) - 1)
        stride *= tiles.bins[axis]
    return row, within


def row_in(tiles: Any, tiling: int, row: int, within: int) -> int:
    """Return the row of a state in one of the tilings, from what `place` returned."""
    stride = 1
    for axis in range(len(tiles.bins) - 1, -1, -1):
        moved = tiling * (2 * axis + 1) & ((1 << tiles.bits) - 1)
        if (within >> 6 * axis & 63) + moved >> tiles.bits:
            row += stride
        stride *= tiles.bins[axis]
    return tiling * stride + row


def pair_at(tiles: Any, q: Table, s: int) -> tuple[float, float]:
    """Return the values of both actions in a state.

    Args:
        tiles: `Tiles`, or None where a state is a row.
        q: A table.
        s: The state.
    """
    if tiles is None:
        return q[2 * s], q[2 * s + 1]
    row, within = place(tiles, s)
    left, right = 0.0, 0.0
    for tiling in range(1 << tiles.bits):
        here = 2 * row_in(tiles, tiling, row, within)
        left += q[here]
        right += q[here + 1]
    return left, right


def add_at(tiles: Any, q: Table, s: int, a: int, change: float) -> None:
    """Change the value of an action in a state; each tiling takes its share."""
    if tiles is None:
        q[2 * s + a] += change
    else:
        row, within = place(tiles, s)
        for tiling in range(1 << tiles.bits):
            q[2 * row_in(tiles, tiling, row, within) + a] += change / (1 << tiles.bits)


def greedy(tiles: Any, choices: Any, s: int, folding: int) -> int:
    """Return the better action of a state; 0 between equals.

    Args:
        tiles: `Tiles`, or None where a state is a row.
        choices: The table, flat; where a state is a row, the action of each.
        s: The state.
        folding: See `Grid`.
    """
    if tiles is None:
        return int(choices[s])
    s, mirrored = folded(s, folding)
    left, right = pair_at(tiles, choices, s)
    a = 1 if right > left else 0
    return 1 - a if mirrored else a
