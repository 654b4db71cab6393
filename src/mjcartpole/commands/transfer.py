"""What `mjcartpole transfer` does and prints."""

import csv
import io
import json
import re
import sys
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mjcartpole.commands.evaluate import EvalTarget, learned_seeds, set_up
from mjcartpole.errors import ConfigError
from mjcartpole.files import (
    check_free,
    check_writable,
    free_path,
    make_folder,
    write_whole,
)
from mjcartpole.integrator import Integrator
from mjcartpole.learning import runs
from mjcartpole.learning.policy import Policy
from mjcartpole.media import plots
from mjcartpole.physics.load import Edits, model_names
from mjcartpole.physics.simulation import silence_mujoco
from mjcartpole.studies import multi_seed_runs
from mjcartpole.studies.evaluation import EPISODES, SEED
from mjcartpole.studies.plots import curves, heat_map
from mjcartpole.studies.sweep import SweepResult, parse_sweep, sweep
from mjcartpole.studies.transfer import GYM, Cell, TransferResult, find_place, transfer

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TRANSFER = Path("transfer")
"""Where the files go, unless told otherwise."""

SUFFIXES = (".csv", ".json", ".png")

FAILED = 2


def run_transfer(
    sources: Sequence[Path],
    *,
    models: Sequence[str] = (),
    edits: Edits = None,
    swept: str | None = None,
    integrator: Integrator = "gym",
    own_timestep: bool = False,
    episodes: int = EPISODES,
    seed: int = SEED,
    workers: int | None = None,
    output: Path | None = None,
    overwrite: bool = False,
    allow_assets: tuple[Path, ...] = (),
) -> int:
    """Play policies on models they were not trained on, print and write. Returns the exit code.

    Args:
        sources: Run folders or policy files.
        models: Names or paths, and "gym"; all that come with the package and have as many poles,
            and gym, if left out.
            A sweep takes one: the first run's own if left out.
        edits: Changes in every model; see `load_model`.
        swept: A sweep, such as "pole.length=0.5:3:0.25", instead of the matrix.
        integrator: See `Simulation`.
        own_timestep: See `load_model`.
        episodes: Greedy episodes of each policy on each model.
        seed: Seeds the starting states.
        workers: How many evaluations at once; as many as there are cores if left out.
        output: Folder for the CSV, JSON and PNG; None: transfer/, with a number in their names
            where such are there.
        overwrite: Replace what is there.
        allow_assets: Other folders than a run's own in which the files of its model may lie.

    Raises:
        MjCartPoleError: Something cannot be used; nothing has been played then.
    """
    silence_mujoco()
    choice = EvalTarget(allow_assets=allow_assets)
    policies = _find_policies(sources, choice)
    physics: dict[str, Any] = {"integrator": integrator, "own_timestep": own_timestep}
    settings: dict[str, Any] = {"episodes": episodes, "seed": seed, "workers": workers}
    if swept is None:
        chosen = dict.fromkeys(models or _fitting(policies))
        if set(chosen) == {GYM} and (edits or own_timestep):
            raise ConfigError(
                "gym is gymnasium's own cart-pole: --set and --own-timestep change nothing there"
            )
        places = [find_place(model, edits, **physics) for model in chosen]
        target = _target(output, "transfer", overwrite)
        matrix = transfer(policies, places, **settings)
        _print_matrix(matrix)
        _say_seeds(policies)
        rows = [cell.summary() for cell in matrix.cells]
        _write(target, rows, matrix.summary(), lambda: heat_map(matrix))
        return _tell_failed(matrix)
    key, values = parse_sweep(swept)
    if len(models) > 1:
        raise ConfigError(f"a sweep edits one model, not {len(models)}; give one, or no --sweep")
    first = sources[0]
    if multi_seed_runs.is_seeds(first):
        first = next(iter(learned_seeds(first).values()))
    model = models[0] if models else set_up(first, choice).model
    target = _target(output, "sweep-" + re.sub(r"[^\w.-]+", "-", key), overwrite)
    curve = sweep(policies, model, key, values, edits=edits, **physics, **settings)
    _print_sweep(curve)
    _say_seeds(policies)
    summary = curve.summary()
    _write(target, summary["points"], summary, lambda: curves(curve))
    return _tell_failed(curve.played)


def _fitting(policies: Mapping[str, Sequence[Policy]]) -> list[str]:
    """All models that there are, and gym, but for those that no policy is for."""
    poles = {policy.poles for group in policies.values() for policy in group}
    return [name for name in (GYM, *model_names()) if find_place(name).poles in poles]


