"""Endings, drawn."""

import numpy as np
import pytest

from mjcartpole.media.endings_plot import LOOKS, Endings, EndingsPlot, stretches
from mjcartpole.media.plots import write_plot

pytest.importorskip("matplotlib")


def plot(n=1):
    shares = np.array([[0.25, 1.0], [0.75, 0.0]])
    runs = [Endings(f"run {k}", np.array([3, 6]), shares, np.array([0.5, 0.5])) for k in range(n)]
    return EndingsPlot(runs, [(1, "pole fell left"), (6, "time limit")])


def test_rows_are_what_is_drawn():
    rows = list(plot().rows())
    assert rows[0] == {
        "run": "run 0",
        "what": "training",
        "episode": 3,
        "pole fell left": 0.25,
        "time limit": 0.75,
    }
    assert rows[-1]["what"] == "greedy"
    training, greedy = plot().figure().axes
    tops = [area.get_paths()[0].vertices[:, 1].max() for area in training.collections]
    assert tops == [1.0, 1.0]
    assert [bar.get_height() for bar in greedy.patches] == [0.5, 0.5]


@pytest.mark.long
def test_an_ending_looks_the_same_in_every_plot_and_differs_in_grey_or_by_its_hatch(tmp_path):
    figure = plot(3).figure()
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        "time limit",
        "pole fell left",
    ]
    write_plot(figure, tmp_path / "a.png")
    sided = [LOOKS[number] for number in (1, 2, 4, 5, 6)]
    greys = [(np.dot(colour, (0.299, 0.587, 0.114)), hatch) for colour, hatch in sided]
    for k, (grey, hatch) in enumerate(greys):
        for other, another in greys[k + 1 :]:
            assert abs(grey - other) > 30 or hatch != another


def test_stretches():
    assert stretches(3, 50).tolist() == [1, 2, 3]
    assert stretches(1, 50).tolist() == [1]
    assert stretches(100, 4).tolist() == [25, 50, 75, 100]
