"""A policy in many states at once, to the bits that it has in each of them."""

from typing import Any

import numpy as np
import numpy.typing as npt

from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.tiles import Tiles, tiles_of
from mjcartpole.task import N_ACTIONS

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


def cells_of(discretizer: Discretizer, states: Floats) -> Ints:
    """Return what `row_of` puts together: a cell in each used dimension, shape (n, used)."""
    grid = discretizer.grid
    cells = np.zeros((len(states), len(grid.bins)), np.int64)
    for axis, n in enumerate(grid.bins):
        low, high = grid.low[axis], grid.high[axis]
        value = states[:, grid.dimensions[axis]]
        inside = np.clip(value, low, high)
        cells[:, axis] = np.minimum((inside - low) / grid.width[axis], n - 1)
        cells[value >= high, axis] = n - 1
    return cells


def values_in(discretizer: Discretizer, table: Floats, states: Floats) -> Floats:
    """Return the values of both actions, by a policy's table, in many states, shape (n, 2)."""
    grid, tiles, q = discretizer.grid, tiles_of(discretizer), table.reshape(-1, N_ACTIONS)
    cells = cells_of(discretizer, states)
    if not discretizer.mirror:
        return _pairs(tiles, grid.bins, q, cells)
    mirrored = 2 * _rows(grid.bins, cells) >= grid.folding
    cells[mirrored] = np.asarray(grid.bins) - 1 - cells[mirrored]
    values = _pairs(tiles, grid.bins, q, cells)
    values[mirrored] = values[mirrored, ::-1]
    return values


def actions_in(discretizer: Discretizer, table: Floats, states: Floats) -> Ints:
    """Return the better action in many states, shape (n,); 0 between equals.

    An observation has 32 bits, and what is decided by are its digits.
    """
    seen = states.astype(np.float32).astype(np.float64)
    grid, q = discretizer.grid, table.reshape(-1, N_ACTIONS)
    if tiles_of(discretizer) is None:
        rows = _rows(grid.bins, cells_of(discretizer, seen))
        choices: Ints = np.argmax(q, axis=1).astype(np.int64)[rows]
        return choices
    values = values_in(discretizer, table, seen)
    # Between equals the learner's own first action is played, which is the second in the mirror.
    mirrored = 2 * _rows(grid.bins, cells_of(discretizer, seen)) >= grid.folding
    right = np.where(mirrored, values[:, 1] >= values[:, 0], values[:, 1] > values[:, 0])
    return right.astype(np.int64)


def homes_in(discretizer: Discretizer, states: Floats) -> Ints:
    """Return the rows that many states are counted in, shape (n,); see `home`."""
    tiles, cells = tiles_of(discretizer), cells_of(discretizer, states)
    if tiles is None:
        return _rows(discretizer.grid.bins, cells)
    half = (1 << tiles.bits) >> 1 if tiles.interpolated else 0
    return _rows(tiles.bins, (cells + half) >> tiles.bits)


def _rows(bins: Any, cells: Ints) -> Ints:
    """Return the row of each cell, in C order."""
    rows = np.zeros(len(cells), np.int64)
    for axis, n in enumerate(bins):
        rows = rows * n + cells[:, axis]
    return rows


def _pairs(tiles: Tiles | None, bins: Any, q: Floats, cells: Ints) -> Floats:
    """Do what `pair_at` does, in the same order, so that it rounds alike."""
    if tiles is None:
        pairs: Floats = q[_rows(bins, cells)]
        return pairs
    values = np.zeros((len(cells), N_ACTIONS))
    parts = 1 << tiles.bits
    if not tiles.interpolated:
        for tiling in range(parts):
            moved = [tiling * (2 * axis + 1) & (parts - 1) for axis in range(len(tiles.bins))]
            first = tiling * int(np.prod(tiles.bins))
            values += q[first + _rows(tiles.bins, cells + moved >> tiles.bits)]
        return values
    for corner in range(1 << len(tiles.bins)):
        weight, node = np.ones(len(cells)), cells >> tiles.bits
        for axis in range(len(tiles.bins) - 1, -1, -1):
            behind = cells[:, axis] & (parts - 1)
            is_far = corner >> axis & 1
            weight *= behind / parts if is_far else 1.0 - behind / parts
            node[:, axis] += is_far & (behind > 0)
        values += weight[:, None] * q[_rows(tiles.bins, node)]
    return values
