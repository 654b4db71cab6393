"""Plots of runs: what they were like to learn, what was learned, and how long it lasts.

Each function returns numbers that can be drawn (`media.plots.Plot`): `figure()` draws them with
matplotlib, `rows()` has exactly what is drawn.
"""

import dataclasses
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
import numpy.typing as npt

from mjcartpole.errors import ConfigError, check_known
from mjcartpole.files import is_folder
from mjcartpole.learning.episodes import ENDINGS, SIDES
from mjcartpole.learning.evaluation import EPISODES
from mjcartpole.learning.records import Record, read_visits
from mjcartpole.learning.slices import SHOWN, check_of_state, choose_axes, slices
from mjcartpole.media.curve_plot import Curves
from mjcartpole.media.endings_plot import Endings, EndingsPlot, stretches
from mjcartpole.media.grid_plot import Grid, Kind
from mjcartpole.media.grid_plot import Path as PlanePath
from mjcartpole.media.plots import Plot
from mjcartpole.studies.basin import basin, limit_along
from mjcartpole.studies.policy_setup import PolicySetup, find_setup
from mjcartpole.studies.run_curves import curves_of, read_groups
from mjcartpole.studies.statistics import Average

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PHASES: Final = 3
"""Episodes in the phase plane."""
STRETCHES: Final = 50
"""Of a training whose endings are counted."""

At = Mapping[str, float]
Floats = npt.NDArray[np.float64]
Kinds = Literal["curve", "table", "basin", "phase", "endings"]


def plot(kind: Kinds, *runs: str | Path, **options: Any) -> "Figure":  # noqa: ANN401
    """Draw runs with matplotlib.

    >>> plot("curve", "runs/tuned-mujoco-seed0").savefig("curve.png")  # doctest: +SKIP

    Args:
        kind: `curve`, `table`, `basin`, `phase` or `endings`.
        runs: Run folders: one, but for curves and endings; or a policy file, but for these.
        options: See the function of that kind.

    Raises:
        MjCartPoleError: A run cannot be used, or an option makes no sense.
    """
    return numbers(kind, [Path(run) for run in runs], **options).figure()


def numbers(kind: Kinds, runs: Sequence[Path], **options: Any) -> Plot:  # noqa: ANN401
    """Return what is drawn of runs; see `plot`."""
    check_known("kind of plot", kind, (*OF_SEVERAL, *OF_ONE))
    if not runs:
        raise ConfigError(f"plot {kind} needs a run folder")
    if kind in OF_SEVERAL:
        return OF_SEVERAL[kind](runs, **options)
    if len(runs) > 1:
        raise ConfigError(f"plot {kind} is for one run, not {len(runs)}")
    setup = find_setup(runs[0])
    if kind == "table" and is_folder(runs[0]):
        options = {"visits": read_visits(runs[0], setup.table.discretizer), **options}
    return OF_ONE[kind](setup, **options)


def curve(
    folders: Iterable[Path], *, window: int | None = None, average: Average | None = None
) -> Curves:
    """Return learning curves; runs that differ by their seed alone are one line with a band.

    The folders are those of runs, and of many seeds. For the rest see `curves_of`.

    Raises:
        RunError: A run is damaged, or no episode of it is finished.
        ConfigError: The window or the average makes no sense.
    """
    return curves_of(read_groups(folders), window=window, average=average)


def table(
    setup: PolicySetup,
    *,
    dims: Sequence[str] = (),
    over: str | None = None,
    at: At | None = None,
    shown: Sequence[Kind] = SHOWN,
    visits: npt.NDArray[np.int64] | None = None,
) -> Grid:
    """Return slices of a table: greedy action, advantage and visits, a row for each that is shown.

    For `dims`, `over` and `at` see `choose_axes`; visits are as `read_visits` gives them.

    Raises:
        ConfigError: There is no such dimension, or one is asked for twice.
    """
    policy = setup.table
    axes = choose_axes(policy.discretizer, dims, over, at)
    a, b = (limit_along(dimension, setup.task) for dimension in axes.dims)
    return slices(
        setup.name,
        policy.discretizer,
        policy.q_table,
        axes,
        visits=visits,
        shown=shown,
        limits=(a, b),
    )


