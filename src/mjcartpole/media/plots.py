"""Plots: matplotlib without a window or global state, where it is installed."""

import contextlib
import io
import warnings
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Protocol

import numpy as np

from mjcartpole import packages
from mjcartpole.errors import RenderError
from mjcartpole.files import atomic_write
from mjcartpole.media.palette import CURVES, FAINT, GRID, INK, LINE, PAPER, Colour

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DATES: Final = {".png": {}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
"""What each kind of file would say of the day, so that the same plot has the same bytes."""

MISSING_LIBRARY: Final = packages.missing("a plot", "matplotlib")


class Plot(Protocol):
    """Numbers that can be drawn."""

    def figure(self) -> "Figure":
        """Draw them (RenderError without matplotlib)."""

    def rows(self) -> Iterator[Mapping[str, object]]:
        """Yield exactly what is drawn, as the lines of a table."""


def is_installed() -> bool:
    """Return whether matplotlib is there."""
    return packages.is_installed("matplotlib")


def css(colour: Colour) -> str:
    """Return a colour of the palette as matplotlib, and a page, name it.

    >>> css((255, 0, 16))
    '#ff0010'
    """
    return "#" + bytes(colour).hex()


def plain(text: str) -> str:
    """Return a name as it is to be given to matplotlib: a dollar in it begins no formula.

    What is no text in it, as a file's name may have, is shown as a question mark.
    """
    return text.encode("utf-8", "replace").decode().replace("$", r"\$")


def short(text: str, most: int = 40) -> str:
    """Return a name as it is to be given to matplotlib, without its middle if it is long."""
    cut = len(text) > most
    return plain(f"{text[: most // 2]}...{text[len(text) - most // 2 + 3 :]}" if cut else text)


@contextlib.contextmanager
def plot_style() -> Iterator[None]:
    """Have what is plotted inside look the same everywhere, whatever a user's own settings are.

    Without matplotlib it is a RenderError.
    """
    packages.check_installed("a plot", "matplotlib", RenderError)
    import matplotlib.style  # noqa: PLC0415 - an optional package
    from cycler import cycler  # noqa: PLC0415

    ours: dict[str, Any] = {
        **dict.fromkeys(("figure.facecolor", "axes.facecolor"), css(PAPER)),
        **dict.fromkeys(("text.color", "axes.labelcolor"), css(INK)),
        **dict.fromkeys(("xtick.labelcolor", "ytick.labelcolor"), css(INK)),
        **dict.fromkeys(("axes.edgecolor", "xtick.color", "ytick.color"), css(LINE)),
        **dict.fromkeys(("axes.spines.top", "axes.spines.right", "legend.frameon"), False),
        **{"axes.grid": True, "grid.color": css(GRID), "axes.axisbelow": True},
        **{"axes.prop_cycle": cycler(color=[css(colour) for colour in CURVES])},
        **dict.fromkeys((f"figure.constrained_layout.{side}_pad" for side in "wh"), 0.12),
        **{"axes.titlelocation": "left", "savefig.dpi": 100, "figure.dpi": 100},
        # Ids in an SVG would be drawn by lot.
        **{"axes.titlepad": 10, "svg.hashsalt": "mjcartpole", "hatch.linewidth": 0.5},
    }
    with matplotlib.style.context(["default", ours]), warnings.catch_warnings():
        # A name may have letters that the font lacks.
        warnings.filterwarnings("ignore", "Glyph .* missing from")
        yield


def level(axes: "Axes", y: float) -> None:
    """Draw a value right across, with its number."""
    axes.axhline(y, color=css(FAINT), linewidth=1)
    text = axes.annotate(f"{y:g}", (1, y), (0, -3), axes.get_yaxis_transform(), "offset points")
    text.set(color=css(FAINT), ha="right", va="top")


def legend_below(figure: "Figure", lines: Sequence[Any], words: Sequence[str]) -> None:
    """Say below a plot what its lines are."""
    legend = figure.legend(lines, [str(n) for n in range(len(words))], loc="outside lower left")
    for text, said in zip(legend.get_texts(), words, strict=True):
        # Set here: a label that begins with an underscore would be left out.
        text.set_text(said)


def ink_on(colour: Any) -> str:  # noqa: ANN401
    """Return the ink that is seen on a colour of matplotlib's, dark or light."""
    lightness = float(np.dot(colour[:3], (0.299, 0.587, 0.114)))
    return css(INK if lightness > 0.55 else PAPER)


def check_suffix(path: Path) -> str:
    """Return which kind of plot a file's name asks for.

    Raises:
        RenderError: None that there is.
    """
    suffix = path.suffix.lower()
    if suffix not in DATES:
        raise RenderError(
            f"'{path}' is no plot's name; its suffix says what is written: {', '.join(DATES)}"
        )
    return suffix


def write_plot(figure: "Figure", path: Path) -> None:
    """Write a plot as its file's suffix says: PNG, SVG or PDF.

    Raises:
        RenderError: The suffix is another one, or matplotlib is not installed.
        FileError: The file cannot be written.
    """
    suffix = check_suffix(path)
    with atomic_write(path) as temporary:
        _save(figure, temporary, suffix)


def svg_of(figure: "Figure") -> str:
    """Return a plot as SVG."""
    text = io.BytesIO()
    _save(figure, text, ".svg")
    return text.getvalue().decode()


def png_of(figure: "Figure") -> bytes:
    """Return a plot as PNG."""
    content = io.BytesIO()
    _save(figure, content, ".png")
    return content.getvalue()


@plot_style()
def _save(figure: "Figure", target: Path | io.BytesIO, suffix: str) -> None:
    # Of a figure without a layout of its own, what lies around its axes is part of the picture.
    box = None if figure.get_layout_engine() else "tight"
    figure.savefig(
        target, format=suffix[1:], bbox_inches=box, pad_inches=0.15, metadata=DATES[suffix]
    )
