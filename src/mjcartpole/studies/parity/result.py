"""Results: what one rung of the ladder found, in figures, bounds and words."""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

Verdict = Literal["holds", "fails", "beyond", "skipped"]


@dataclass(frozen=True)
class Figure:
    """One thing measured, and how large it may be.

    Attributes:
        name: What it is.
        value: What was measured.
        bound: The most it may be; None for a figure that is only reported.
        unit: In words.
        at_least: Whether the bound is the least it may be, instead.
    """

    name: str
    value: float
    bound: float | None = None
    unit: str = ""
    at_least: bool = False

    @property
    def holds(self) -> bool:
        """Whether the value is within its bound; NaN is not."""
        if self.bound is None:
            return True
        return self.value >= self.bound if self.at_least else self.value <= self.bound

    def as_dict(self) -> dict[str, Any]:
        """Return everything, as plain values for JSON, which knows neither NaN nor infinity."""
        value = self.value if math.isfinite(self.value) else str(self.value)
        return {**dataclasses.asdict(self), "value": value, "holds": self.holds}


@dataclass(frozen=True)
class Result:
    """What a rung measured, the bounds, the reason for them, and the verdict.

    Attributes:
        rung: Its number.
        title: What it compares.
        reason: Why the bounds are what they are.
        figures: What was measured.
        problems: What failed that is no figure, in words.
        story: Details of a failure: the worst case, both answers, the likely cause.
        skipped: Why nothing was measured, if so.
        beyond: Whether that is because the equations do not cover the model.
    """

    rung: int
    title: str
    reason: str
    figures: tuple[Figure, ...] = ()
    problems: tuple[str, ...] = ()
    story: tuple[str, ...] = ()
    skipped: str = ""
    beyond: bool = False

    @property
    def verdict(self) -> Verdict:
        """`fails` if anything is out of bounds; `beyond` is no pass either."""
        if self.beyond:
            return "beyond"
        if self.skipped:
            return "skipped"
        return "holds" if not self.problems and all(f.holds for f in self.figures) else "fails"

    def as_dict(self) -> dict[str, Any]:
        """Return everything, as plain values for JSON."""
        return {
            "rung": self.rung,
            "title": self.title,
            "verdict": self.verdict,
            "reason": self.reason,
            "figures": [f.as_dict() for f in self.figures],
            "problems": list(self.problems),
            "story": list(self.story),
            "skipped": self.skipped,
        }


@dataclass(frozen=True)
class Question:
    """What a rung asks: see the first three of a `Result`, which every answer is."""

    rung: int
    title: str
    reason: str

    def answer(self, figures: Sequence[Figure] = (), **found: Any) -> Result:  # noqa: ANN401
        """Return what was measured, and what else a `Result` holds."""
        return Result(self.rung, self.title, self.reason, tuple(figures), **found)

    def skip(self, why: str) -> Result:
        """Return that nothing was measured, and why, in one line."""
        return self.answer(skipped=" ".join(why.split()))

    def leave(self, beyond: Sequence[str]) -> Result:
        """Return that nothing can be said, since the equations do not cover the model."""
        return self.answer(skipped="the equations do not cover: " + "; ".join(beyond), beyond=True)
