"""What a training leaves on disk.

runs/<name>/
model.xml       the model as it was, whole: it compiles to the same model anywhere
asset-*         the meshes, textures and other files that it names, called by their content
versions.json   Python, the platform and the packages
config.json     the preset's name and the full config; with it a training can be continued
checkpoint.bin  while it lasts: its state (see checkpoints.py), and checkpoint-previous.bin
episodes.csv    one line per training episode
policy.json     the greedy policy (see policy.py)
timing.json     how long it took: the one file that differs between equal runs
summary.json    what came out
"""

import contextlib
import dataclasses
import functools
import json
import os
import platform
import shutil
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from mjcartpole.errors import CheckpointError, ConfigError, ModelError, RunError
from mjcartpole.files import (
    is_temporary,
    remove_leftovers,
    replacing,
    write_whole,
)
from mjcartpole.learning.checkpoints import (
    LATEST,
    PREVIOUS,
    Checkpoint,
    keep_only,
    load_checkpoint,
)
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.folders import LOCK, held_folder, locked_folder
from mjcartpole.learning.policy import Policy
from mjcartpole.learning.training import TrainResult
from mjcartpole.physics.assets import is_stored, name_by_content
from mjcartpole.physics.model import CartPole, load_stored, same_model
from mjcartpole.physics.reading import read_text
from mjcartpole.versions import version_of

CONFIG, VERSIONS, MODEL = "config.json", "versions.json", "model.xml"
EPISODES, POLICY, SUMMARY, TIMING = "episodes.csv", "policy.json", "summary.json", "timing.json"
BEGINNING: Final = (VERSIONS, MODEL, CONFIG)
"""In the order of writing: what a kill leaves of them is known by the versions."""
RESULTS: Final = (EPISODES, POLICY, TIMING, SUMMARY)
FILES: Final = (*BEGINNING, *RESULTS)
EVENTS: Final = "events.out.tfevents.*"
"""TensorBoard's (see tensorboard.py)."""

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

    def cartpole(
        self, allow_assets: Sequence[Path] = (), *, own_timestep: bool = False
    ) -> CartPole:
        """Load the model as it was in training.

        Args:
            allow_assets: Other folders than the run's in which the files that it names may lie.
            own_timestep: See `load_model`; as a run that was trained so.

        Raises:
            ModelError: It cannot be used, or names a file elsewhere.
        """
        return load_stored(
            read_text(self.model),
            str(self.model),
            self.folder,
            allow_assets,
            own_timestep=own_timestep or self.config.own_timestep,
        )


@dataclass(frozen=True)
class Begun:
    """A run whose training is not over, or whose results are not all written.

    Attributes:
        folder: Where it lies.
        preset: Name of the preset that the config began from.
        video: Whether a video belongs to it.
        config: The full config.
        cartpole: The model as it was when the training began.
        checkpoint: Where to go on; None: at the beginning.
    """

    folder: Path
    preset: str
    video: bool
    config: TrainConfig
    cartpole: CartPole
    checkpoint: Checkpoint | None


@contextlib.contextmanager
def claimed_folder(folder: Path, *, overwrite: bool = False) -> Iterator[None]:
    """Hold a folder for a new run, before the work begins.

    If the work fails before there is anything to go on from, what `begin_run` wrote goes again.

    Args:
        folder: The run folder. An empty one is taken; one that holds a run needs `overwrite`.
        overwrite: Whether a run that is there may be replaced.

    Raises:
        RunError: Something is there that may not be replaced, or another training is at work.
        FileError: The folder cannot be made or written.
    """
    _check_free(folder, overwrite)
    with held_folder(folder):
        _check_free(folder, overwrite)
        before = content_of(folder)
        try:
            yield
        finally:
            if not before and not {LATEST, PREVIOUS, *RESULTS} & content_of(folder):
                _remove(folder, reversed(BEGINNING))
                remove_assets(folder)


def check_storable(cartpole: CartPole) -> None:
    """Refuse a model that is another one when it is read back from what a run stores.

    Raises:
        ModelError: It is, or a file that it needs cannot be read.
    """
    with tempfile.TemporaryDirectory() as temporary:
        write_model(Path(temporary), cartpole)
        again = load_stored(cartpole.stored[0], cartpole.name, Path(temporary), own_timestep=True)
    if not same_model(again.model, cartpole.model):
        raise ModelError(
            f"{cartpole.name} compiles to another model when its document stands alone; "
            "make it one self-contained file"
        )


def begin_run(
    folder: Path, config: TrainConfig, cartpole: CartPole, *, preset: str, video: bool = False
) -> None:
    """Write what a training begins from; an older run's files go.

    Raises:
        FileError: The folder cannot be written.
    """
    # The config first: without it a folder holds no run, so that two are never mixed.
    _remove_files(folder, keep=cartpole.stored[1])
    write_versions(folder)
    write_model(folder, cartpole)
    about = {"preset": preset, "video": video, **dataclasses.asdict(config)}
    write_whole(folder / CONFIG, _json(about))


