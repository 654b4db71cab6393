"""Configs as JSON: those of before, and what JSON cannot hold."""

import json
import math

import pytest

from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.documents import _ADDED, read_values


def as_json(config):
    return json.loads(json.dumps(config.stored(), allow_nan=False))


@pytest.mark.parametrize("name", _ADDED)
def test_a_config_that_lacks_what_came_later_stands_for_the_same(name):
    config = TrainConfig(mirror=False, seed=4)
    values = as_json(config)
    del values[name]
    assert read_values(values) == config


def test_an_infinite_limit_is_a_text():
    config = TrainConfig(x_limit=math.inf, theta_limit=math.inf)
    assert as_json(config)["x_limit"] == "inf"
    assert read_values(as_json(config)) == config
    with pytest.raises(ValueError, match="start_low cannot be 'inf'"):
        read_values(as_json(config) | {"start_low": "inf"})
