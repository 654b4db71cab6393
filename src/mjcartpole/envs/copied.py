"""Copies of an environment that go on by themselves, bit for bit."""

import copy
from collections.abc import Callable
from typing import Any, Final, Self

from mjcartpole.errors import ResetNeededError
from mjcartpole.physics.simulation import Simulation, State

_WIRES: Final = ("_move", "_middle", "_advance", "_at_hand")
"""What a copy makes anew: functions and views that hold on to one simulation."""

_OWN: Final = ("_simulation", "_pictures", "_model", "_steps_after_end", "disturber")
"""What even a shallow copy has for itself."""


class Copied:
    """What an environment does when it is copied, by `copy` or through a pickle."""

    _simulation: Simulation | None
    _advance: Callable[[float], State]
    _move: Callable[[float], State]
    _wire: Callable[[Simulation], None]

    def __getstate__(self) -> dict[str, Any]:
        """All that a copy needs to go on bit-equal; it opens a renderer of its own."""
        kept = {name: value for name, value in self.__dict__.items() if name not in _WIRES}
        return kept | {"_advance": self._advance is not needs_reset}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        if self._simulation is not None:
            self._wire(self._simulation)
        self._advance = self._move if state["_advance"] else needs_reset

    def __copy__(self) -> Self:
        """A copy with a simulation and pictures of its own; all else is shared with it."""
        own = {name: copy.copy(getattr(self, name)) for name in _OWN}
        copied = type(self).__new__(type(self))
        copied.__setstate__(self.__getstate__() | own)
        return copied


def needs_reset(control: float) -> State:
    """Refuse a step before the first reset.

    Raises:
        ResetNeededError: Always.
    """
    raise ResetNeededError("Call reset before using step method.")
