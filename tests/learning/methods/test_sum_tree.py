"""A tree of sums against sums over all weights."""

import numpy as np
import pytest

from mjcartpole.learning.methods.sum_tree import find_leaf, make_tree, set_leaf, weight_of


@pytest.mark.parametrize("n", [1, 2, 3, 8, 13])
def test_a_leaf_is_found_by_the_sum_before_it(n):
    rng = np.random.default_rng(n)
    tree, weights = make_tree(n), np.zeros(n)
    for leaf in [*range(n), *rng.integers(n, size=40)]:
        weights[leaf] = rng.integers(1, 9) / 8
        set_leaf(tree, leaf, weights[leaf])
        assert weight_of(tree, leaf) == weights[leaf]
        assert tree[1] == weights.sum()
        sums = rng.random(5) * tree[1]
        known = weights.cumsum() if weights.all() else weights[: leaf + 1].cumsum()
        found = [find_leaf(tree, x, len(known)) for x in sums]
        assert found == np.searchsorted(known, sums, "right").tolist()


def test_a_sum_beyond_all_weights_is_in_the_last_leaf_that_has_one():
    tree = make_tree(8)
    for leaf in (0, 1, 2):
        set_leaf(tree, leaf, 0.1)
    assert find_leaf(tree, tree[1], 3) == find_leaf(tree, 1.0, 3) == 2


def test_each_sum_is_that_of_its_children():
    rng, tree = np.random.default_rng(0), make_tree(20)
    for leaf in rng.integers(20, size=200):
        set_leaf(tree, leaf, rng.random())
        assert (tree[1:32] == tree[2:].reshape(-1, 2).sum(axis=1)).all()
