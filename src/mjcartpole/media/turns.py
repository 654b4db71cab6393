"""Drawing from several threads: at a renderer one at a time, and nobody once Python is exiting.

Python ends its daemon threads wherever they are, while what they use is taken down around them; in
the midst of a driver or of MuJoCo that is a crash. So at exit those that are drawing are waited
for, and a thread that begins after that is held until it goes down with the process.
"""

import abc
import atexit
import contextlib
import functools
import os
import threading
from collections.abc import Iterator
from types import TracebackType
from typing import Final, Self

import numpy as np
import numpy.typing as npt

from mjcartpole.media.scene import Scene

_PATIENCE: Final = 10.0
"""Seconds that a driver has to finish a frame at exit."""
_STEPS: Final = 0.3
"""Seconds for a thread to come from one frame to the next, so that it is held here at exit."""


class Renderer(abc.ABC):
    """Draws states; a context manager that closes itself at the end.

    Any thread may use it; several at the same time take turns.

    Attributes:
        kind: Who draws: `"egl"`, `"osmesa"`, `"glfw"` or `"sketch"`.
        scene: What was drawn last, and where it is in the picture.
    """

    def __init__(self, kind: str, scene: Scene) -> None:
        """It is nobody's turn yet."""
        self.kind, self.scene = kind, scene
        # A thread may come back to it: Python can call __del__ anywhere.
        self._turn = threading.RLock()

    @contextlib.contextmanager
    def taking_turns(self) -> Iterator[None]:
        """Keep other threads out, and the process alive, until this is done."""
        with drawing(), self._turn:
            yield

    def render(self, state: npt.ArrayLike) -> npt.NDArray[np.uint8]:
        """Draw a state `(x, x_dot, theta, theta_dot, …)`; m, m/s, rad, rad/s.

        Returns:
            A new array of shape (height, width, 3), red, green, blue.

        Raises:
            RenderError: The renderer is closed, or it is no state.
        """
        with self.taking_turns():
            return self._render(state)

    @abc.abstractmethod
    def _render(self, state: npt.ArrayLike) -> npt.NDArray[np.uint8]:
        """Do it, while nobody else does."""

    @abc.abstractmethod
    def close(self) -> None:
        """Free what it holds; a second call does nothing."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()


_change = threading.Condition()
_known, _drawing, _held = set[int](), set[int](), set[int]()
_last: int | None = None


@contextlib.contextmanager
def drawing() -> Iterator[None]:
    """Have the process not exit inside; while it does, no thread but the exiting one comes in."""
    _end_at_exit()
    me = threading.get_ident()
    with _change:
        is_within = me in _drawing
        if not is_within and _last not in (None, me):
            _held.add(me)
            _change.notify_all()
            _change.wait_for(lambda: False)
        _known.add(me)
        _drawing.add(me)
    try:
        yield
    finally:
        if not is_within:
            with _change:
                _drawing.discard(me)
                _change.notify_all()


def end_drawing() -> None:
    """Wait until other threads have done what they are drawing, and let nobody begin again."""
    global _last  # noqa: PLW0603 - there is one process, which exits once
    with _change:
        _last = threading.get_ident()
        _change.wait_for(lambda: not _drawing - {_last}, _PATIENCE)
        others = _known & {thread.ident for thread in threading.enumerate()} - {_last}
        _change.wait_for(lambda: others <= _held, _STEPS)


@functools.cache
def _end_at_exit() -> None:
    atexit.register(end_drawing)


def _after_fork() -> None:
    """Forget the threads that a forked process has not got."""
    global _change  # noqa: PLW0603 - another thread may have held it
    _change = threading.Condition()
    _drawing.intersection_update({threading.get_ident()})


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)
