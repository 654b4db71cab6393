"""What was made from a text, by the text itself: each document is compiled once."""

from collections.abc import Callable, Hashable
from typing import Final

import mujoco

from mjcartpole.physics.cartpole import CartPole

MOST: Final = 32
"""How many are kept; the one that was not asked for longest makes room."""

LARGEST: Final = 2**20
"""Bytes of a document and its compiled model, beyond which it is not kept."""

_kept: dict[Hashable, CartPole] = {}


def remembered(key: Hashable, make: Callable[[], CartPole]) -> CartPole:
    """Return what `make` made of a key, now or before; it is shared, so nobody may change it.

    No lock: a fork in another thread would leave it locked in the child. At worst two threads
    make the same.
    """
    found = _kept.pop(key, None) or make()
    if len(found.xml) + mujoco.mj_sizeModel(found.model) <= LARGEST:
        _kept[key] = found
        for oldest in list(_kept)[:-MOST]:
            _kept.pop(oldest, None)
    return found
