"""Learning curves of runs: those that differ by their seed alone are one line with a band."""

import dataclasses
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from mjcartpole.errors import ConfigError, RunError
from mjcartpole.learning.records import Record, read_record
from mjcartpole.media.curve_plot import (
    Curves,
    Line,
    greedy_points,
    line_of_run,
    places,
    running_mean,
    usual_window,
)
from mjcartpole.studies.multi_seed_runs import is_seeds, seeds_of
from mjcartpole.studies.statistics import Average, bootstrap_band

Group = tuple[str, list[Record]]


def read_groups(folders: Iterable[Path]) -> list[Group]:
    """Return runs by name; those of one config but for the seed under one, each seed once.

    Raises:
        RunError: One is damaged, or none of its episodes is finished.
    """
    groups: dict[object, Group] = {}
    for folder in folders:
        name = folder.resolve().name
        for record in _records(folder):
            key = dataclasses.replace(record.config, seed=0)
            name_before, records = groups.setdefault(key, (name, []))
            if record.config.seed not in {each.config.seed for each in records}:
                records.append(record)
            if len(records) > 1 and not is_seeds(folder):
                groups[key] = re.sub(r"-?seed\d+(-\d+)?$", "", name_before) or name_before, records
    return list(groups.values())


def _records(folder: Path) -> Iterator[Record]:
    if not is_seeds(folder):
        yield read_record(folder)
        return
    found = False
    for each in seeds_of(folder):
        try:
            record = read_record(each)
        except RunError:
            continue  # Not begun yet, or just so.
        found = True
        yield record
    if not found:
        raise RunError(
            f"no episode of a seed in '{folder}' is finished; go on with "
            f"`mjcartpole train --resume {folder}`"
        )


def curves_of(
    groups: Sequence[Group], *, window: int | None = None, average: Average | None = None
) -> Curves:
    """Return the learning curves of runs by name; several under one name are seeds of one config.

    The window is the episodes of the running mean, a fortieth of the longest run if left out; many
    seeds are drawn as an average, the mean if left out, beside its 95 % bootstrap interval.

    Raises:
        ConfigError: The window is no whole number from 1 up, or there is nothing to average.
    """
    if average and all(len(records) == 1 for _, records in groups):
        raise ConfigError(
            f"{average} is an average over seeds, and each run here is a line of one; "
            "leave it out, or give runs that differ by their seed alone"
        )
    average = average or "mean"
    longest = max(len(each.columns.totals) for _, records in groups for each in records)
    window = usual_window(longest) if window is None else window
    if window < 1:
        raise ConfigError(f"window must be a whole number of episodes from 1 up, not {window}")
    rules = {each.config.rules for _, records in groups for each in records[:1]}
    task = rules.pop() if len(rules) == 1 else None
    return Curves(
        [_line(name, records, window, average) for name, records in groups],
        window,
        task.return_span if task else (None, None),
        task.reward_threshold if task else None,
        {"mean": "mean", "iqm": "interquartile mean"}[average],
    )


def _line(name: str, records: Sequence[Record], window: int, average: Average) -> Line:
    returns = [record.columns.totals for record in records]
    greedy = [record.greedy for record in records]
    if len(returns) == 1:
        return line_of_run(name, returns[0], min(window, len(returns[0])), greedy[0])
    return line_of_seeds(name, returns, window, average, _mean_of(greedy))


def line_of_seeds(
    name: str,
    returns: Sequence[npt.NDArray[np.float64]],
    window: int,
    average: Average = "mean",
    greedy: Sequence[tuple[int, float]] = (),
) -> Line:
    """Return the curve of one seed or many; where some are over, that of those that are not.

    The running mean of their returns is over so many episodes; it is averaged as in `curves_of`.
    `greedy` has training episodes before greedy evaluations, and their mean over the seeds.
    """
    lengths = np.array([len(each) for each in returns])
    window = min(window, int(lengths.max()))
    at = places(int(lengths.max()), window)
    means = [running_mean(each, window) if len(each) >= window else each for each in returns]
    middle, low, high = (np.empty(len(at)) for _ in range(3))
    seeds = (lengths >= at[:, None]).sum(axis=1)
    for count in np.unique(seeds):
        here = seeds == count
        alive = lengths >= at[here][-1]
        rows = [mean[at[here] - window] for mean, is_in in zip(means, alive, strict=True) if is_in]
        middle[here], low[here], high[here] = bootstrap_band(rows, average)
    return Line(name, at, middle, seeds, (low, high), None, greedy_points(greedy))


def _mean_of(greedy: Sequence[Sequence[tuple[int, float]]]) -> list[tuple[int, float]]:
    """Return the mean over the seeds that were evaluated after so many episodes."""
    found: dict[int, list[float]] = {}
    for each in greedy:
        for episode, mean in each:
            found.setdefault(episode, []).append(mean)
    return [(episode, float(np.mean(found[episode]))) for episode in sorted(found)]
