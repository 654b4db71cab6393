"""What a training leaves on disk.

runs/<name>/
config.json     the preset's name and the full config
versions.json   Python, the platform and the packages
model.xml       the model as it was, whole: it compiles to the same model anywhere
episodes.csv    one line per training episode
policy.json     the greedy policy (see policy.py)
summary.json    what came out; written last, so its presence means a complete run
"""

import contextlib
import csv
import dataclasses
import io
import json
import os
import platform
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any, Final

from mjcartpole.errors import ConfigError, ModelError, RunError
from mjcartpole.files import check_writable, make_folder, write_whole
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.loop import Episode
from mjcartpole.learning.policy import Policy
from mjcartpole.learning.training import TrainResult
from mjcartpole.physics.model import CartPole, load_model, same_model

CONFIG, VERSIONS, MODEL = "config.json", "versions.json", "model.xml"
EPISODES, POLICY, SUMMARY = "episodes.csv", "policy.json", "summary.json"
FILES: Final = (CONFIG, VERSIONS, MODEL, EPISODES, POLICY, SUMMARY)

PACKAGES: Final = ("mjcartpole", "mujoco", "dm-control", "gymnasium", "numpy", "numba", "imageio")


@dataclass(frozen=True)
class Run:
    """A run folder, read back.

    Attributes:
        folder: Where it lies.
        preset: Name of the preset that the config began from.
        config: The full config.
        policy: What was learned.
    """

    folder: Path
    preset: str
    config: TrainConfig
    policy: Policy

    @property
    def model(self) -> Path:
        """The model as it was in training."""
        return self.folder / MODEL


def free_folder(parent: Path, name: str) -> Path:
    """The first of `parent/name`, `parent/name-2`, `parent/name-3` … that is not there."""
    folder, number = parent / name, 1
    while folder.exists():
        number += 1
        folder = parent / f"{name}-{number}"
    return folder


@contextlib.contextmanager
def claimed_folder(folder: Path, *, overwrite: bool = False) -> Iterator[None]:
    """Make a run folder before the work begins, so that no training is lost for want of one.

    If the work fails and has left nothing in it, the folder goes again.

    Args:
        folder: The run folder. An empty one is taken; one that holds a run needs `overwrite`.
        overwrite: Whether the files of a run that is there may be replaced. They stay until the
            new ones are written.

    Raises:
        RunError: Something is there that may not be replaced.
        FileError: The folder cannot be made or written.
    """
    if folder.is_dir():
        content = {path.name for path in folder.iterdir()}
        if content and not content & set(FILES):
            raise RunError(f"'{folder}' holds other files and is no run; choose another --run-dir")
        if content and not overwrite:
            raise RunError(
                f"run folder '{folder}' exists; choose another --run-dir, or replace it with "
                "--overwrite"
            )
    make_folder(folder)
    check_writable(folder)
    try:
        yield
    finally:
        if not any(folder.iterdir()):
            folder.rmdir()


def check_storable(cartpole: CartPole) -> None:
    """Refuse a model whose document alone does not give the same model again.

    Raises:
        ModelError: It refers to other files, such as meshes.
    """
    try:
        again = load_model(cartpole.xml)
    except ModelError as error:
        raise ModelError(
            f"{cartpole.name} needs other files beside it, and a run stores one document: {error}"
        ) from error
    if not same_model(again.model, cartpole.model):
        raise ModelError(
            f"{cartpole.name} compiles to another model when its document stands alone; "
            "make it one self-contained file"
        )


def write_run(folder: Path, result: TrainResult, cartpole: CartPole, *, preset: str) -> None:
    """Write all files of a run except its summary, each whole or not at all.

    Raises:
        FileError: The folder cannot be written.
    """
    # Without its summary a run counts as incomplete: none of these files may pass for another's.
    (folder / SUMMARY).unlink(missing_ok=True)
    config = {"preset": preset, **dataclasses.asdict(result.config)}
    write_whole(folder / CONFIG, _json(config))
    write_whole(folder / VERSIONS, _json(versions()))
    write_whole(folder / MODEL, cartpole.xml)
    write_whole(folder / EPISODES, _csv(result.episodes))
    result.policy.save(folder / POLICY)


def write_summary(folder: Path, summary: dict[str, Any]) -> None:
    """Write a run's summary.

    Raises:
        FileError: The folder cannot be written.
    """
    write_whole(folder / SUMMARY, _json(summary))


def load_run(folder: str | os.PathLike[str]) -> Run:
    """Read a run folder.

    Raises:
        RunError: It is not there, or lacks a file, or its config cannot be read.
        PolicyFileError: Its policy is damaged.
    """
    path = Path(folder)
    if not path.is_dir():
        raise RunError(f"no run folder or policy file '{path}'; `mjcartpole train` makes a run")
    missing = [name for name in (CONFIG, MODEL, POLICY) if not (path / name).is_file()]
    if missing:
        raise RunError(f"'{path}' is no complete run folder: {', '.join(missing)} missing")
    policy = Policy.load(path / POLICY)
    preset, config = _read_config(path / CONFIG)
    return Run(path, preset, config, policy)


def versions() -> dict[str, str]:
    """Versions of all that a result may depend on."""
    found = {"python": platform.python_version(), "platform": platform.platform()}
    for package in PACKAGES:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            found[package] = "not installed"
    return found


def _read_config(path: Path) -> tuple[str, TrainConfig]:
    try:
        values: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        preset = str(values.pop("preset"))
        lists = {key: tuple(value) for key, value in values.items() if isinstance(value, list)}
        return preset, TrainConfig(**{**values, **lists})
    except (OSError, ValueError, TypeError, KeyError, AttributeError, ConfigError) as error:
        raise RunError(f"'{path}' is not the config of a run, or is damaged: {error}") from error


def _json(values: dict[str, Any]) -> str:
    return json.dumps(values, indent=2) + "\n"


def _csv(episodes: tuple[Episode, ...]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["episode", "return", "steps", "ending"])
    writer.writerows(
        [episode.number + 1, episode.total, episode.steps, episode.ending] for episode in episodes
    )
    return text.getvalue()