def phase(
    setup: PolicySetup, *, dims: Sequence[str] = (), at: At | None = None, episodes: int = PHASES
) -> Grid:
    """Return greedy episodes in a plane, over the action that the table has there.

    They are the first that an evaluation with the same seed plays. For `dims` and `at` see
    `choose_axes`; the episodes themselves are not held.

    Raises:
        ConfigError: There is no such dimension, or no episode.
        SimulationError: The physics diverged.
    """
    from mjcartpole.studies.film import play  # noqa: PLC0415 - other plots need no Pillow

    policy = setup.table
    check_of_state(policy.discretizer, dims)
    axes = choose_axes(policy.discretizer, dims, "none", at)
    takes = play(setup, episodes)
    paths = [
        PlanePath(take.states[:, axes.dims], take.episode.ending, take.episode.ending == ENDINGS[0])
        for take in takes
    ]
    a, b = (limit_along(dimension, setup.task) for dimension in axes.dims)
    drawn = slices(setup.name, policy.discretizer, policy.q_table, axes, shown=("action",))
    notes = [
        *(f"the table {words}" for words in drawn.notes),
        f"{len(paths)} episodes: from a dot to a square (time limit) or a cross",
        *setup.notes,
    ]
    return dataclasses.replace(drawn, paths=paths, limits=(a, b), notes=notes)


def endings(folders: Iterable[Path], *, episodes: int = EPISODES) -> EndingsPlot:
    """Return how episodes ended along trainings, and how so many of the greedy policies do.

    The folders are those of runs, and of many seeds.

    Raises:
        RunError: A run is damaged, or no episode of it is finished.
        SimulationError: The physics diverged.
    """
    counted = [(name, *_count(records, episodes)) for name, records in read_groups(folders)]
    found = sum(counts.sum(axis=1) + greedy for _, _, counts, greedy in counted) > 0
    runs = [
        Endings(name, ends, (counts / counts.sum(axis=0))[found], (greedy / greedy.sum())[found])
        for name, ends, counts, greedy in counted
    ]
    looks = [(number, name) for number, name in enumerate(_NAMES) if found[number]]
    return EndingsPlot(runs, looks)


def _count(
    records: Sequence[Record], episodes: int
) -> tuple[npt.NDArray[np.int64], Floats, Floats]:
    """Return stretches of trainings, how often each ending came in each, and in greedy episodes."""
    ends = stretches(max(len(record.columns.totals) for record in records), STRETCHES)
    counts, greedy = np.zeros((len(_NAMES), len(ends))), np.zeros(len(_NAMES))
    for record in records:
        kinds = record.columns.endings * len(SIDES) + record.columns.sides
        stretch = np.searchsorted(ends, np.arange(1, len(kinds) + 1))
        np.add.at(counts, (_PLACES[kinds], stretch), 1)
        for episode in find_setup(record.folder).evaluate(episodes).episodes:
            kind = ENDINGS.index(episode.ending) * len(SIDES) + SIDES.index(episode.side)
            greedy[_PLACES[kind]] += 1
    return ends, counts, greedy


_KINDS: Final = [
    (ending, side) for ending in ("pole fell", "off the track", "time limit") for side in SIDES
]
_NAMES: Final = [f"{ending} {side}".rstrip() for ending, side in _KINDS]
_PLACES: Final = np.array([_KINDS.index((e, side)) for e in ENDINGS for side in SIDES])
"""From an ending and a side, as the log numbers them, to what is drawn from below upwards."""


OF_SEVERAL: Final[Mapping[str, Callable[..., Plot]]] = {"curve": curve, "endings": endings}
OF_ONE: Final[Mapping[str, Callable[..., Plot]]] = {"table": table, "basin": basin, "phase": phase}
