"""Frames: pictures as arrays, and the check that some go together."""

import numpy as np
import numpy.typing as npt

from mjcartpole.errors import RenderError

Frame = npt.NDArray[np.uint8]
"""A picture of shape (height, width, 3): red, green, blue."""


def check_frame(frame: Frame, name: str, shape: tuple[int, ...], whole: str) -> None:
    """Refuse what is no picture, or not of the first one's shape (RenderError).

    It is called by a name, such as "frame 3"; the whole is what needs pictures of one size, such as
    "frames of a video".
    """
    if frame.ndim != 3 or frame.shape[2] != 3 or frame.dtype != np.uint8 or not frame.size:
        raise RenderError(
            f"{name} is an array of shape {frame.shape} and {frame.dtype}; "
            "needed are (height, width, 3) and uint8"
        )
    if frame.shape != shape:
        raise RenderError(
            f"{name} is {frame.shape[1]}x{frame.shape[0]} pixels, the first one "
            f"{shape[1]}x{shape[0]}; all {whole} have one size"
        )