def write_model(folder: Path, cartpole: CartPole) -> None:
    """Write a model's document, and beside it the files that it names.

    Raises:
        FileError: The folder cannot be written, or a file cannot be read.
        ModelError: A file cannot be read.
    """
    document, files = cartpole.stored
    for name, source in files.items():
        if isinstance(source, str):
            write_whole(folder / name, source)
        elif not _has(folder / name):
            with replacing(folder / name) as temporary:
                shutil.copyfile(source, temporary)
    write_whole(folder / MODEL, document)


def _has(asset: Path) -> bool:
    """Whether a file is there whole; a model may have been loaded from this very folder."""
    return asset.is_file() and not asset.is_symlink() and name_by_content(asset) == asset.name


def remove_assets(folder: Path, keep: Iterable[str] = ()) -> None:
    """Remove the files that a model named, but for some."""
    names = {path.name for path in folder.glob("asset-*") if is_stored(path.name)}
    _remove(folder, names - set(keep))


def write_results(folder: Path, result: TrainResult, summary: dict[str, Any]) -> None:
    """Write what a training, or the part of it that was done, has come to.

    Raises:
        FileError: The folder cannot be written.
    """
    write_whole(folder / EPISODES, result.episodes.csv())
    result.policy.save(folder / POLICY)
    seconds = round(result.seconds, 3)
    write_whole(folder / TIMING, _json({"training_seconds": seconds, "steps": result.steps}))
    write_summary(folder, summary)


def write_versions(folder: Path) -> None:
    """Write the versions of all that a result may depend on.

    Raises:
        FileError: The folder cannot be written.
    """
    write_whole(folder / VERSIONS, _json(versions()))


def write_summary(folder: Path, summary: dict[str, Any]) -> None:
    """Write a run's summary.

    Raises:
        FileError: The folder cannot be written.
    """
    write_whole(folder / SUMMARY, _json(summary))


