"""Rules one by one: what they may be, and what is said of what they may not."""

import math

import numpy as np
import pytest

from mjcartpole.errors import ConfigError
from mjcartpole.rewards import upright
from mjcartpole.rules import RULES, checked, number_of

UP = math.inf


@pytest.mark.parametrize(
    ("name", "given", "rule"),
    [
        ("x_limit", np.float32(0.5), 0.5),
        ("theta_limit", UP, UP),
        ("start_low", 0, 0.0),
        ("start_high", -0.0, 0.0),
        ("start_angle", -3, -3.0),
        ("reward", "upright", upright),
        ("reward", upright, upright),
        ("time_limit", 10**7, 10**7),
    ],
)
def test_what_makes_sense_is_as_a_task_has_it(name, given, rule):
    found = checked(name, given)
    assert found == rule and type(found) is type(rule)
    assert name in RULES.values()
    assert rule is upright or math.copysign(1, found) == math.copysign(1, rule)


@pytest.mark.parametrize(
    ("name", "given", "message"),
    [
        ("x_limit", 0, r"x_limit must be a number \(m\) more than 0 .* infinite, not 0"),
        ("x_limit", 1e11, "at most 1e"),
        ("x_limit", math.nan, "not nan"),
        ("theta_limit", -0.1, r"theta_limit must be a number \(rad\) more than 0"),
        ("theta_limit", "wide", "not 'wide'"),
        ("theta_limit", True, "not True"),
        ("theta_limit", 10**400, "theta_limit must be"),
        ("start_low", math.nan, r"start_low must be a number \(m, m/s, rad, rad/s\) from -1e"),
        ("start_high", UP, "start_high must be"),
        ("start_angle", [1], r"start_angle must be a number \(rad\)"),
        ("reward", "uprigth", "'uprigth' is unknown; .* did you mean 'upright'"),
        ("reward", 1.0, "reward must be one of one-per-step, .* or a function, not 1.0"),
        ("time_limit", 2.5, "max_episode_steps must be a whole number from 1 to 10,000,000"),
    ],
)
def test_what_makes_none_is_told_in_one_line(name, given, message):
    with pytest.raises(ConfigError, match=message) as told:
        checked(name, given)
    assert "\n" not in str(told.value)


def test_any_name_may_be_told():
    with pytest.raises(ConfigError, match=r"^size must be a number \(kg\) from -1e\+10 to 1e\+10"):
        number_of("size", None, "kg")
