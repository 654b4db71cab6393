"""Which ffmpeg can write H.264 here: imageio's, or the system's where that one cannot run."""

import functools
import importlib.resources
import itertools
import os
import re
import shutil
import subprocess
from dataclasses import dataclass
from typing import Final

VARIABLE: Final = "IMAGEIO_FFMPEG_EXE"
"""The environment variable by which imageio's users name an ffmpeg."""

CODECS: Final = {
    # CRF 18 is visually lossless; slower presets would make files smaller, and drawing wait.
    "libx264": ("-preset", "veryfast", "-crf", "18"),
    # Some distributions build ffmpeg without x264; this one needs a bit rate.
    "libopenh264": ("-b:v", "4M"),
}
"""The H.264 encoders that are known here, best first, and how each is told to look good."""

_SECONDS: Final = 20.0


@dataclass(frozen=True)
class FFmpeg:
    """An ffmpeg and what it can do.

    Attributes:
        source: Who names it: `"IMAGEIO_FFMPEG_EXE"`, `"imageio-ffmpeg"` or `"PATH"`.
        program: Its path; empty if there is none.
        version: Its version; empty if it does not run.
        codec: The H.264 encoder to use; empty if it cannot be used.
        reason: Why it cannot be used, in one clause; empty if it can.
    """

    source: str
    program: str
    version: str = ""
    codec: str = ""
    reason: str = ""


def find_ffmpeg() -> FFmpeg | None:
    """The first ffmpeg that runs and writes H.264, or None."""
    return next((found for found in map(examine, SOURCES) if found.codec), None)


def why_not_the_first() -> str:
    """Why better ffmpegs than `find_ffmpeg`'s cannot be used, in one line; empty if none is better.

    One that nobody has named or installed is not spoken of, unless there is none at all.
    """
    found = [examine(source) for source in SOURCES]
    better = list(itertools.takewhile(lambda one: not one.codec, found))
    named = [one for one in better if one.program or len(better) == len(found)]
    return "; ".join(f"{one.source}: {one.reason}" for one in named)


def examine(source: str) -> FFmpeg:
    """What the ffmpeg of a source can do; found out once."""
    program = SOURCES[source]()
    if not program:
        absent = "not set" if source == VARIABLE else "no ffmpeg there"
        return FFmpeg(source, "", reason=absent)
    return _examine(source, program)


@functools.cache
def _examine(source: str, program: str) -> FFmpeg:
    try:
        done = subprocess.run(
            [program, "-encoders"],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=_SECONDS,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return FFmpeg(source, program, reason=f"'{program}' does not answer")
    except OSError as error:
        return FFmpeg(source, program, reason=f"'{program}' cannot be run ({error.strerror})")
    version = re.search(rb"ffmpeg version (\S+)", done.stdout + done.stderr)
    if done.returncode != 0 or version is None:
        return FFmpeg(source, program, reason=f"'{program}' fails (exit code {done.returncode})")
    names = {words[1] for words in map(str.split, done.stdout.decode().splitlines()) if words[1:]}
    codec = next((codec for codec in CODECS if codec in names), "")
    reason = "" if codec else f"'{program}' was built without {' and '.join(CODECS)}"
    return FFmpeg(source, program, version[1].decode(), codec, reason)


def _from_variable() -> str:
    return os.environ.get(VARIABLE, "")


def _from_wheel() -> str:
    """The binary inside the imageio-ffmpeg wheel, whether or not it can run."""
    # Not by imageio_ffmpeg.get_ffmpeg_exe, which hides a binary that cannot run.
    try:
        folder = importlib.resources.files("imageio_ffmpeg.binaries")
    except ImportError:
        return ""
    names = (str(entry) for entry in folder.iterdir() if entry.name.startswith("ffmpeg"))
    return next(names, "")


def _from_path() -> str:
    return shutil.which("ffmpeg") or ""


SOURCES: Final = {
    VARIABLE: _from_variable,
    "imageio-ffmpeg": _from_wheel,
    "PATH": _from_path,
}
"""Where an ffmpeg is looked for, in this order."""
