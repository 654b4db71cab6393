"""The folder of many seeds.

runs/<name>/
model.xml       the model as it was
seeds.json      preset, config and seeds; with it the work can be continued
seed-<n>/       a run (see learning/runs.py) for each seed, as if it were trained alone
seeds.csv       one line per seed
aggregate.json  statistics over the seeds
curve.png       their learning curve, where matplotlib is installed
"""

import contextlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from mjcartpole.errors import RunError
from mjcartpole.files import is_file, remove, write_whole
from mjcartpole.learning import runs
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.documents import read_config, read_values
from mjcartpole.learning.folders import SEEDS, check_here, held_folder, locked_folder
from mjcartpole.learning.run_model import MODEL, read_model, remove_assets, write_model
from mjcartpole.learning.stored import Fields, read_document
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.studies.seeds import ManyResult, check_seeds, seed_folder

TABLE, AGGREGATE = "seeds.csv", "aggregate.json"
FILES: Final = (SEEDS, TABLE, AGGREGATE, runs.CURVE, MODEL, runs.VERSIONS)
"""In the order of removal: without the seeds a folder holds nothing, and the versions say whose."""

_FIELDS: Final[Fields] = {"preset": str, "seeds": tuple[int, ...], "config": dict}


@dataclass(frozen=True)
class ManyBegun:
    """Many seeds that are to be continued.

    Attributes:
        preset: Name of the preset that the config began from.
        config: The config; its seed is the first.
        seeds: Which.
        cartpole: The model as it was when the work began.
    """

    preset: str
    config: TrainConfig
    seeds: tuple[int, ...]
    cartpole: CartPole


def is_seeds(path: Path) -> bool:
    """Return whether a path is a folder of many seeds."""
    return is_file(path / SEEDS)


def seeds_of(folder: Path) -> list[Path]:
    """Return the runs that a folder of many seeds names, whether they are there or not.

    Raises:
        RunError: The folder is damaged.
    """
    return [seed_folder(folder, seed) for seed in _read_seeds(folder)[2]]


def learned_seeds(folder: Path) -> tuple[dict[int, Path], list[int]]:
    """Return the runs of a folder of many seeds that have a policy, by seed, and the seeds without.

    Raises:
        RunError: There is no policy yet, or the folder is damaged.
    """
    runs_of = {seed: seed_folder(folder, seed) for seed in _read_seeds(folder)[2]}
    learned = {seed: run for seed, run in runs_of.items() if runs.POLICY in runs.content_of(run)}
    for seed, run in learned.items():
        check_here(run)
        if read_config(run)[2].seed != seed:
            raise RunError(f"'{run}' is the run of another seed; put the one of seed {seed} there")
    if not learned:
        raise RunError(
            f"no seed in '{folder}' has a policy yet; go on with "
            f"`mjcartpole train --resume {folder}`"
        )
    return learned, [seed for seed in runs_of if seed not in learned]


@contextlib.contextmanager
def claimed_seeds(folder: Path, *, overwrite: bool = False) -> Iterator[None]:
    """Hold a folder for many seeds; see `claimed_folder`.

    Raises:
        RunError: Something is there that may not be replaced, or another training is at work.
        FileError: The folder cannot be made or written.
    """
    _check_free(folder, overwrite)
    with held_folder(folder):
        _check_free(folder, overwrite)
        _clear(folder)
        yield


def begin_seeds(
    folder: Path, config: TrainConfig, seeds: tuple[int, ...], cartpole: CartPole, *, preset: str
) -> None:
    """Write what the work begins from.

    Raises:
        FileError: The folder cannot be written.
    """
    runs.write_versions(folder)
    write_model(folder, cartpole)
    about = {"preset": preset, "seeds": list(seeds), "config": config.stored()}
    write_whole(folder / SEEDS, json.dumps(about, indent=2) + "\n")


@contextlib.contextmanager
def resumed_seeds(folder: Path, allow_assets: Sequence[Path] = ()) -> Iterator[ManyBegun]:
    """Hold a folder of many seeds whose work is to be continued.

    The files of its model lie there, or in `allow_assets`.

    Raises:
        RunError: It is damaged, or another training is at work in it.
    """
    with locked_folder(folder):
        preset, config, seeds = _read_seeds(folder)
        cartpole = read_model(folder, config, allow_assets)
        yield ManyBegun(preset, config, seeds, cartpole)


def write_seeds(folder: Path, many: ManyResult) -> None:
    """Write the table of the seeds and the statistics over them.

    Raises:
        FileError: The folder cannot be written.
    """
    write_whole(folder / TABLE, _csv(many))
    aggregate = many.aggregate()
    summary = {
        "seeds": len(many.seeds),
        "failed": {str(found.seed): found.error for found in many.failed},
        "greedy_return": None if aggregate is None else aggregate.summary(),
    }
    if solving := many.solving():
        summary["episodes_to_solve"] = solving._asdict()
    write_whole(folder / AGGREGATE, json.dumps(summary, indent=2) + "\n")


def _csv(many: ManyResult) -> str:
    lines = ["seed,mean,minimum,failed"]
    for found in many.seeds:
        evaluation, failed = found.evaluation, "yes" if found.error else "no"
        figures = f"{evaluation.mean},{evaluation.minimum}" if evaluation else ","
        lines.append(f"{found.seed},{figures},{failed}")
    return "\n".join(lines) + "\n"


def _check_free(folder: Path, overwrite: bool) -> None:
    content = runs.content_of(folder)
    # Killed in its first moment: see runs.py.
    killed = runs.VERSIONS in content and SEEDS not in content and content <= set(FILES)
    if not content or killed:
        return
    if SEEDS not in content:
        raise RunError(
            f"'{folder}' holds other files than the runs of many seeds; choose another --run-dir"
        )
    if not overwrite:
        raise RunError(
            f"run folder '{folder}' exists; choose another --run-dir, go on with "
            f"--resume {folder}, or replace it with --overwrite"
        )


def _clear(folder: Path) -> None:
    """Remove the runs of all seeds that a folder names, and nothing else."""
    if SEEDS in runs.content_of(folder):
        before = seeds_of(folder)
        for each in before:
            check_here(each)
        for each in before:
            runs.remove_run(each)
    for name in FILES:
        remove(folder / name)
    remove_assets(folder)


def _read_seeds(folder: Path) -> tuple[str, TrainConfig, tuple[int, ...]]:
    """Return preset, config and seeds."""

    def made(about: dict[str, Any]) -> tuple[str, TrainConfig, tuple[int, ...]]:
        config = read_values(about["config"])
        return about["preset"], config, check_seeds(config, about["seeds"])

    otherwise = "does not name the seeds of a run, or is damaged"
    return read_document(folder / SEEDS, _FIELDS, made, otherwise)
