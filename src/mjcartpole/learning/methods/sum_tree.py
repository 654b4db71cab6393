"""A tree of sums in a flat array: draws in proportion to weights that change, in log n steps.

Node k has its children at 2 k and 2 k + 1, the root is 1, and the leaves are the second half of the
array, whose length is a power of two.
"""

import numpy as np
import numpy.typing as npt

from mjcartpole.learning.methods.action_values import FloatMemory
from mjcartpole.learning.methods.limits import refuse


def make_tree(leaves: int) -> npt.NDArray[np.float64]:
    """Return a tree of zeros with at least so many leaves."""
    return np.zeros(2 << (leaves - 1).bit_length())


def check_tree(name: str, tree: npt.NDArray[np.float64], used: int, largest: float) -> None:
    """Refuse a tree that contradicts itself, by its name (ValueError).

    Its first `used` leaves have a weight, the others none; no weight is above the largest.
    """
    half = len(tree) // 2
    leaves, pairs = tree[half:], tree[2:].reshape(-1, 2)
    weighty = (leaves > 0) & (leaves <= largest)
    refuse(
        name,
        "has weights where there can be none",
        (weighty != (np.arange(half) < used)) | (leaves < 0),
    )
    refuse(name, "has sums of something else", tree[1:half] != pairs.sum(axis=1))


def set_leaf(tree: FloatMemory, leaf: int, weight: float) -> None:
    """Change one weight and the sums above it."""
    node = len(tree) // 2 + leaf
    tree[node] = weight
    while node > 1:
        weight += tree[node ^ 1]  # Its sibling.
        node //= 2
        tree[node] = weight


def weight_of(tree: FloatMemory, leaf: int) -> float:
    """Return the weight of a leaf."""
    return tree[len(tree) // 2 + leaf]


def find_leaf(tree: FloatMemory, sum_before: float, used: int) -> int:
    """Return the leaf in whose weight a sum over all, from the first on, comes to lie.

    It is one of the first `used` leaves, which have a weight: rounding may lift the sum above all.
    """
    node, half = 1, len(tree) // 2
    while node < half:
        node *= 2
        if sum_before >= tree[node]:
            sum_before -= tree[node]
            node += 1
    return min(node - half, used - 1)
