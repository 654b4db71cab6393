"""Grids, contact sheets, and the moments before a fall."""

import tracemalloc

import numpy as np
import pytest

from mjcartpole.errors import RenderError
from mjcartpole.media.montage import (
    equally_spaced,
    last_seconds,
    played,
    sheet,
    side_by_side,
    state_at,
    time_label,
)


def film(count, colour, width=64, height=48):
    for index in range(count):
        frame = np.full((height, width, 3), colour, np.uint8)
        frame[0, 0] = index % 256
        yield frame


RED, GREEN, BLUE = (200, 0, 0), (0, 200, 0), (0, 0, 200)


def covered(picture, colour):
    """Box of a colour: left, top, right, bottom, right and bottom inside."""
    rows, columns = np.nonzero((picture == colour).all(axis=2))
    return columns.min(), rows.min(), columns.max(), rows.max()


def test_two_films_stand_side_by_side():
    films = [film(3, RED), film(3, GREEN)]
    pictures = list(side_by_side(films, ["a", "b"]))
    assert len(pictures) == 3
    left, right = covered(pictures[0], RED), covered(pictures[0], GREEN)
    assert (left[0], left[2], right[0], right[2]) == (0, 63, 66, 129)
    assert left[1] == right[1] > 8
    assert pictures[0].shape == (left[3] + 1, 130, 3)
    assert not np.shares_memory(pictures[0], pictures[1])


def test_a_grid_goes_row_by_row():
    films = [film(1, colour) for colour in (RED, GREEN, BLUE)]
    picture = next(side_by_side(films, ["a", "b", "c"], columns=2))
    assert covered(picture, RED)[1] == covered(picture, GREEN)[1] < covered(picture, BLUE)[1]
    assert covered(picture, RED)[0] == covered(picture, BLUE)[0] < covered(picture, GREEN)[0]


@pytest.mark.parametrize("count", [1, 2, 3, 4, 7])
@pytest.mark.parametrize("columns", [None, 1, 3])
@pytest.mark.parametrize("size", [(64, 48), (320, 240), (640, 480)])
def test_even_pictures_give_an_even_whole(count, columns, size):
    films = [film(1, RED, *size) for _ in range(count)]
    picture = next(side_by_side(films, ["label"] * count, columns=columns))
    assert picture.shape[0] % 2 == picture.shape[1] % 2 == 0


def test_a_film_that_has_ended_stands_still_and_pales():
    pictures = list(side_by_side([film(5, RED), film(2, BLUE)], ["long", "short"]))
    assert len(pictures) == 5
    second, third, last = (pictures[index][-1, -1].astype(int) for index in (1, 2, 4))
    assert second.tolist() == list(BLUE)
    assert (third > second).all()
    assert (third == last).all()


def test_labels_are_written_and_tell_films_apart():
    one, other = (next(side_by_side([film(1, RED)], [label])) for label in ("mujoco", "gym"))
    assert (one != other).any()
    assert next(side_by_side([film(1, RED)], ["x" * 500])).shape[1] == 64


def test_memory_does_not_grow_with_the_length():
    tracemalloc.start()
    try:
        for _ in side_by_side([film(300, RED), film(200, BLUE)], ["a", "b"]):
            pass
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 40 * 64 * 48 * 3


def test_films_that_do_not_fit_are_refused():
    with pytest.raises(RenderError, match="picture 1 is 32x32 pixels, the first one 64x48"):
        next(side_by_side([film(1, RED), film(1, RED, 32, 32)], ["a", "b"]))
    with pytest.raises(RenderError, match="2 pictures need as many labels, not 1"):
        next(side_by_side([film(1, RED), film(1, RED)], ["a"]))
    with pytest.raises(RenderError, match="film 1 has no frame"):
        next(side_by_side([film(1, RED), film(0, RED)], ["a", "b"]))
    with pytest.raises(RenderError, match="at least one"):
        next(side_by_side([], []))
    with pytest.raises(RenderError, match="0 columns"):
        next(side_by_side([film(1, RED)], ["a"], columns=0))
    with pytest.raises(RenderError, match="float64"):
        sheet([np.zeros((4, 4, 3))], ["a"])


def test_a_sheet_has_its_captions_below():
    frames = [next(film(1, colour, 80, 60)) for colour in (RED, GREEN, BLUE)]
    picture = sheet(frames, [time_label(step) for step in (0, 25, 50)], columns=2)
    red, blue = covered(picture, RED), covered(picture, BLUE)
    assert red[:2] == (0, 0)
    assert picture.shape[1] == 2 * 80 + 2
    caption = picture[60 : blue[1] - 2, :80].astype(int)
    assert (caption.min(axis=2) < 160).any(), "no caption"
    assert sheet(frames, ["", "", ""]).shape[1] == 3 * 80 + 4


def test_equally_spaced_frames():
    assert equally_spaced(500, 5) == [0, 125, 250, 374, 499]
    assert equally_spaced(3, 10) == [0, 1, 2]
    assert equally_spaced(10, 1) == [0]
    for wrong in ((0, 3), (3, 0)):
        with pytest.raises(RenderError, match="use 1 or more"):
            equally_spaced(*wrong)


def test_a_time_label():
    assert time_label(125) == "2.50 s"


def test_the_last_second_in_slow_motion():
    places = last_seconds(201, seconds=1.0, speed=0.25)
    assert places[0] == 150
    assert places[-1] == 200
    assert np.diff(places) == pytest.approx(0.25)
    assert len(places) == 50 * 4 + 1


@pytest.mark.parametrize("total", [1, 2, 9, 51, 52])
@pytest.mark.parametrize("speed", [0.1, 0.25, 0.3, 1.0])
def test_the_fall_ends_with_the_last_state(total, speed):
    places = last_seconds(total, speed=speed)
    assert places[0] == max(0, total - 51)
    assert places[-1] == total - 1
    assert (np.diff(places) > 0).all()
    assert np.diff(places).max(initial=0) < 2 * speed + 1e-9


def test_playing_at_another_speed():
    assert played(5).tolist() == [0, 1, 2, 3, 4]
    assert played(5, speed=2).tolist() == [0, 2, 4]
    assert played(3, speed=0.5).tolist() == [0, 0.5, 1, 1.5, 2]
    assert len(played(501, speed=0.1)) == 5001
    for speed in (0, -1, np.nan, np.inf):
        with pytest.raises(RenderError, match="speed"):
            played(5, speed=speed)


def test_a_state_between_two_lies_on_a_straight_line():
    states = [(0.0, 1.0, 0.0, 2.0), (1.0, 3.0, -0.2, 2.0)]
    assert state_at(states, 0.25) == pytest.approx([0.25, 1.5, -0.05, 2.0])
    assert state_at(states, 1).tolist() == list(states[1])
    assert state_at(states, 7).tolist() == list(states[1])
    assert state_at(states[:1], 0.5).tolist() == list(states[0])
