"""Rules that are to be others than a task's, as fields: of configs, and flags of commands."""

import dataclasses
from typing import Any

from mjcartpole.rules import RULES
from mjcartpole.task import Task, resolve


@dataclasses.dataclass(frozen=True, kw_only=True)
class RuleChanges:
    """A task's name, and what is other than there; None leaves a rule as it is."""

    task: str | None = None
    """The rules: limits, starting states, reward, time limit; the run's own if left out."""
    x_limit: float | None = None
    """How far the cart may be from the middle, m; inf for any distance. The rules' own if left out,
    as all of these."""
    theta_limit: float | None = None
    """How far a pole may lean, rad; inf for any angle."""
    start_low: float | None = None
    """Least of each of the starting state's values (m, m/s, rad, rad/s), drawn uniformly."""
    start_high: float | None = None
    """Largest of them."""
    start_angle: float | None = None
    """Where a pole starts, rad: 0 upright, 3.1416 hanging; what is drawn is added."""
    reward: str | None = None
    """What a step pays: one-per-step, minus-one-at-the-end or upright."""
    max_episode_steps: int | None = None
    """Control steps until an episode is truncated."""

    @property
    def changes(self) -> dict[str, Any]:
        """What `resolve` takes beside the task."""
        return {name: getattr(self, name) for name in RULES}

    def applied_to(self, otherwise: Task) -> Task:
        """Return the rules: of the task that is named, or otherwise another one, with changes.

        Raises:
            ConfigError: There is no such task, or a rule makes no sense.
        """
        return resolve(otherwise if self.task is None else self.task, **self.changes)
