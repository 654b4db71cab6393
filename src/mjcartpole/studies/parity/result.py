"""What one rung of the ladder found."""

from dataclasses import dataclass, field
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
    """

    name: str
    value: float
    bound: float | None = None
    unit: str = ""

    @property
    def holds(self) -> bool:
        """Whether the value is within its bound; NaN is not."""
        return self.bound is None or self.value <= self.bound


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
    story: tuple[str, ...] = field(default=())
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
        """Everything, as plain values for JSON."""
        return {
            "rung": self.rung,
            "title": self.title,
            "verdict": self.verdict,
            "reason": self.reason,
            "figures": [
                {"name": f.name, "value": f.value, "bound": f.bound, "unit": f.unit}
                for f in self.figures
            ],
            "problems": list(self.problems),
            "story": list(self.story),
            "skipped": self.skipped,
        }
