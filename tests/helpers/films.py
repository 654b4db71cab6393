"""Frames to write, and files read again."""

import numpy as np

BACKGROUND, BAR = (220, 240, 250), (200, 90, 40)


def frames(count, width=64, height=48):
    """Pictures with a bar that moves to the right."""
    for index in range(count):
        frame = np.full((height, width, 3), BACKGROUND, dtype=np.uint8)
        frame[:, index % width : index % width + 8] = BAR
        yield frame
