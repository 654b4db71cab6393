"""Transfers and sweeps as pictures: a heat map, and curves, drawn by Pillow alone."""

import itertools
import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from mjcartpole.studies.sweep import SweepResult
from mjcartpole.studies.transfer import Cell, TransferResult
from mjcartpole.task import CARTPOLE_V1

Colour = tuple[int, int, int]
Point = tuple[float, float]

INK: Final[Colour] = (38, 44, 54)
FAINT: Final[Colour] = (118, 126, 138)
GRID: Final[Colour] = (226, 229, 233)
PAPER: Final[Colour] = (252, 252, 253)
NOTHING: Final[Colour] = (205, 208, 212)

SCALE: Final = np.array([(68, 1, 84), (59, 82, 139), (33, 145, 140), (94, 201, 98), (253, 231, 37)])
"""Five colours of viridis, which rises in lightness for every kind of eye."""

CURVES: Final[tuple[Colour, ...]] = (
    (0, 114, 178), (213, 94, 0), (0, 158, 115), (204, 121, 167), (230, 159, 0), (86, 180, 233)
)  # fmt: skip
"""Okabe and Ito's, told apart by every kind of eye."""

_FINE: Final = 3
"""Lines are drawn this many times as large and then reduced."""


def heat_map(result: TransferResult) -> Image.Image:
    """Every policy (row) on every model (column): colour and number are the mean return."""
    names = [_short(name, 34) for name in result.policies]
    columns = [_short(name, 40) for name in result.places]
    font, small = ImageFont.load_default(15), ImageFont.load_default(12)
    wide, high, pad = 96, 52, 16
    left = pad + math.ceil(max(font.getlength(name) for name in names)) + 10
    slant = math.ceil(max(font.getlength(name) for name in columns))
    top = 52 + round(slant * 0.71) + 12
    width = left + wide * len(columns) + max(pad, round(slant * 0.71) - wide // 2 + 24)
    foot = f"0 to {CARTPOLE_V1.time_limit}; below: 95 % interval over {_episodes(result)} episodes"
    width = max(width, math.ceil(small.getlength(foot)) + 2 * pad)
    picture = Image.new("RGB", (width, top + high * len(names) + 40), PAPER)
    pen = ImageDraw.Draw(picture)
    pen.text((pad, 14), "mean greedy return", font=ImageFont.load_default(18), fill=INK)
    for column, name in enumerate(columns):
        _write_slanted(picture, name, (left + wide * column + wide // 2, top - 8))
    for row, cells in enumerate(result.rows):
        y = top + high * row
        pen.text((left - 10, y + high / 2), names[row], font=font, fill=INK, anchor="rm")
        for column, cell in enumerate(cells):
            _draw_cell(pen, cell, (left + wide * column, y, wide, high))
    pen.text((pad, top + high * len(names) + 14), foot, font=small, fill=FAINT)
    return picture


def curves(result: SweepResult) -> Image.Image:
    """The mean return of every policy against the parameter, with 95 % bands."""
    width, high, left, top, right, bottom = 860, 500, 70, 56, 30, 60
    legend = 24 * len(result.played.policies)
    box = (left, top, width - right, high - bottom)
    picture = Image.new("RGB", (width * _FINE, high * _FINE), PAPER)
    fine = ImageDraw.Draw(picture, "RGBA")
    xs, ys = _ticks(result.values[0], result.values[-1]), range(0, CARTPOLE_V1.time_limit + 1, 100)
    axes = _Axes(box, (result.values[0], result.values[-1]))
    for x in xs:
        _line(fine, [axes.at(x, 0), axes.at(x, CARTPOLE_V1.time_limit)], GRID)
    for y in ys:
        _line(fine, [axes.at(result.values[0], y), axes.at(result.values[-1], y)], GRID)
    ends = [axes.at(x, result.threshold) for x in (result.values[0], result.values[-1])]
    _line(fine, ends, FAINT, 1.5)
    for number, cells in enumerate(result.played.rows):
        _draw_curve(fine, axes, result.values, cells, CURVES[number % len(CURVES)])
    whole = Image.new("RGB", (width, high + legend), PAPER)
    whole.paste(picture.reduce(_FINE))
    _letter_curves(ImageDraw.Draw(whole), result, axes, xs, ys)
    return whole


class _Axes:
    """From values to pixels.

    Attributes:
        box: Left, top, right, bottom of the plot.
    """

    def __init__(self, box: tuple[int, int, int, int], span: tuple[float, float]) -> None:
        self.box = box
        low, high = span
        self._low, self._width = low, (high - low) or 1.0

    def at(self, x: float, y: float) -> Point:
        """Pixels of a value and a return."""
        left, top, right, bottom = self.box
        share = (x - self._low) / self._width
        return left + share * (right - left), bottom - y / CARTPOLE_V1.time_limit * (bottom - top)


def _draw_cell(pen: ImageDraw.ImageDraw, cell: Cell, box: tuple[int, int, int, int]) -> None:
    x, y, wide, high = box
    colour = NOTHING if cell.evaluation is None else _colour(cell.mean / CARTPOLE_V1.time_limit)
    pen.rectangle((x + 1, y + 1, x + wide - 2, y + high - 2), fill=colour)
    ink = INK if _lightness(colour) > 140 else PAPER
    number = "failed" if cell.interval is None else f"{cell.mean:.1f}"
    font, small = ImageFont.load_default(17), ImageFont.load_default(11)
    pen.text((x + wide / 2, y + high / 2 - 6), number, font=font, fill=ink, anchor="mm")
    if cell.interval is not None:
        span = f"{cell.interval.low:.0f} to {cell.interval.high:.0f}"
        pen.text((x + wide / 2, y + high / 2 + 13), span, font=small, fill=ink, anchor="mm")


def _write_slanted(picture: Image.Image, text: str, end: tuple[int, int]) -> None:
    """Write upwards to the right, by 45 degrees, from a point."""
    font = ImageFont.load_default(15)
    size = math.ceil(font.getlength(text)) + 4
    ink = Image.new("L", (2 * size, 2 * size))
    ImageDraw.Draw(ink).text((size, size), text, font=font, fill=255, anchor="ls")
    turned = ink.rotate(45, Image.Resampling.BICUBIC)
    picture.paste(INK, (end[0] - size, end[1] - size), turned)


def _draw_curve(
    fine: ImageDraw.ImageDraw,
    axes: _Axes,
    values: Sequence[float],
    cells: Sequence[Cell],
    colour: Colour,
) -> None:
    """One policy; where the simulation diverged there is a gap."""
    known = [(x, c) for x, c in zip(values, cells, strict=True) if c.interval is not None]
    for (x, cell), (after, other) in itertools.pairwise(known):
        if values.index(after) != values.index(x) + 1:
            continue
        a, b = cell.interval, other.interval
        assert a is not None
        assert b is not None
        band = [
            axes.at(x, a.low),
            axes.at(x, a.high),
            axes.at(after, b.high),
            axes.at(after, b.low),
        ]
        fine.polygon([(_FINE * x, _FINE * y) for x, y in band], fill=(*colour, 50))
        _line(fine, [axes.at(x, cell.mean), axes.at(after, other.mean)], colour, 2.5)
    for x, cell in known:
        (px, py), radius = axes.at(x, cell.mean), 3.5
        dot = (px - radius, py - radius, px + radius, py + radius)
        fine.ellipse(tuple(_FINE * edge for edge in dot), fill=colour)


def _letter_curves(
    pen: ImageDraw.ImageDraw,
    result: SweepResult,
    axes: _Axes,
    xs: Sequence[float],
    ys: Sequence[int],
) -> None:
    left, _, right, bottom = axes.box
    font, title = ImageFont.load_default(14), ImageFont.load_default(18)
    pen.text((left, 16), f"mean greedy return on {_short(result.model, 50)}", font=title, fill=INK)
    for x in xs:
        pen.text((axes.at(x, 0)[0], bottom + 8), f"{x:g}", font=font, fill=INK, anchor="mt")
    for y in ys:
        pen.text((left - 8, axes.at(0, y)[1]), str(y), font=font, fill=INK, anchor="rm")
    threshold = axes.at(0, result.threshold)[1]
    pen.text((right, threshold + 4), f"{result.threshold:g}", font=font, fill=FAINT, anchor="rt")
    pen.text(((left + right) / 2, bottom + 34), result.key, font=font, fill=INK, anchor="mt")
    for number, name in enumerate(result.played.policies):
        y = bottom + 66 + 24 * number
        colour = CURVES[number % len(CURVES)]
        pen.rectangle((left, y - 2, left + 22, y + 2), fill=colour)
        stretch = result.longest(name)
        holds = f"holds from {stretch}" if stretch else f"nowhere at {result.threshold:g}"
        text = f"{_short(name, 40)}: {holds}"
        pen.text((left + 32, y), text, font=font, fill=INK, anchor="lm")


def _line(
    fine: ImageDraw.ImageDraw, points: Sequence[Point], colour: Colour, width: float = 1.0
) -> None:
    large = [(_FINE * x, _FINE * y) for x, y in points]
    fine.line(large, fill=colour, width=round(width * _FINE))


def _colour(share: float) -> Colour:
    """A colour of the scale, from 0 to 1."""
    place = min(max(share, 0.0), 1.0) * (len(SCALE) - 1)
    red, green, blue = (
        round(float(np.interp(place, range(len(SCALE)), SCALE[:, part]))) for part in range(3)
    )
    return red, green, blue


def _lightness(colour: Colour) -> float:
    red, green, blue = colour
    return 0.299 * red + 0.587 * green + 0.114 * blue


def _ticks(low: float, high: float) -> list[float]:
    """About eight round numbers between two."""
    if low == high:
        return [low]
    rough = (high - low) / 8
    unit = 10 ** math.floor(math.log10(rough))
    step = next(unit * factor for factor in (1, 2, 2.5, 5, 10) if unit * factor >= rough * 0.999)
    first = math.ceil(low / step - 1e-9)
    count = math.floor(high / step + 1e-9) - first + 1
    return [round((first + index) * step, 12) for index in range(count)]


def _episodes(result: TransferResult) -> int:
    return max(len(cell.evaluation.episodes) if cell.evaluation else 0 for cell in result.cells)


def _short(text: str, most: int) -> str:
    """A long text without its middle."""
    if len(text) <= most:
        return text
    return f"{text[: most // 2]}...{text[len(text) - most // 2 + 3 :]}"
