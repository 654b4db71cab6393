"""`mjcartpole plot`."""

import csv
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from command_line import done
from mjcartpole import cli
from mjcartpole.learning import compiled
from nightly import few

pytest.importorskip("matplotlib")
TRAIN = ["train", "--backend", "gym", "--episodes", "8", "--no-video"]


def call(words, capsys):
    with pytest.raises(SystemExit) as stop:
        cli.main([str(word) for word in words])
    out, err = capsys.readouterr()
    return stop.value.code, out, err


def pixels(path):
    with Image.open(path) as picture:
        return np.asarray(picture)


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """A folder with a run, and with many seeds, trained as the command line does it."""
    folder = tmp_path_factory.mktemp("plots")
    for name, more in (("one", []), ("many", ["--seeds", "2"])):
        done([*TRAIN, *more, "--run-dir", folder / name])
    return folder


@pytest.fixture
def here(runs, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    # Where the compiler's cache is cold, the first of these tests would be told so on stderr.
    monkeypatch.setattr(compiled._Announcer, "said", True)
    for name in ("one", "many"):
        Path(name).symlink_to(runs / name)


def test_train_leaves_a_curve_beside_a_run_and_beside_many(runs):
    for folder in ("one", "many"):
        assert pixels(runs / folder / "curve.png").shape[1] == 860
    assert not (runs / "many" / "seed-0" / "curve.png").exists()


def test_train_leaves_none_if_told_so_or_without_matplotlib(here, capsys, monkeypatch):
    assert call([*TRAIN, "--no-curve", "--run-dir", "bare"], capsys)[0] == 0
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    code, _, err = call([*TRAIN, "--run-dir", "poor"], capsys)
    assert (code, err) == (0, "")
    assert not (Path("poor/curve.png").exists() or Path("bare/curve.png").exists())
    code, out, err = call(["plot", "curve", "one"], capsys)
    assert (code, out) == (2, "")
    assert err == (
        "mjcartpole: error: a plot needs the package matplotlib: pip install 'mjcartpole[plot]'\n"
    )


KINDS = ["curve", "table", "basin", "phase", "endings"]


@pytest.mark.parametrize("kind", few(KINDS, "curve", "table", "phase", "endings", long=("basin",)))
def test_a_plot_and_its_data(kind, here, capsys):
    more = ["--points", "4"] if kind == "basin" else []
    name = "many" if kind in {"table", "endings"} else "one"
    code, out, err = call(["plot", kind, name, "--data", "d.csv", *more], capsys)
    assert (code, err) == (0, "")
    assert out.endswith("data   d.csv\n")
    assert pixels(f"plots/{name}-{kind}.png").std() > 5
    with open("d.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) > 8
    assert ("run" if kind in {"curve", "endings"} else "what") in rows[0]


@pytest.mark.long
def test_nothing_is_replaced_unless_it_is_asked_for(here, capsys):
    assert "plots/one-and-1-other-curve.png" in call(["plot", "curve", "one", "many"], capsys)[1]
    for expected in ("plots/one-curve.png", "plots/one-curve-2.png"):
        assert call(["plot", "curve", "one"], capsys)[1] == f"plot   {expected}\n"
    Path("a.svg").write_text("mine")
    code, _, err = call(["plot", "curve", "one", "-o", "a.svg"], capsys)
    assert (code, err.count("\n"), Path("a.svg").read_text()) == (2, 1, "mine")
    assert call(["plot", "curve", "one", "-o", "a.svg", "--overwrite"], capsys)[0] == 0
    assert "</svg>" in Path("a.svg").read_text()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["pie", "one"], "invalid choice 'pie'"),
        (["curve"], "plot curve needs a RUN; see mjcartpole plot --help"),
        (["curve", "nowhere"], "no run folder 'nowhere'"),
        (["table", "one", "--window", "3"], "--window is for plot curve, not for plot table"),
        (["curve", "one", "--dims", "x"], "--dims is for plot table and basin and phase"),
        (["curve", "one", "--window", "0"], "window must be a whole number of episodes"),
        (["curve", "one", "--average", "iqm"], "iqm is an average over seeds, and each run here"),
        (["curve", "one", "-o", "a.bmp"], "its suffix says what is written: .png, .svg, .pdf"),
        (["curve", "one", "--data", "a.txt"], "the data of a plot is a .csv, not 'a.txt'"),
        (["table", "one", "many"], "plot table is for one run, not 2"),
        (["table", "one", "--dims", "x,y"], "dimension 'y' is unknown"),
        (["basin", "one", "--at", "x=far"], "--at 'x=far' makes no sense; give NAME=VALUE"),
        (["basin", "one", "--at", "x=inf"], "x is held at a number up to 1e+10, not inf"),
        (["table", "one", "--at", "x=nan"], "x is held at a number up to 1e+10, not nan"),
        (["table", "one", "--at", "x=1", "x=2"], "--at holds a dimension at one value"),
        (["phase", "one", "--episodes", "0"], "episodes must be a whole number from 1 up"),
        (["basin", "one", "--points", "1"], "points must be a whole number from 2"),
    ],
)
def test_what_makes_no_sense_is_one_line(words, said, here, capsys):
    code, _, err = call(["plot", *words], capsys)
    assert (code, err.count("\n")) == (2, 1)
    assert said in err
    assert not Path("plots").exists() or not list(Path("plots").iterdir())
