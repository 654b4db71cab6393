"""What an episode came to, and the log of many."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjcartpole.learning.episodes import (
    ENDINGS,
    SIDES,
    Columns,
    Episode,
    EpisodeLog,
    ending_index,
    side_index,
)
from mjcartpole.task import CARTPOLE_V1

EPISODES = [
    Episode(0, 12.0, 12, "pole fell", "left"),
    Episode(1, 500.0, 500, "time limit"),
    Episode(2, 77.0, 77, "off the track", "right"),
    Episode(3, 9.0, 9, "pole fell"),
]


def logged(episodes=EPISODES, capacity=6):
    log = EpisodeLog(capacity)
    for episode in episodes:
        log.append(episode)
    return log


@pytest.mark.parametrize(
    ("terminated", "x", "ending"),
    [
        (False, 0.0, "time limit"),
        (False, CARTPOLE_V1.x_limit, "time limit"),
        (True, math.nextafter(CARTPOLE_V1.x_limit, 9), "off the track"),
        (True, math.nextafter(-CARTPOLE_V1.x_limit, -9), "off the track"),
        (True, CARTPOLE_V1.x_limit, "pole fell"),
        (True, -CARTPOLE_V1.x_limit, "pole fell"),
        (True, 0.0, "pole fell"),
    ],
)
def test_why_an_episode_ended(terminated, x, ending):
    assert ENDINGS[ending_index(terminated, x, 2.4)] == ending


@pytest.mark.parametrize(
    ("ending", "x", "theta", "side"),
    [
        ("time limit", 9.0, 9.0, ""),
        ("off the track", 2.5, -0.1, "right"),
        ("off the track", -2.5, 0.1, "left"),
        ("pole fell", 1.0, -0.3, "left"),
        ("pole fell", -1.0, 0.3, "right"),
    ],
)
def test_on_which_side_an_episode_ended(ending, x, theta, side):
    assert SIDES[side_index(ENDINGS.index(ending), x, theta)] == side


def test_a_log_starts_empty():
    log = EpisodeLog(5)
    assert (len(log), list(log), log[:], bool(log)) == (0, [], [], False)
    with pytest.raises(IndexError, match="the log has 0 episodes, none at 0"):
        log[0]


def test_a_log_is_a_sequence_of_what_was_appended():
    log = logged()
    assert len(log) == 4
    assert list(log) == EPISODES
    assert list(reversed(log)) == EPISODES[::-1]
    assert [log[index] for index in range(-4, 4)] == EPISODES * 2
    assert log[np.int64(2)] == EPISODES[2]
    assert EPISODES[1] in log
    assert log.index(EPISODES[3]) == 3


@pytest.mark.parametrize("index", [4, 5, 100, -5, -100])
def test_there_is_nothing_outside_even_where_there_is_memory(index):
    with pytest.raises(IndexError, match=f"the log has 4 episodes, none at {index}"):
        logged(capacity=200)[index]


@given(*[st.none() | st.integers(-7, 7)] * 2, st.none() | st.sampled_from([-3, -2, -1, 1, 2, 3]))
def test_slices_are_those_of_a_list(start, stop, step):
    assert logged()[start:stop:step] == EPISODES[start:stop:step]


def test_values_are_plain():
    assert [type(value) for value in logged()[0]] == [int, float, int, str, str]


def test_columns_are_as_long_as_the_log_and_see_what_it_holds():
    log = logged()
    totals, steps, endings, sides = log.columns
    assert totals.tolist() == [12.0, 500.0, 77.0, 9.0]
    assert steps.tolist() == [12, 500, 77, 9]
    assert [ENDINGS[index] for index in endings] == [episode.ending for episode in EPISODES]
    assert [SIDES[index] for index in sides] == ["left", "", "right", ""]
    assert [column.dtype for column in log.columns] == [np.float64, np.int32, np.int8, np.int8]
    assert all(np.shares_memory(*pair) for pair in zip(log.columns, log.storage, strict=True))
    assert all(len(column) == 6 for column in log.storage)


def test_what_was_written_into_the_storage_counts_once_it_is_said():
    log = logged()
    for column, value in zip(log.storage, (33.0, 33, 1, 2), strict=True):
        column[4] = value
    assert len(log) == 4
    log.extend_to(5)
    assert list(log) == [*EPISODES, Episode(4, 33.0, 33, "off the track", "right")]


def test_a_copy_is_independent_in_both_directions():
    log = logged()
    copied = log.copy()
    log.append(Episode(4, 1.0, 1, "pole fell"))
    for column in log.storage:
        column[0] = 1
    assert list(copied) == EPISODES
    assert all(len(column) == 4 for column in copied.storage)
    copied.storage.totals[1] = -1.0
    assert log[1] == EPISODES[1]


def test_a_log_goes_on_from_the_columns_of_another():
    log = logged()
    again = EpisodeLog.of(log.columns, 6)
    assert list(again) == EPISODES
    again.append(Episode(4, 2.0, 2, "pole fell"))
    again.append(Episode(5, 3.0, 3, "time limit"))
    assert [episode.number for episode in again] == list(range(6))
    assert (len(log), len(again)) == (4, 6)
    nothing = Columns(np.empty(0), np.empty(0, np.int32), *(np.empty(0, np.int8),) * 2)
    assert list(EpisodeLog.of(nothing, 3)) == []


def test_a_full_log_takes_no_more():
    with pytest.raises(IndexError):
        logged(capacity=3)
