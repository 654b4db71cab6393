"""Disturbances that are to be others than those of a run, as fields: flags of commands."""

import dataclasses
from typing import Any

from mjcartpole.disturbances.disturbances import Disturbances, WorldDisturbances


@dataclasses.dataclass(frozen=True, kw_only=True)
class DisturbanceChanges(WorldDisturbances):
    """What is added to a task, as `Disturbances` has it; what is left out stays as it is."""

    delay: int | None = None  # type: ignore[assignment]
    hold: float | None = None  # type: ignore[assignment]
    drop: float | None = None  # type: ignore[assignment]
    lag: float | None = None  # type: ignore[assignment]
    force_noise: float | None = None  # type: ignore[assignment]
    sensor_delay: int | None = None  # type: ignore[assignment]

    @property
    def additions(self) -> dict[str, Any]:
        """What was given, by name."""
        names = [field.name for field in dataclasses.fields(WorldDisturbances)]
        values = {name: getattr(self, name) for name in names}
        return {name: value for name, value in values.items() if value not in (None, ())}

    def added_to(self, otherwise: Disturbances) -> Disturbances:
        """Return the disturbances: those that are given here, and otherwise those that there are.

        Raises:
            ConfigError: One makes no sense.
        """
        return dataclasses.replace(otherwise, **self.additions)
