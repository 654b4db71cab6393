"""Films as commands make them: named, drawn with a progress bar, told of."""

import contextlib
from collections.abc import Callable, Generator, Sequence
from pathlib import Path
from typing import Any

from mjcartpole.commands.bar import Bar
from mjcartpole.commands.options import VIDEOS
from mjcartpole.commands.own_films import MOST_NAME, own_film
from mjcartpole.commands.printing import counted, with_added
from mjcartpole.files import atomic_write, free_path
from mjcartpole.learning import runs
from mjcartpole.learning.naming import shortened
from mjcartpole.learning.training import TrainResult
from mjcartpole.media.mp4 import why_no_mp4
from mjcartpole.media.pillow import Image
from mjcartpole.media.video import Video, write_video
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.signals import StopSignals
from mjcartpole.studies.film import Film, Frame, Rollout, play
from mjcartpole.studies.policy_setup import PolicySetup, where_trained
from mjcartpole.studies.video_options import VideoOptions

SHEET_FRAMES = 10
"""Pictures on a contact sheet."""
_INSTEAD = {".mp4": (".gif",)}
"""What may be written in an mp4's place (see `write_video`)."""
MOST_NAMES = 3
"""Runs that a video's file is named after; of more, the first one stands for all."""

Casts = Sequence[Sequence[Rollout]]


def default_path(setups: Sequence[PolicySetup], suffix: str, overwrite: bool = False) -> Path:
    """Return where a film goes that was given no place: one that is free, unless it overwrites."""
    names = [setup.name for setup in setups]
    if len(names) > MOST_NAMES:
        names[1:] = [f"{len(names) - 1}-others"]
    name = "-beside-".join(shortened(name, MOST_NAME // len(names)) for name in names)
    path = VIDEOS / f"{name}{suffix}"
    return path if overwrite else free_path(path, _INSTEAD.get(suffix, ()))


def instead_of(path: Path, suffix: str) -> list[Path]:
    """Return what may be written here in place of a film."""
    return [path.with_suffix(other) for other in _INSTEAD.get(suffix, ()) if why_no_mp4()]


def film(casts: Casts, look: VideoOptions, path: Path, signals: StopSignals) -> Path:
    """Draw rollouts and write them as a video; print what came out, and return where it is.

    Raises:
        Interrupted: A signal came; nothing was written.
    """
    video, drawn_by = write_film(casts, look, path, signals)
    print(
        f"video  {video.path}  ({what_happened(casts)}; {video.frames / video.fps:.1f} s, "
        f"{video.width}x{video.height}, drawn by {drawn_by})"
    )
    return video.path


def write_film(
    casts: Casts,
    look: VideoOptions,
    path: Path,
    signals: StopSignals,
    check: Callable[[], None] = lambda: None,
) -> tuple[Video, str]:
    """Draw rollouts and write them as a video; return that, and who has drawn it.

    For the casts see `Film`. A signal that shall end it is noted in `signals`; `check` is called
    before each frame, and what it raises ends it too.

    Raises:
        Interrupted: A signal came; nothing was written.
    """
    # Noted, and looked at between frames: raised in the midst of OpenGL or of what Python cleans
    # up, an interrupt would be lost.
    with (
        signals.deferred(),
        Film(casts, look) as drawn,
        contextlib.closing(_with_progress(drawn, signals, check)) as frames,
    ):
        return write_video(path, frames, fps=look.fps), drawn.drawn_by


def _with_progress(
    drawn: Film, signals: StopSignals, check: Callable[[], None]
) -> Generator[Frame]:
    with Bar(lambda: "filming", drawn.length, "frames") as bar:
        for frame in bar.track(drawn.frames()):
            check()
            signals.raise_noted()
            yield frame


def what_happened(casts: Casts) -> str:
    """Return in words what a film shows."""
    takes = [take for takes in casts for take in takes]
    alike = {take.setup.disturbances.seen_by(0) for take in takes}
    added = with_added(alike.pop()) if len(alike) == 1 else ", each with its own disturbances"
    if len(takes) == 1:
        return f"{counted(takes[0].episode.steps, 'step')}, {takes[0].episode.ending}{added}"
    steps = [take.episode.steps for take in takes]
    span = f"{min(steps)} to " if min(steps) < max(steps) else ""
    return f"{len(takes)} episodes of {span}{max(steps)} steps{added}"


def write_sheet(casts: Casts, look: VideoOptions, path: Path, signals: StopSignals) -> None:
    """Draw equally spaced frames of a take as one picture; print what came out (see `film`)."""
    with signals.deferred(), Film(casts, look) as drawn:
        picture = drawn.contact_sheet(SHEET_FRAMES)
        signals.raise_noted()
        with atomic_write(path) as temporary:
            Image.fromarray(picture).save(temporary)
        height, width = picture.shape[:2]
        print(
            f"sheet  {path}  ({what_happened(casts)}; {width}x{height}, drawn by {drawn.drawn_by})"
        )


def film_result(
    result: TrainResult,
    cartpole: CartPole,
    folder: Path,
    summary: dict[str, Any],
    signals: StopSignals,
) -> None:
    """Film the first evaluation episode of a run into videos/, and name it in the summary.

    A summary that names a film was written before a kill. For the signals see `film`.

    Raises:
        Interrupted: See `film`.
    """
    setup = where_trained(folder.resolve().name, result.policy, result.config, cartpole)
    path = own_film(folder, summary) or default_path([setup], ".mp4")
    # Named before it is drawn: resumed after a kill, the training takes no second name.
    summary["video"] = str(path)
    runs.write_summary(folder, summary)
    written = film([play(setup)], VideoOptions(), path, signals)
    if written != path:
        summary["video"] = str(written)
        runs.write_summary(folder, summary)
