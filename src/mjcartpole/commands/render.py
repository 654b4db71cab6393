"""What `render` does and prints."""

import contextlib
import re
from collections.abc import Generator, Mapping, Sequence
from pathlib import Path
from typing import Any

from PIL import Image
from rich.console import Console
from rich.progress import Progress

from mjcartpole.commands.evaluate import VIDEOS, EvalTarget, counted, median_seed, set_up
from mjcartpole.errors import FileError, RenderError, RunError
from mjcartpole.files import atomic_write, check_free, check_writable, free_path
from mjcartpole.learning import runs
from mjcartpole.learning.documents import read_summary
from mjcartpole.learning.naming import shortened
from mjcartpole.learning.training import TrainResult
from mjcartpole.media.encoders import find_ffmpeg
from mjcartpole.media.video import check_path, write_video
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.signals import Interrupted, StopSignals
from mjcartpole.studies import multi_seed_runs
from mjcartpole.studies.evaluation import check_count
from mjcartpole.studies.film import Film, Frame, PolicySetup, Rollout, VideoOptions, play

SHEET_FRAMES = 10
"""Pictures on a contact sheet."""
_INSTEAD = {".mp4": (".gif",)}
"""What may be written in an mp4's place (see `write_video`)."""
MOST_NAME = 216
"""Bytes of a video's name; that of a file may have 255."""
MOST_NAMES = 3
"""Runs that a video's file is named after; of more, the first one stands for all."""


def run_render(
    sources: Sequence[Path],
    choice: EvalTarget,
    look: VideoOptions,
    *,
    episodes: int,
    output: Path | None,
    sheet: bool,
    overwrite: bool = False,
) -> int:
    """Film greedy episodes of one run, or of several side by side. Returns the exit code.

    Args:
        sources: Run folders or policy files.
        choice: Where they are played.
        look: How it looks.
        episodes: How many of each.
        output: The file or folder; None: a name in videos/ that is not there yet.
        sheet: Draw a contact sheet instead.
        overwrite: Replace what is there.

    Raises:
        MjCartPoleError: Something cannot be used; nothing has been played then.
    """
    signals = StopSignals()
    with signals.caught():
        setups = [set_up(_shown(source), choice) for source in sources]
        path = output or _default_path(setups, ".png" if sheet else ".mp4", overwrite)
        for setup in setups:
            look.check(setup.cartpole)
            check_count(episodes, setup.seed)
        if sheet:
            _check_sheet(setups, episodes, path)
        _check_output(path, ".png" if sheet else check_path(path), overwrite)
        casts = [play(setup, episodes) for setup in setups]
        (_write_sheet if sheet else film)(casts, look, path, signals)
    return 0


def _shown(source: Path) -> Path:
    """What is filmed of a source: of many seeds, the one in the middle, which is told."""
    if not multi_seed_runs.is_seeds(source):
        return source
    folder, count = median_seed(source)
    print(f"{folder}  (the median of {counted(count, 'seed')} by mean greedy return)", flush=True)
    return folder


def _default_path(setups: Sequence[PolicySetup], suffix: str, overwrite: bool) -> Path:
    path = VIDEOS / f"{_name(setups)}{suffix}"
    return path if overwrite else free_path(path, _INSTEAD.get(suffix, ()))


