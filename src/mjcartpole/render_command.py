"""What `render` does and prints."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from PIL import Image
from rich.console import Console
from rich.progress import track

from mjcartpole.commands import VIDEOS, Choice, set_stage
from mjcartpole.errors import RenderError
from mjcartpole.files import replacing
from mjcartpole.media.video import check_path, write_video
from mjcartpole.studies.film import Film, Frame, Look, Stage, Take, play

SHEET_FRAMES = 10
"""Pictures on a contact sheet."""


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
    stages = [set_stage(source, choice) for source in sources]
    name = "-beside-".join(stage.name for stage in stages)
    path = output or VIDEOS / f"{name}{'.png' if sheet else '.mp4'}"
    if sheet:
        _check_sheet(stages, path)
    else:
        check_path(path)
    for stage in stages:
        look.check(stage.cartpole)
    casts = [play(stage, episodes) for stage in stages]
    if sheet:
        _write_sheet(casts, look, path)
    else:
        film(casts, look, path)
    return 0


def film(casts: Sequence[Sequence[Take]], look: Look, path: Path) -> None:
    """Draw takes and write them as a video; print what came out."""
    with Film(casts, look) as drawn:
        video = write_video(path, _with_progress(drawn), fps=look.fps)
        seconds = video.frames / video.fps
        print(
            f"video  {video.path}  ({_what_happened(casts)}; {seconds:.1f} s, "
            f"{video.width}x{video.height}, drawn by {drawn.drawn_by})"
        )


def _with_progress(drawn: Film) -> Iterator[Frame]:
    console = Console(stderr=True)
    yield from track(
        drawn.frames(),
        "filming",
        total=drawn.length,
        console=console,
        transient=True,
        disable=not console.is_terminal,
    )


def _what_happened(casts: Sequence[Sequence[Take]]) -> str:
    takes = [take for takes in casts for take in takes]
    if len(takes) == 1:
        return f"{takes[0].episode.steps} steps, {takes[0].episode.ending}"
    steps = [take.episode.steps for take in takes]
    return f"{len(takes)} episodes of {min(steps)} to {max(steps)} steps"


def _check_sheet(stages: Sequence[Stage], path: Path) -> None:
    if len(stages) > 1:
        raise RenderError(f"a contact sheet shows one run, not {len(stages)}; leave out --sheet")
    if path.suffix.lower() != ".png":
        raise RenderError(f"a contact sheet is a .png, not '{path}'")


def _write_sheet(casts: Sequence[Sequence[Take]], look: Look, path: Path) -> None:
    with Film(casts, look) as drawn:
        picture = drawn.contact_sheet(SHEET_FRAMES)
        with replacing(path) as temporary:
            Image.fromarray(picture).save(temporary)
        height, width = picture.shape[:2]
        print(
            f"sheet  {path}  ({_what_happened(casts)}; {width}x{height}, drawn by {drawn.drawn_by})"
        )