def _target(output: Path | None, name: str, overwrite: bool) -> Path:
    """Where the table goes; the JSON and the picture beside it."""
    table = (output or TRANSFER) / f"{name}{SUFFIXES[0]}"
    if not overwrite and output is None:
        table = free_path(table, SUFFIXES)
    elif not overwrite:
        check_free([table.with_suffix(suffix) for suffix in SUFFIXES])
    check_writable(make_folder(table.parent))
    return table


def _find_policies(sources: Sequence[Path], choice: EvalTarget) -> dict[str, tuple[Policy, ...]]:
    """Policies by name, of many seeds all under one; those of one name are called by paths."""
    if not sources:
        raise ConfigError("transfer needs a RUN-OR-POLICY, or several")
    found = {source: _members(source, choice) for source in sources}
    count = Counter(name for name, _ in found.values())
    return {
        name if count[name] == 1 else str(source): policies
        for source, (name, policies) in found.items()
    }


def _members(source: Path, choice: EvalTarget) -> tuple[str, tuple[Policy, ...]]:
    if multi_seed_runs.is_seeds(source):
        learned = learned_seeds(source).values()
        return source.resolve().name, tuple(runs.load_run(run).policy for run in learned)
    setup = set_up(source, choice)
    return setup.name, (setup.policy,)


def _say_seeds(policies: Mapping[str, Sequence[Policy]]) -> None:
    for name, group in policies.items():
        if len(group) > 1:
            print(f"{name}: the mean over {len(group)} seeds, and its interval over seeds")


def _print_matrix(result: TransferResult) -> None:
    """One line per model, one column per policy."""
    print(f"mean greedy return and 95 % interval, seed {result.seed}\n")
    names = [_short(name) for name in result.policies]
    wide = max(20, *(len(name) + 2 for name in names))
    first = max(len(name) for name in result.places)
    print(" " * first + "".join(f"{name:>{wide}}" for name in names))
    for column, place in enumerate(result.places):
        print(f"{place:{first}}" + "".join(f"{_cell(row[column]):>{wide}}" for row in result.rows))


def _print_sweep(result: SweepResult) -> None:
    print(f"mean greedy return on {result.model}, seed {result.played.seed}\n")
    names = [_short(name) for name in result.played.policies]
    wide = max(20, *(len(name) + 2 for name in names))
    first = max(10, len(result.key))
    print(f"{result.key:>{first}}" + "".join(f"{name:>{wide}}" for name in names))
    for column, value in enumerate(result.values):
        cells = (row[column] for row in result.played.rows)
        print(f"{value:{first}g}" + "".join(f"{_cell(cell):>{wide}}" for cell in cells))
    if result.threshold is None:
        return
    print()
    for name in result.played.policies:
        stretch = result.longest(name)
        where = f"at {result.key} from {stretch}" if stretch else "nowhere in this sweep"
        print(f"{name}: the mean return is at least {result.threshold:g} {where}")


def _cell(cell: Cell) -> str:
    if cell.interval is None:
        return "failed"
    return f"{cell.mean:.1f} ({cell.interval.low:.0f}-{cell.interval.high:.0f})"


def _short(name: str, most: int = 30) -> str:
    return name if len(name) <= most else f"…{name[1 - most :]}"


def _write(
    table: Path,
    rows: Sequence[Mapping[str, Any]],
    summary: Mapping[str, Any],
    plot: Callable[[], "Figure"],
) -> None:
    _, as_json, drawn = (table.with_suffix(suffix) for suffix in SUFFIXES)
    write_whole(table, _csv(rows))
    text = json.dumps(summary, indent=2, allow_nan=False)
    write_whole(as_json, text + "\n")
    if plots.is_installed():
        plots.write_plot(plot(), drawn)
        print(f"\nwritten {table}, {as_json.suffix} and {drawn.suffix}")
        return
    print(f"\nwritten {table} and {as_json.suffix}")
    print(f"mjcartpole: no {drawn.suffix}: {plots.MISSING_LIBRARY}", file=sys.stderr)


def _csv(rows: Sequence[Mapping[str, Any]]) -> str:
    columns = list(dict.fromkeys(key for row in rows for key in row))
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _tell_failed(result: TransferResult) -> int:
    for cell in result.failed:
        message = f"{cell.policy} on {cell.place} failed: {cell.error}"
        print(f"mjcartpole: error: {message}", file=sys.stderr)
    return FAILED if result.failed else 0
