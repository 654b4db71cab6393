"""Shoves of the cart."""

import pytest

from mjcartpole.disturbances.shoves import Shove, parse_shove
from mjcartpole.errors import ConfigError
from mjcartpole.task import CARTPOLE_V1


def test_a_shove_is_read_and_written() -> None:
    assert parse_shove("5@2s") == Shove(5.0, 2.0, None)
    assert parse_shove(" -0.5@~4 ") == Shove(-0.5, None, 4.0)
    for text in ("5@2s", "-0.25@0s", "0.5@~4s"):
        assert parse_shove(text).text == text


@pytest.mark.parametrize(
    "text", ["5", "@2s", "5@", "0@2s", "5@-1s", "5@~0s", "nan@2s", "5@inf", "1e7@2", 3, None]
)
def test_what_is_no_shove_is_refused(text: object) -> None:
    with pytest.raises(ConfigError, match="is none; give N s @ seconds"):
        parse_shove(text)


def test_an_impulse_is_a_force_during_one_control_step() -> None:
    assert parse_shove("0.5@2s").row(0.02, CARTPOLE_V1) == (25.0, 100.0, 0.0)
    assert parse_shove("0.5@~4s").row(0.02, CARTPOLE_V1) == (25.0, -1.0, 0.005)


def test_a_shove_that_no_episode_meets_is_refused() -> None:
    with pytest.raises(ConfigError, match="after the end of every episode of CartPole-v1"):
        parse_shove("5@10s").row(0.02, CARTPOLE_V1)
    assert parse_shove("5@9.98s").row(0.02, CARTPOLE_V1)[1] == 499
    with pytest.raises(ConfigError, match="more than once a control step"):
        parse_shove("5@~0.01s").row(0.02, CARTPOLE_V1)
