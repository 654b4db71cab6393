"""What a notebook shows: a line in words, and a picture where one can be drawn."""

import base64
import html
import io
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from mjcartpole.media.plots import Plot, is_installed, png_of


def with_picture(said: str, png: bytes | None) -> str:
    """Return HTML of words, and of a picture under them if there is one."""
    text = f"<pre>{html.escape(said)}</pre>"
    if png is None:
        return text
    source = base64.b64encode(png).decode()
    return f'{text}<img style="max-width: 100%" src="data:image/png;base64,{source}">'


def with_plot(said: str, plot: Callable[[], Plot]) -> str:
    """Return HTML of words, and of a plot under them where matplotlib is installed."""
    return with_picture(said, png_of(plot().figure()) if is_installed() else None)


def with_frame(said: str, frame: npt.NDArray[np.uint8]) -> str:
    """Return HTML of words and of a rendered frame."""
    from mjcartpole.media.pillow import Image  # noqa: PLC0415 - words and plots need none

    png = io.BytesIO()
    Image.fromarray(frame).save(png, "png")
    return with_picture(said, png.getvalue())