def _name(setups: Sequence[PolicySetup]) -> str:
    """A file's name for stages: all of them, unless it would become too long."""
    names = [setup.name for setup in setups]
    if len(names) > MOST_NAMES:
        names[1:] = [f"{len(names) - 1}-others"]
    return "-beside-".join(shortened(name, MOST_NAME // len(names)) for name in names)


def film_result(
    result: TrainResult,
    cartpole: CartPole,
    folder: Path,
    summary: dict[str, Any],
    signals: StopSignals,
) -> None:
    """Film the first evaluation episode of a run into videos/, and name it in the summary.

    Args:
        result: What was learned.
        cartpole: The model that it was learned on.
        folder: The run folder.
        summary: Its summary; one that names a film was written before a kill.
        signals: See `film`.

    Raises:
        Interrupted: See `film`.
    """
    config, name = result.config, folder.resolve().name
    setup = PolicySetup(
        name=name,
        policy=result.policy,
        backend=config.backend,
        model=cartpole if config.backend == "mujoco" else "cartpole",
        integrator=config.integrator,
        task=config.rules,
    )
    path = _own_film(folder, summary) or _default_path([setup], ".mp4", overwrite=False)
    # Named before it is drawn: resumed after a kill, the training takes no second name.
    summary["video"] = str(path)
    runs.write_summary(folder, summary)
    written = film([play(setup)], VideoOptions(), path, signals)
    if written != path:
        summary["video"] = str(written)
        runs.write_summary(folder, summary)


def remove_film(folder: Path) -> None:
    """Remove the film of a run that is about to be replaced, if it is where training puts it."""
    with contextlib.suppress(RunError):
        path = _own_film(folder, read_summary(folder))
        if path is not None:
            path.unlink(missing_ok=True)


def _own_film(folder: Path, summary: Mapping[str, Any]) -> Path | None:
    """The film that a run's summary names, if a training of that folder may have written it."""
    film, name = Path(str(summary.get("video", ""))), shortened(folder.resolve().name, MOST_NAME)
    own = re.fullmatch(re.escape(name) + r"(-\d+)?\.(mp4|gif)", film.name)
    return film if own and film.parent == VIDEOS else None


def film(
    casts: Sequence[Sequence[Rollout]],
    look: VideoOptions,
    path: Path,
    signals: StopSignals | None = None,
) -> Path:
    """Draw takes and write them as a video; print what came out, and return where it is.

    Args:
        casts: See `Film`.
        look: How it looks.
        path: The video.
        signals: Where a signal that shall end it is noted.

    Raises:
        Interrupted: A signal came; nothing was written.
    """
    signals = signals or StopSignals()
    # Noted, and looked at between frames: raised in the midst of OpenGL or of what Python cleans
    # up, an interrupt would be lost.
    with signals.deferred(), Film(casts, look) as drawn:
        with contextlib.closing(_with_progress(drawn, signals)) as frames:
            video = write_video(path, frames, fps=look.fps)
        seconds = video.frames / video.fps
        print(
            f"video  {video.path}  ({_what_happened(casts)}; {seconds:.1f} s, "
            f"{video.width}x{video.height}, drawn by {drawn.drawn_by})"
        )
    return video.path


def _with_progress(drawn: Film, signals: StopSignals) -> Generator[Frame]:
    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        for frame in bar.track(drawn.frames(), total=drawn.length, description="filming"):
            _raise_noted(signals)
            yield frame


def _raise_noted(signals: StopSignals) -> None:
    if signals.stop():
        raise Interrupted(number=signals.number)


def _what_happened(casts: Sequence[Sequence[Rollout]]) -> str:
    takes = [take for takes in casts for take in takes]
    if len(takes) == 1:
        return f"{counted(takes[0].episode.steps, 'step')}, {takes[0].episode.ending}"
    steps = [take.episode.steps for take in takes]
    return f"{len(takes)} episodes of {min(steps)} to {max(steps)} steps"


def _check_output(path: Path, suffix: str, overwrite: bool) -> None:
    """Refuse a place that is taken or where nothing can be written, before anything is played."""
    if suffix and path.is_dir():
        raise FileError(f"cannot write '{path}': it is a folder; give the path of a file")
    instead = [path.with_suffix(other) for other in _INSTEAD.get(suffix, ()) if not find_ffmpeg()]
    if not overwrite:
        check_free([path, *instead])
    check_writable(path.parent)


def _check_sheet(setups: Sequence[PolicySetup], episodes: int, path: Path) -> None:
    if len(setups) > 1:
        raise RenderError(f"a contact sheet shows one run, not {len(setups)}; leave out --sheet")
    if episodes > 1:
        raise RenderError(f"a contact sheet shows one episode, not {episodes}; leave out --sheet")
    if path.suffix.lower() != ".png":
        raise RenderError(f"a contact sheet is a .png, not '{path}'")


def _write_sheet(
    casts: Sequence[Sequence[Rollout]], look: VideoOptions, path: Path, signals: StopSignals
) -> None:
    with signals.deferred(), Film(casts, look) as drawn:
        picture = drawn.contact_sheet(SHEET_FRAMES)
        _raise_noted(signals)
        with atomic_write(path) as temporary:
            Image.fromarray(picture).save(temporary)
        height, width = picture.shape[:2]
        print(
            f"sheet  {path}  ({_what_happened(casts)}; {width}x{height}, drawn by {drawn.drawn_by})"
        )
