"""Plots by matplotlib."""

import doctest
import os
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

from mjcartpole.errors import FileError, RenderError
from mjcartpole.media import plots
from mjcartpole.media.plots import plain, plot_style, write_plot
from nightly import few

mpl = pytest.importorskip("matplotlib")
SUFFIXES = sorted(plots.DATES)


@plot_style()
def a_figure():
    from matplotlib.figure import Figure

    figure = Figure(figsize=(2, 1), layout="constrained")
    axes = figure.add_subplot()
    axes.plot([0, 1], [0, 1])
    axes.set_title("\u4e2d: no letter of the font")
    return figure


@pytest.mark.parametrize("suffix", few([*SUFFIXES, ".PNG"], ".svg", ".PNG", long=(".pdf",)))
def test_the_suffix_says_what_is_written(suffix, tmp_path):
    write_plot(a_figure(), tmp_path / f"a{suffix}")
    begins = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}[suffix.lower()]
    assert (tmp_path / f"a{suffix}").read_bytes().startswith(begins)
    assert [path.name for path in tmp_path.iterdir()] == [f"a{suffix}"]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_the_same_plot_has_the_same_bytes_on_another_day(suffix, tmp_path, monkeypatch):
    contents = []
    for second in ("0", "1000000000"):
        monkeypatch.setenv("SOURCE_DATE_EPOCH", second)
        write_plot(a_figure(), tmp_path / f"a{suffix}")
        contents.append((tmp_path / f"a{suffix}").read_bytes())
    assert contents[0] == contents[1]


def test_a_users_own_settings_change_neither_the_plot_nor_are_they_changed(tmp_path):
    write_plot(a_figure(), tmp_path / "a.png")
    with mpl.rc_context({"font.size": 30, "lines.linewidth": 9, "text.usetex": True}):
        before = dict(mpl.rcParams)
        write_plot(a_figure(), tmp_path / "b.png")
        assert dict(mpl.rcParams) == before
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_without_a_layout_what_lies_around_the_axes_is_in_the_picture(tmp_path):
    from matplotlib.figure import Figure

    for name in ("m", "m" * 60):
        figure = Figure(figsize=(1, 1))
        figure.add_axes((0, 0, 1, 1)).set_ylabel(name)
        write_plot(figure, tmp_path / f"{len(name)}.png")
    short, long = (np.asarray(Image.open(tmp_path / f"{n}.png")) for n in (1, 60))
    assert long.shape[0] > 3 * short.shape[0]


def test_what_is_refused(tmp_path):
    with pytest.raises(RenderError, match=r"a\.bmp' is no plot's name.*\.png, \.svg, \.pdf"):
        write_plot(a_figure(), tmp_path / "a.bmp")
    with pytest.raises(FileError, match="is a folder"):
        (tmp_path / "a.png").mkdir()
        write_plot(a_figure(), tmp_path / "a.png")


def test_without_matplotlib_the_message_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert not plots.is_installed()
    with pytest.raises(RenderError, match=r"pip install 'mjcartpole\[plot\]'"):
        a_figure()


@pytest.mark.long
def test_plotting_opens_no_window_and_leaves_pyplot_alone(tmp_path):
    code = (
        "import sys\nfrom mjcartpole.media.plots import *\nwith plot_style():\n"
        "  from matplotlib.figure import Figure\n  figure = Figure()\n"
        "write_plot(figure, Path('a.png'))\nassert 'matplotlib.pyplot' not in sys.modules"
    )
    environment = {**os.environ, "MPLBACKEND": "TkAgg"}
    subprocess.run(
        [sys.executable, "-W", "error", "-c", code], cwd=tmp_path, env=environment, check=True
    )


@pytest.mark.parametrize("name", few(["$x_1$", "a$", r"\$a$", "b"], "$x_1$"))
def test_a_name_is_written_letter_by_letter(name, tmp_path):
    for path, text, formulas in (("a.png", plain(name), True), ("b.png", name, False)):
        figure = a_figure()
        figure.axes[0].set_title(text, parse_math=formulas)
        write_plot(figure, tmp_path / path)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_what_is_no_text_is_shown_as_a_question_mark():
    assert plain("a\udcff") == "a?"


def test_doctests():
    assert doctest.testmod(plots).failed == 0
