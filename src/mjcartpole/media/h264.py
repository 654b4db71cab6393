"""Frames into an mp4, through a pipe to ffmpeg."""

import contextlib
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Final

import numpy as np
import numpy.typing as npt

from mjcartpole.errors import RenderError
from mjcartpole.media.encoders import CODECS, FFmpeg

_PIPE_BYTES: Final = 1 << 20
"""What Linux lets everybody have: a frame of 640x480, so that drawing need not wait."""


def write_mp4(
    path: Path,
    frames: Iterator[npt.NDArray[np.uint8]],
    size: tuple[int, int],
    fps: float,
    ffmpeg: FFmpeg,
) -> int:
    """Write frames as H.264 with 4:2:0 colours, with the index first; returns their number.

    Args:
        path: The file; its name needs no suffix.
        frames: Pictures of shape (height, width, 3), all of one size.
        size: Width and height in pixels, as they come; odd ones lose their last row or column.
        fps: Frames per second.
        ffmpeg: Who encodes.

    Raises:
        RenderError: ffmpeg fails.
    """
    count = 0
    with _encoder(_command(path, size, fps, ffmpeg)) as pipe:
        for frame in frames:
            pipe.write(np.ascontiguousarray(frame).data)
            count += 1
    return count


def even(size: tuple[int, int]) -> tuple[int, int]:
    """The size that H.264 keeps of a picture: it stores colours for blocks of 2 by 2 pixels."""
    width, height = size
    return width - width % 2, height - height % 2


@contextlib.contextmanager
def _encoder(command: list[str]) -> Iterator[IO[bytes]]:
    """Yield ffmpeg's input; afterwards the file is complete, or ffmpeg is gone."""
    with tempfile.TemporaryFile() as messages:
        process = _start(command, messages)
        assert process.stdin is not None
        try:
            # ffmpeg closes its input when it fails; its exit code and message say why.
            with contextlib.suppress(BrokenPipeError):
                yield process.stdin
        except BaseException:
            process.kill()
            raise
        finally:
            with contextlib.suppress(BrokenPipeError):
                process.stdin.close()
            process.wait()
        if process.returncode != 0:
            messages.seek(0)
            raise RenderError(f"ffmpeg failed: {_last_line(messages.read())}")


def _start(command: list[str], messages: IO[bytes]) -> subprocess.Popen[bytes]:
    try:
        return subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=messages,
            # Unbuffered: a frame goes straight from its array to the pipe.
            bufsize=0,
            pipesize=_PIPE_BYTES if sys.platform == "linux" else -1,
            # Ctrl-C is for this process, which then ends ffmpeg itself.
            start_new_session=True,
        )
    except OSError as error:
        raise RenderError(f"ffmpeg cannot be run ('{command[0]}'): {error.strerror}") from error


def _command(path: Path, size: tuple[int, int], fps: float, ffmpeg: FFmpeg) -> list[str]:
    source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", "{}x{}".format(*size), "-r", str(fps)]
    # The colours are converted and labelled as BT.709, so that players need not guess.
    labels = "colorspace=bt709:color_primaries=bt709:color_trc=bt709:range=tv"
    steps = ["scale=out_color_matrix=bt709:out_range=tv", "format=yuv420p", f"setparams={labels}"]
    if even(size) != size:
        steps.insert(0, "crop={}:{}:0:0".format(*even(size)))
    codec = ["-c:v", ffmpeg.codec, *CODECS[ffmpeg.codec]]
    # faststart: the index comes first, so that a browser can play before it has all.
    # file: for ffmpeg a bare name could mean a protocol, such as concat:, or an option.
    target = ["-movflags", "+faststart", "-f", "mp4", f"file:{path}"]
    quiet = ["-hide_banner", "-loglevel", "error", "-nostdin", "-y"]
    return [
        ffmpeg.program,
        *quiet,
        *source,
        "-i",
        "-",
        "-an",
        "-vf",
        ",".join(steps),
        *codec,
        *target,
    ]


def _last_line(messages: bytes) -> str:
    lines = messages.decode(errors="replace").strip().splitlines()
    return lines[-1] if lines else "it gave no reason"
