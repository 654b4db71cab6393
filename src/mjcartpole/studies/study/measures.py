"""What a study measures of a training."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.evaluation import Evaluation
from mjcartpole.learning.training import TrainResult

STRETCHES: Final = 50
"""Points of a learning curve."""
EVALUATIONS: Final = 20
"""Greedy evaluations in the midst of a training that is to say when it was solved."""


@dataclass(frozen=True)
class Outcome:
    """What a training came to.

    Attributes:
        result: What was learned.
        greedy: Greedy episodes afterwards; None where none are asked for.
        disturbed: Greedy episodes under the disturbances of [robustness]; None likewise.
    """

    result: TrainResult
    greedy: Evaluation | None = None
    disturbed: Evaluation | None = None


@dataclass(frozen=True)
class Measure:
    """A figure of a training.

    Attributes:
        text: What it is.
        of: The figure of what a training came to; None where it has none.
        more_is_better: Whether a larger one is better.
        budget: Of a training that never came to it, what it spent in vain.
    """

    text: str
    of: Callable[["Outcome"], float | None]
    more_is_better: bool = True
    budget: str = ""


MEASURES: Final[dict[str, Measure]] = {
    "greedy_mean": Measure(
        "mean return of 100 greedy episodes after the training",
        lambda its: its.greedy.mean if its.greedy else None,
    ),
    "greedy_minimum": Measure(
        "the least return of these",
        lambda its: its.greedy.minimum if its.greedy else None,
    ),
    "robust_mean": Measure(
        "mean return of 100 greedy episodes under the disturbances of [robustness]",
        lambda its: its.disturbed.mean if its.disturbed else None,
    ),
    "robust_minimum": Measure(
        "the least return of these",
        lambda its: its.disturbed.minimum if its.disturbed else None,
    ),
    "episodes_to_solve": Measure(
        "training episodes until a greedy evaluation in its midst was solved",
        lambda its: its.result.solved and its.result.solved.episodes,
        more_is_better=False,
        budget="episodes_trained",
    ),
    "steps_to_solve": Measure(
        "the steps of these",
        lambda its: its.result.solved and its.result.solved.steps,
        more_is_better=False,
        budget="steps_trained",
    ),
    "area_under_curve": Measure(
        "mean return of all training episodes: the area under the learning curve, by episode",
        lambda its: float(its.result.returns.mean()),
    ),
    "table_bytes": Measure(
        "what the table takes in memory",
        lambda its: its.result.policy.q_table.nbytes,
        more_is_better=False,
    ),
    "seconds": Measure(
        "time of the training; other each time, so it stands apart",
        lambda its: round(its.result.seconds, 6),
        more_is_better=False,
    ),
    "steps_per_second": Measure(
        "steps of the training over that time",
        lambda its: round(its.result.steps / max(its.result.seconds, 1e-9)),
    ),
}
"""By name."""

APART: Final = ("seconds", "steps_per_second")
"""Those that are never the same twice."""


def plays_after(measures: Sequence[str]) -> bool:
    """Return whether greedy episodes are to be played after a training."""
    return any(name.startswith("greedy") for name in measures)


def with_evaluations(config: TrainConfig, measures: Sequence[str]) -> dict[str, Any]:
    """Return what a config needs besides, to say when it was solved."""
    wanted = any(name.endswith("to_solve") for name in measures)
    if not wanted or config.evaluation_period is not None:
        return {}
    return {"evaluate_every": max(1, config.episodes // EVALUATIONS)}


def is_disturbed(measures: Sequence[str]) -> bool:
    """Return whether greedy episodes are to be played under other disturbances."""
    return any(name.startswith("robust") for name in measures)


def figures_of(outcome: Outcome, *, apart: bool = False) -> dict[str, float | None]:
    """Return all figures of a training that are the same each time; or those that are not."""
    return {name: each.of(outcome) for name, each in MEASURES.items() if (name in APART) == apart}


def curve_of(result: TrainResult) -> list[list[float]]:
    """Return the learning curve: up to an episode, the mean return since the point before."""
    ends = np.unique(np.linspace(0, len(result.returns), STRETCHES + 1).round().astype(int))
    sums = np.concatenate([[0.0], np.cumsum(result.returns)])
    means = np.diff(sums[ends]) / np.diff(ends)
    return [[int(end), float(mean)] for end, mean in zip(ends[1:], means, strict=True)]
