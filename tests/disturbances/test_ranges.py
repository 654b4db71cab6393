"""Ranges that numbers of a model are drawn from."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjcartpole.disturbances.ranges import Range, parse_ranges
from mjcartpole.errors import ConfigError

FINITE = st.floats(1e-3, 1e3)


@pytest.mark.parametrize(
    ("asked", "text"),
    [
        ({"pole.length": (0.5, 1.5)}, "pole.length=0.5:1.5"),
        ({"pole.length": [0.5, 1.5]}, "pole.length=0.5:1.5"),
        ({"cart.mass": (0.1, 10, "log")}, "cart.mass=0.1:10:log"),
        ({"force": (8, 10, 12)}, "force=8,10,12"),
        ({"force": "8,10"}, "force=8,10"),
        ({"force": 8}, "force=8"),
        ("gravity = 1.6:9.8", "gravity=1.6:9.8"),
        (["joint:hinge.damping=0:0.1"], "joint:hinge.damping=0:0.1"),
        ({"gravity": (-0.0, 1)}, "gravity=0:1"),
    ],
)
def test_a_range_is_read_in_every_way_it_is_written(asked: object, text: str) -> None:
    (found,) = parse_ranges(asked)
    assert found.text == text
    assert parse_ranges([text]) == (found,)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ("pole.length", "is no range; give NAME=LOW:HIGH"),
        ("pole.length=", "is no range"),
        ("=1:2", "is no range"),
        ("pole.length=a:b", "is no range"),
        ("pole.length=1:2:3", "is no range"),
        ("pole.length=1:2:log:4", "is no range"),
        ("pole.length=1:nan", "finite"),
        ("pole.length=2:1", "runs backwards"),
        ("pole.length=-1e308:1e308", "too wide"),
        ("pole.length=0:1:log", "a logarithm needs numbers above 0"),
        ({"pole.length": ()}, "is no range"),
        ({"pole.length": True}, "is no range"),
        ({"pole.length": None}, "is no range"),
        ({3: (1, 2)}, "called by a text"),
        (["force=1:2", "force=3:4"], "varies twice"),
        (5, "is no range"),
    ],
)
def test_what_is_no_range_is_refused(asked: object, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        parse_ranges(asked)


@given(FINITE, FINITE, st.floats(0, 1, exclude_max=True), st.sampled_from(["uniform", "log"]))
def test_what_is_drawn_lies_within(a: float, b: float, share: float, kind: str) -> None:
    low, high = sorted((a, b))
    assert low <= Range("force", (low, high), kind).at(share) <= high


def test_shares_are_uniform_or_uniform_in_the_logarithm() -> None:
    assert Range("force", (2.0, 6.0), "uniform").at(0.25) == 3.0
    assert math.isclose(Range("force", (1.0, 100.0), "log").at(0.5), 10.0)
    choice = Range("force", (1.0, 2.0, 4.0), "choice")
    assert [choice.at(share) for share in (0.0, 0.33, 0.34, 0.67, 0.999)] == [1, 1, 2, 4, 4]


def test_a_narrowed_range_is_its_middle_and_a_narrowed_choice_its_beginning() -> None:
    uniform = Range("force", (0.0, 8.0), "uniform")
    drawn = [uniform.at(uniform.narrowed(share, 0.25)) for share in (0.0, 0.5, 1.0)]
    assert drawn == [3.0, 4.0, 5.0]
    choice = Range("force", (1.0, 2.0, 3.0, 4.0), "choice")
    assert {choice.at(choice.narrowed(k / 100, 0.5)) for k in range(100)} == {1.0, 2.0}
    assert {choice.at(choice.narrowed(k / 100, 1.0)) for k in range(100)} == {1.0, 2.0, 3.0, 4.0}
