"""What a training leaves on disk.

runs/<name>/
model.xml       the model as it was, whole: it compiles to the same model anywhere
asset-*         the meshes, textures and other files that it names, called by their content
versions.json   Python, the platform and the packages
config.json     the preset's name and the full config; with it a training can be continued
checkpoint.bin  while it lasts: its state (see checkpoints.py)
episodes.csv    one line per training episode
evaluations.csv where they were asked for: one line per greedy evaluation in between
policy.json     the greedy policy (see policy.py)
visits.csv      how often each action was taken in each state
curve.png       the learning curve, where matplotlib is installed
timing.json     how long it took: the one file that differs between equal runs
summary.json    what came out
"""

import contextlib
import fnmatch
import json
import os
import platform
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from mjcartpole.errors import RunError
from mjcartpole.files import is_file, is_folder, is_temporary, names_in, remove, write_whole
from mjcartpole.learning.checkpoints import FORMER, LATEST, Checkpoint, load_checkpoint
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.documents import CONFIG, SUMMARY, read_config, read_figures
from mjcartpole.learning.folders import LOCK, held_folder, locked_folder
from mjcartpole.learning.policy import Policy
from mjcartpole.learning.run_model import (
    MODEL,
    read_document,
    read_model,
    remove_assets,
    stored_model,
    write_model,
)
from mjcartpole.learning.training import TrainResult
from mjcartpole.physics.assets import is_stored
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.load import load_stored
from mjcartpole.versions import version_of

VERSIONS: Final = "versions.json"
EPISODES, POLICY, VISITS, TIMING = "episodes.csv", "policy.json", "visits.csv", "timing.json"
BEGINNING: Final = (VERSIONS, MODEL, CONFIG)
"""In the order of writing: what a kill leaves of them is known by the versions."""
RESULTS: Final = (EPISODES, POLICY, VISITS, TIMING, SUMMARY)
FILES: Final = (*BEGINNING, *RESULTS)
EVALUATIONS: Final = "evaluations.csv"
CURVE: Final = "curve.png"
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

        The files that it names lie in the run's folder, or in `allow_assets`. For `own_timestep`
        see `load_model`; a run that was trained so has it anyway.

        Raises:
            ModelError: It cannot be used, or names a file elsewhere.
        """
        return load_stored(
            read_document(self.folder),
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
    """Hold a folder for a new run, before the work begins; one that holds a run needs `overwrite`.

    If the work fails before there is anything to go on from, what `begin_run` wrote goes again.

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
            if not before and not {LATEST, FORMER, *RESULTS} & content_of(folder):
                _remove(folder, reversed(BEGINNING))
                remove_assets(folder)


def begin_run(
    folder: Path, config: TrainConfig, cartpole: CartPole, *, preset: str, video: bool = False
) -> None:
    """Write what a training begins from; an older run's files go.

    Raises:
        FileError: The folder cannot be written.
    """
    _remove_files(folder, keep=cartpole.stored[1])
    write_versions(folder)
    write_model(folder, cartpole)
    about = {"preset": preset, "video": video, **config.stored()}
    write_whole(folder / CONFIG, _json(about))


def write_results(folder: Path, result: TrainResult, summary: dict[str, Any]) -> None:
    """Write what a training, or the part of it that was done, has come to.

    Raises:
        FileError: The folder cannot be written.
    """
    write_whole(folder / EPISODES, result.episodes.csv(result.config.episode.replace(" ", "_")))
    result.policy.save(folder / POLICY)
    if result.visits is not None:
        lines = [f"{left},{right}\n" for left, right in result.visits.reshape(-1, 2).tolist()]
        write_whole(folder / VISITS, "".join(["left,right\n", *lines]))
    timing = {"training_seconds": round(result.seconds, 3), "steps": result.steps}
    if result.solved is not None:
        timing["seconds_to_solve"] = round(result.solved.seconds, 3)
    write_whole(folder / TIMING, _json(timing))
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


def finish_run(folder: Path) -> None:
    """Drop the checkpoints of a run that is complete."""
    _remove(folder, (FORMER, LATEST))


def remove_run(folder: Path) -> None:
    """Remove the files of a run, and its folder if nothing else is in it.

    Raises:
        RunError: A training is at work in it.
    """
    if not is_folder(folder, follow=False):
        return
    with locked_folder(folder):
        _remove_files(folder)
    with contextlib.suppress(OSError):
        folder.rmdir()  # Only an empty one goes.


def is_complete(folder: Path) -> bool:
    """Whether a folder holds a run to which nothing is left to do."""
    content = content_of(folder)
    return {CONFIG, SUMMARY} <= content and not content & {LATEST, FORMER}


def has_events(folder: Path) -> bool:
    """Whether TensorBoard events were written for a run."""
    return bool(fnmatch.filter(names_in(folder), EVENTS))


def check_complete(folder: Path, allow_assets: Sequence[Path] = ()) -> Run:
    """Read all of a run that is complete, and clear what a kill at its very end has left.

    Raises:
        RunError: It is damaged, or another training is at work in it.
        ModelError: Its model was damaged, or names a file elsewhere.
    """
    with locked_folder(folder):
        run = load_run(folder)
        read_model(folder, run.config, allow_assets)
        read_figures(folder, run.config)
        return run


