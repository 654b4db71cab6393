"""What the page tells of a run beside the scene: what it came to, how it was trained, its plots."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from mjcartpole.learning import runs
from mjcartpole.learning.documents import read_summary
from mjcartpole.learning.stored import read_document
from mjcartpole.media.plots import svg_of
from mjcartpole.studies.run_plots import Kinds, plot

PLOTS: Final[dict[Kinds, tuple[str, str]]] = {
    "curve": ("Learning curve", "The return of each episode of training, smoothed and raw."),
    "table": ("The table", "Slices of the table: the better action, by how much, and visits."),
    "basin": ("Basin", "From which starts the pole is kept up, and for how long."),
    "endings": ("Endings", "How episodes ended along the training, and how greedy ones do."),
}
"""Which plots, with their titles, and what they show for those who do not see them."""

Table = dict[str, Any]
"""A row's name and its text."""


@dataclass(frozen=True)
class Picture:
    """A plot of a run.

    Attributes:
        title: What it shows.
        alt: The same for those who do not see it.
        svg: The picture.
    """

    title: str
    alt: str
    svg: str


@dataclass(frozen=True)
class Told:
    """What is told of a run beside the scene.

    Attributes:
        facts: What it came to.
        config: How it was trained.
        versions: With what.
        pictures: Its plots.
        film: Its film, an .mp4 or .gif, if there is one.
    """

    facts: Table = field(default_factory=dict)
    config: Table = field(default_factory=dict)
    versions: Table = field(default_factory=dict)
    pictures: tuple[Picture, ...] = ()
    film: Path | None = None


def told_of(folder: Path, film: Path | None, *, plots: bool) -> Told:
    """Return what is told of a run, and its film; plots take seconds, and need matplotlib.

    Raises:
        RunError: Something in it is damaged.
        RenderError: matplotlib is not installed.
    """
    run, summary = runs.load_run(folder), read_summary(folder)
    versions = read_document(folder / runs.VERSIONS, None, dict, "cannot be read")
    config = {"preset": run.preset, **run.config.values()}
    pictures = tuple(_drawn(folder)) if plots else ()
    return Told(facts_of(summary), config, versions, pictures, film)


def facts_of(summary: dict[str, Any]) -> Table:
    """Return what a run came to, from its summary, in a person's words."""
    facts = {"Episodes": summary["episodes"], "Steps of training": summary["steps"]}
    if solved := summary.get("solved"):
        facts["Solved after"] = f"{solved['episodes']:,} episodes"
    if played := summary.get("evaluation"):
        facts["Mean greedy return"] = f"{played['mean']:.5g}"
        facts["Least of them"] = f"{played['minimum']:.5g}"
        ends = played["endings"].items()
        facts |= {f"Greedy: {how}": f"{n} of {played['episodes']}" for how, n in ends if n}
    return facts


def _drawn(folder: Path) -> Iterator[Picture]:
    for kind, (title, alt) in PLOTS.items():
        yield Picture(title, alt, svg_of(plot(kind, folder)))