def read_summary(folder: Path) -> dict[str, Any]:
    """A run's summary.

    Raises:
        RunError: It is not there or damaged.
    """
    try:
        summary: dict[str, Any] = json.loads((folder / SUMMARY).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise RunError(f"'{folder / SUMMARY}' cannot be read: {error}") from error
    return summary


def finish_run(folder: Path) -> None:
    """Drop the checkpoints of a run that is complete."""
    _remove(folder, (PREVIOUS, LATEST))


def remove_run(folder: Path) -> None:
    """Remove the files of a run, and its folder if nothing else is in it.

    Raises:
        RunError: A training is at work in it.
    """
    if not folder.is_dir():
        return
    with locked_folder(folder):
        _remove_files(folder)
        remove_leftovers(folder)
    with contextlib.suppress(OSError):
        folder.rmdir()  # Only an empty one goes.


def is_complete(folder: Path) -> bool:
    """Whether a folder holds a run to which nothing is left to do."""
    content = content_of(folder)
    return {CONFIG, SUMMARY} <= content and not content & {LATEST, PREVIOUS}


def has_events(folder: Path) -> bool:
    """Whether TensorBoard events were written for a run."""
    return any(folder.glob(EVENTS))


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
        hint = f"; go on with `mjcartpole train --resume {path}`" if CONFIG not in missing else ""
        raise RunError(f"'{path}' is no complete run folder: {', '.join(missing)} missing{hint}")
    policy = Policy.load(path / POLICY)
    preset, _, config = _read_config(path / CONFIG)
    return Run(path, preset, config, policy)


@contextlib.contextmanager
def resumed_folder(path: Path, allow_assets: Sequence[Path] = ()) -> Iterator[Begun]:
    """Hold the folder of a run that is to be continued.

    Args:
        path: A run folder, for its latest checkpoint, or one checkpoint in it.
        allow_assets: Other folders in which the files of its model may lie.

    Raises:
        RunError: There is no training to be continued, or another one is at work.
        CheckpointError: The checkpoint is damaged or of another training; the message offers the
            previous one, if that is good.
        ModelError: The model was damaged.
    """
    folder = run_folder(path)
    with locked_folder(folder):
        remove_leftovers(folder)
        begun = _load_begun(folder, path, allow_assets)
        if begun.checkpoint is not None:
            # The one that was chosen is now the latest, and a damaged one takes no place again.
            keep_only(folder, path if path.is_file() else folder / LATEST)
        yield begun


def stored_model(
    document: str, config: TrainConfig, folder: Path, allow_assets: Sequence[Path] = ()
) -> CartPole:
    """The model of a run from the document that it stores, under the name that was trained on.

    Args:
        document: The document.
        config: The run's.
        folder: The run's.
        allow_assets: Other folders in which the files that it names may lie.

    Raises:
        ModelError: The document was damaged, or names a file elsewhere.
    """
    cartpole = load_stored(
        document,
        f"'{folder / MODEL}'",
        folder,
        allow_assets,
        own_timestep=config.own_timestep,
    )
    return dataclasses.replace(cartpole, name=config.model)


def _load_begun(folder: Path, path: Path, allow_assets: Sequence[Path]) -> Begun:
    if not (folder / CONFIG).is_file():
        raise RunError(
            f"'{folder}' holds no training that could be continued; start one with "
            f"`mjcartpole train --run-dir {folder}`"
        )
    preset, video, config = _read_config(folder / CONFIG)
    try:
        document = (folder / MODEL).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise RunError(f"'{folder / MODEL}' cannot be read: {error}") from error
    cartpole = stored_model(document, config, folder, allow_assets)
    checkpoint = _checkpoint(folder, path, config, document, cartpole.poles)
    return Begun(folder, preset, video, config, cartpole, checkpoint)


def run_folder(path: Path) -> Path:
    """The run folder that a folder's or a checkpoint's path stands for.

    Raises:
        RunError: There is neither.
    """
    if path.is_dir():
        return path
    if path.is_file():
        return path.parent
    raise RunError(f"no run folder or checkpoint '{path}'; `mjcartpole train` makes a run")


def versions() -> dict[str, str]:
    """Versions of all that a result may depend on."""
    found = {"python": platform.python_version(), "platform": platform.platform()}
    return found | {package: version_of(package) or "not installed" for package in PACKAGES}


def _checkpoint(
    folder: Path, path: Path, config: TrainConfig, document: str, poles: int
) -> Checkpoint | None:
    latest, previous = folder / LATEST, folder / PREVIOUS
    load = functools.partial(load_checkpoint, config=config, document=document, poles=poles)
    if path.is_file():
        return load(path)
    if not latest.exists():
        # Nothing was saved yet, or it was killed between two moves (see save_checkpoint).
        return load(previous) if previous.exists() else None
    try:
        return load(latest)
    except CheckpointError as error:
        try:
            older = load(previous)
        except CheckpointError:
            hint = "there is no good one before it; start again with --overwrite"
        else:
            hint = (
                f"the one before it, after {older.episodes:,} episodes, is good: "
                f"mjcartpole train --resume {previous}"
            )
        raise CheckpointError(f"{error}; {hint}") from error


def _check_free(folder: Path, overwrite: bool) -> None:
    content = content_of(folder)
    # A training that was killed in its first moment leaves no config: nothing is lost with it.
    # A model alone is somebody's own: ours lies beside the versions.
    killed = VERSIONS in content and content <= {MODEL, VERSIONS, LATEST, PREVIOUS}
    if not content or killed:
        return
    if CONFIG not in content and not content & set(RESULTS):
        raise RunError(f"'{folder}' holds other files and is no run; choose another --run-dir")
    if not overwrite:
        unfinished = f", go on with --resume {folder}" if not is_complete(folder) else ""
        raise RunError(
            f"run folder '{folder}' exists; choose another --run-dir{unfinished}, or replace it "
            "with --overwrite"
        )


def content_of(folder: Path) -> set[str]:
    """Names of what lies in a folder, without what a killed training may have left behind."""
    if not folder.is_dir():
        return set()
    names = {path.name for path in folder.iterdir()} - {LOCK}
    return {name for name in names if not is_temporary(name) and not is_stored(name)}


def _remove(folder: Path, names: Iterable[str]) -> None:
    for name in names:
        (folder / name).unlink(missing_ok=True)


def _remove_files(folder: Path, keep: Iterable[str] = ()) -> None:
    """Remove all files of a run but for some of its model's, the config first."""
    events = (path.name for path in folder.glob(EVENTS))
    _remove(folder, (CONFIG, MODEL, *events, *RESULTS, LATEST, PREVIOUS, VERSIONS))
    remove_assets(folder, keep)


def _read_config(path: Path) -> tuple[str, bool, TrainConfig]:
    """Preset, whether there is a video, and config."""
    try:
        values: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        preset, video = str(values.pop("preset")), bool(values.pop("video", False))
        lists = {key: tuple(value) for key, value in values.items() if isinstance(value, list)}
        return preset, video, TrainConfig(**{**values, **lists})
    except (OSError, ValueError, TypeError, KeyError, AttributeError, ConfigError) as error:
        raise RunError(f"'{path}' is not the config of a run, or is damaged: {error}") from error


def _json(values: dict[str, Any]) -> str:
    return json.dumps(values, indent=2) + "\n"