def load_run(folder: str | os.PathLike[str]) -> Run:
    """Read a run folder.

    Raises:
        RunError: It is not there, or lacks a file, or its config cannot be read.
        PolicyFileError: Its policy is damaged.
    """
    path = Path(folder)
    if not is_folder(path):
        raise RunError(f"no run folder or policy file '{path}'; `mjcartpole train` makes a run")
    content = content_of(path)
    missing = [name for name in (CONFIG, MODEL, POLICY) if name not in content]
    if missing:
        hint = f"; go on with `mjcartpole train --resume {path}`" if CONFIG not in missing else ""
        raise RunError(f"'{path}' is no complete run folder: {', '.join(missing)} missing{hint}")
    policy = Policy.load(path / POLICY, follow=False)
    preset, _, config = read_config(path)
    read_document(path)
    return Run(path, preset, config, policy)


@contextlib.contextmanager
def resumed_folder(path: Path, allow_assets: Sequence[Path] = ()) -> Iterator[Begun]:
    """Hold the folder of a run that is to be continued.

    The path is a run folder, for its own checkpoint, or another checkpoint in it. The files of its
    model lie there, or in `allow_assets`.

    Raises:
        RunError: There is no training to be continued, or another one is at work.
        CheckpointError: The checkpoint is damaged or of another training.
        ModelError: The model was damaged.
    """
    folder = run_folder(path)
    content = content_of(folder)
    if CONFIG not in content:
        raise RunError(
            f"'{folder}' holds no training that could be continued; start one with "
            f"`mjcartpole train --run-dir {folder}`"
        )
    _check_files(folder, content)
    with locked_folder(folder):
        yield _load_begun(folder, path, allow_assets)


def _load_begun(folder: Path, path: Path, allow_assets: Sequence[Path]) -> Begun:
    preset, video, config = read_config(folder)
    document = read_document(folder)
    cartpole = stored_model(document, config, folder, allow_assets)
    checkpoint = None
    if path != folder or LATEST in content_of(folder):
        file = path if path != folder else folder / LATEST
        checkpoint = load_checkpoint(file, config, document, poles=cartpole.poles)
    return Begun(folder, preset, video, config, cartpole, checkpoint)


def run_folder(path: Path) -> Path:
    """The run folder that a folder's or a checkpoint's path stands for.

    Raises:
        RunError: There is neither.
    """
    if is_folder(path):
        return path
    if is_file(path):
        return path.parent
    raise RunError(f"no run folder or checkpoint '{path}'; `mjcartpole train` makes a run")


def versions() -> dict[str, str]:
    """Versions of all that a result may depend on."""
    found = {"python": platform.python_version(), "platform": platform.platform()}
    return found | {package: version_of(package) or "not installed" for package in PACKAGES}


def _check_free(folder: Path, overwrite: bool) -> None:
    content = content_of(folder)
    # A training that was killed in its first moment leaves no config: nothing is lost with it.
    # A model alone is somebody's own: ours lies beside the versions.
    killed = VERSIONS in content and content <= {MODEL, VERSIONS, LATEST, FORMER}
    if not content or killed:
        return
    _check_files(folder, content)
    if CONFIG not in content and not content & set(RESULTS):
        raise RunError(f"'{folder}' holds other files and is no run; choose another --run-dir")
    if not overwrite:
        unfinished = f", go on with --resume {folder}" if not is_complete(folder) else ""
        raise RunError(
            f"run folder '{folder}' exists; choose another --run-dir{unfinished}, or replace it "
            "with --overwrite"
        )


def _check_files(folder: Path, content: set[str]) -> None:
    """Refuse folders where a run has files, before any work is lost to them."""
    for name in _own(content):
        if is_folder(folder / name, follow=False):
            raise RunError(f"'{folder / name}' is a folder where a run has a file; move it away")


def content_of(folder: Path) -> set[str]:
    """Names of what lies in a folder, without what a killed training may have left behind."""
    names = {name for name in names_in(folder) if not is_temporary(name)} - {LOCK}
    return {name for name in names if not is_stored(name)}


def _remove(folder: Path, names: Iterable[str]) -> None:
    for name in names:
        remove(folder / name)


def _own(content: set[str]) -> list[str]:
    """Names of a run's files, those of `content` among them, in the order of their removal."""
    # The config first: without it a folder holds no run, so that two are never mixed.
    events = fnmatch.filter(content, EVENTS)
    return [CONFIG, MODEL, *events, CURVE, EVALUATIONS, *RESULTS, LATEST, FORMER, VERSIONS]


def _remove_files(folder: Path, keep: Iterable[str] = ()) -> None:
    """Remove all files of a run but for some of its model's, the config first."""
    _remove(folder, _own(names_in(folder)))
    remove_assets(folder, keep)


def _json(values: dict[str, Any]) -> str:
    return json.dumps(values, indent=2) + "\n"
