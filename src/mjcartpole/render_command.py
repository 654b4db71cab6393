"""What `render` does and prints."""

import contextlib
from collections.abc import Generator, Sequence
from pathlib import Path

from PIL import Image
from rich.console import Console
from rich.progress import Progress

from mjcartpole.commands import VIDEOS, Choice, set_stage
from mjcartpole.errors import FileError, RenderError
from mjcartpole.files import check_writable, replacing
from mjcartpole.media.video import check_path, write_video
from mjcartpole.signals import Interrupted, StopSignals
from mjcartpole.studies.evaluation import check_count
from mjcartpole.studies.film import Film, Frame, Look, Stage, Take, play

SHEET_FRAMES = 10
"""Pictures on a contact sheet."""
MOST_NAMES = 3
"""Runs that a video's file is named after; of more, the first one stands for all."""


def run_render(
    sources: Sequence[Path],
    choice: Choice,
    look: Look,
    *,
    episodes: int,
    output: Path | None,
    sheet: bool,
) -> int:
    """Film greedy episodes of one run, or of several side by side. Returns the exit code."""
    signals = StopSignals()
    with signals.caught():
        stages = [set_stage(source, choice) for source in sources]
        path = output or VIDEOS / f"{_name(stages)}{'.png' if sheet else '.mp4'}"
        for stage in stages:
            look.check(stage.cartpole)
            check_count(episodes, stage.seed)
        if sheet:
            _check_sheet(stages, episodes, path)
        _check_output(path, ".png" if sheet else check_path(path))
        casts = [play(stage, episodes) for stage in stages]
        (_write_sheet if sheet else film)(casts, look, path, signals)
    return 0


def _name(stages: Sequence[Stage]) -> str:
    """A file's name for stages: all of them, unless it would become too long."""
    names = [stage.name for stage in stages]
    if len(names) > MOST_NAMES:
        names[1:] = [f"{len(names) - 1}-others"]
    return "-beside-".join(names)


def film(
    casts: Sequence[Sequence[Take]], look: Look, path: Path, signals: StopSignals | None = None
) -> None:
    """Draw takes and write them as a video; print what came out.

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


def _with_progress(drawn: Film, signals: StopSignals) -> Generator[Frame]:
    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        for frame in bar.track(drawn.frames(), total=drawn.length, description="filming"):
            _raise_noted(signals)
            yield frame


def _raise_noted(signals: StopSignals) -> None:
    if signals.stop():
        raise Interrupted(number=signals.number)


def _what_happened(casts: Sequence[Sequence[Take]]) -> str:
    takes = [take for takes in casts for take in takes]
    if len(takes) == 1:
        return f"{takes[0].episode.steps} steps, {takes[0].episode.ending}"
    steps = [take.episode.steps for take in takes]
    return f"{len(takes)} episodes of {min(steps)} to {max(steps)} steps"


def _check_output(path: Path, suffix: str) -> None:
    """Refuse a place where nothing can be written, before anything is played."""
    if suffix and path.is_dir():
        raise FileError(f"cannot write '{path}': it is a folder; give the path of a file")
    check_writable(path.parent)


def _check_sheet(stages: Sequence[Stage], episodes: int, path: Path) -> None:
    if len(stages) > 1:
        raise RenderError(f"a contact sheet shows one run, not {len(stages)}; leave out --sheet")
    if episodes > 1:
        raise RenderError(f"a contact sheet shows one episode, not {episodes}; leave out --sheet")
    if path.suffix.lower() != ".png":
        raise RenderError(f"a contact sheet is a .png, not '{path}'")


def _write_sheet(
    casts: Sequence[Sequence[Take]], look: Look, path: Path, signals: StopSignals
) -> None:
    with signals.deferred(), Film(casts, look) as drawn:
        picture = drawn.contact_sheet(SHEET_FRAMES)
        _raise_noted(signals)
        with replacing(path) as temporary:
            Image.fromarray(picture).save(temporary)
        height, width = picture.shape[:2]
        print(
            f"sheet  {path}  ({_what_happened(casts)}; {width}x{height}, drawn by {drawn.drawn_by})"
        )
