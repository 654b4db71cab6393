"""A state in several rows of a table: in offset grids that are summed, or between nodes.

Tile coding: Albus (1975); Sutton and Barto (2018), section 9.5.4. Each of 2^bits tilings is a grid
of the same bins, moved by another multiple of the 2^bits-th part of a bin: in dimension d by the
odd number 2 d + 1 times the tiling's own number, which spreads them better than one diagonal does
(Miller and Glanz, 1996). Where the bins begin and end all tilings have the same edge.

Interpolation: the rows are nodes, the first and the last at the ends of each range, and a value is
multilinear between the nodes around it (Davies, 1997, NeurIPS 9). Outside it is that of the end.

A state is a cell of one fine grid, which all edges of the tilings make, or which cuts the gap
between two nodes into equal parts; its rows follow from its number alone. Numba compiles the
functions here as they are.
"""

from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from mjcartpole.learning.discretizer import Discretizer, folded

Table: TypeAlias = "memoryview[float] | npt.NDArray[np.float64]"
"""A flat table, shape (2 rows,), the values of a row at 2 row and 2 row + 1: the compiled loop has
the array, Python a quicker view."""


class Tiles(NamedTuple):
    """Several offset grids, or one of nodes; None in their place: a state is a row."""

    bits: int
    """There are 2^bits of them; or as many cells between two nodes."""
    bins: tuple[int, ...]
    """Of each, in the dimensions that have more than one."""
    interpolated: bool
    """Whether they are nodes."""


def tiles_of(discretizer: Discretizer) -> Tiles | None:
    """Return the tilings or nodes of a discretizer; None where a state is a row."""
    if discretizer.parts == 1:
        return None
    bins = (discretizer.bins[dimension] for dimension in discretizer.grid.dimensions)
    return Tiles(discretizer.parts.bit_length() - 1, tuple(bins), discretizer.interpolated)


def place(tiles: Any, s: int) -> tuple[int, int]:
    """Return the row of a state in the tiling that is not moved, and how far it is into its bins.

    That is a number of `bits` bits for each dimension, one after the other. Of nodes it is the row
    of the last one before it, and how far behind that it is.
    """
    row, within, stride = 0, 0, 1
    for axis in range(len(tiles.bins) - 1, -1, -1):
        cells = ((tiles.bins[axis] - 1) << tiles.bits) + 1
        cell, s = s % cells, s // cells
        row += stride * (cell >> tiles.bits)
        within = within << tiles.bits | cell & ((1 << tiles.bits) - 1)
        stride *= tiles.bins[axis]
    return row, within


def all_weights(tiles: Any) -> int:
    """Return the sum of the weights of a state's rows."""
    return 1 if tiles is None or tiles.interpolated else 1 << tiles.bits


def home(tiles: Any, s: int) -> int:
    """Return the row that a state is counted in: of the unmoved tiling, or the nearest node."""
    if tiles is None:
        return s
    half = (1 << tiles.bits) >> 1 if tiles.interpolated else 0
    row, stride = 0, 1
    for axis in range(len(tiles.bins) - 1, -1, -1):
        cells = ((tiles.bins[axis] - 1) << tiles.bits) + 1
        row += stride * ((s % cells + half) >> tiles.bits)
        s //= cells
        stride *= tiles.bins[axis]
    return row


def row_in(tiles: Any, tiling: int, row: int, within: int) -> int:
    """Return the row of a state in one of the tilings, from what `place` returned."""
    stride = 1
    for axis in range(len(tiles.bins) - 1, -1, -1):
        moved = tiling * (2 * axis + 1) & ((1 << tiles.bits) - 1)
        if (within >> tiles.bits * axis & ((1 << tiles.bits) - 1)) + moved >> tiles.bits:
            row += stride
        stride *= tiles.bins[axis]
    return tiling * stride + row


def node_at(tiles: Any, corner: int, row: int, within: int) -> tuple[int, float]:
    """Return the row of one of the nodes around a state, and its weight; these sum to 1.

    A corner has a bit for each dimension, set on the far side; the rest is what `place` returned.
    """
    cells, weight, stride = 1 << tiles.bits, 1.0, 1
    for axis in range(len(tiles.bins) - 1, -1, -1):
        behind = within >> tiles.bits * axis & (cells - 1)
        if not corner >> axis & 1:
            weight *= 1.0 - behind / cells
        else:
            weight *= behind / cells
            if behind:  # Nothing is beyond the last node.
                row += stride
        stride *= tiles.bins[axis]
    return row, weight


def pair_at(tiles: Any, q: Table, s: int) -> tuple[float, float]:
    """Return the values of both actions in a state."""
    if tiles is None:
        return q[2 * s], q[2 * s + 1]
    row, within = place(tiles, s)
    left, right = 0.0, 0.0
    if tiles.interpolated:
        for corner in range(1 << len(tiles.bins)):
            here, weight = node_at(tiles, corner, row, within)
            left += weight * q[2 * here]
            right += weight * q[2 * here + 1]
    else:
        for tiling in range(1 << tiles.bits):
            here = 2 * row_in(tiles, tiling, row, within)
            left += q[here]
            right += q[here + 1]
    return left, right


def value_at(tiles: Any, q: Table, s: int, a: int) -> float:
    """Return the value of one action in a state."""
    if tiles is None:
        return q[2 * s + a]
    left, right = pair_at(tiles, q, s)
    return right if a == 1 else left


def add_at(tiles: Any, q: Table, s: int, a: int, change: float) -> None:
    """Change the value of an action in a state; each row takes its share."""
    if tiles is None:
        q[2 * s + a] += change
        return
    row, within = place(tiles, s)
    if tiles.interpolated:
        for corner in range(1 << len(tiles.bins)):
            here, weight = node_at(tiles, corner, row, within)
            q[2 * here + a] += change * weight
    else:
        for tiling in range(1 << tiles.bits):
            q[2 * row_in(tiles, tiling, row, within) + a] += change / (1 << tiles.bits)


def greedy(tiles: Any, choices: Any, s: int, folding: int) -> int:
    """Return the better action of a state; 0 between equals. For the folding see `Grid`.

    The choices are the table, flat; where a state is a row, the action of each.
    """
    if tiles is None:
        return int(choices[s])
    s, mirrored = folded(s, folding)
    left, right = pair_at(tiles, choices, s)
    a = 1 if right > left else 0
    return 1 - a if mirrored else a
