"""The value that holds all disturbances."""

import dataclasses
import json
from typing import Any

import pytest

from mjcartpole.disturbances.disturbances import NONE, Disturbances
from mjcartpole.errors import ConfigError
from mjcartpole.task import CARTPOLE_V1

SOME: dict[str, Any] = {
    "vary": {"pole.length": (0.5, 1.5)},
    "pool": 5,
    "widen": 10,
    "delay": 2,
    "hold": 0.1,
    "drop": 0.2,
    "lag": 0.05,
    "force_noise": 1.0,
    "push": ["0.5@2s", "0.1@~4s"],
    "sensor_delay": 3,
    "noise": 0.01,
    "bias": (0.1, 0, 0, 0),
    "quantize": (0.1, 0.2, 0.3, 0.4),
    "observe_actions": 2,
    "observe_context": True,
}


def test_there_is_an_example_of_each() -> None:
    assert set(SOME) == {field.name for field in dataclasses.fields(Disturbances)}
    assert Disturbances(**SOME).given.keys() == SOME.keys()


def test_a_value_is_its_own_repr_and_survives_json() -> None:
    some = Disturbances(**SOME)
    assert eval(repr(some)) == some
    assert Disturbances(**json.loads(json.dumps(some.given))) == some
    assert Disturbances.of(some) == some
    assert some.are_some
    assert not NONE.are_some
    assert repr(NONE) == "Disturbances()"


@pytest.mark.parametrize("name", ["noise", "bias", "quantize"])
def test_zeros_are_as_good_as_nothing(name: str) -> None:
    assert Disturbances(**{name: 0.0}) == NONE == Disturbances(**{name: (0, 0, 0, 0)})


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"delay": -1}, "delay must be a whole number from 0"),
        ({"delay": 1.5}, "delay must be a whole number"),
        ({"delay": True}, "delay must be a whole number"),
        ({"sensor_delay": "2"}, "sensor_delay must be a whole number"),
        ({"observe_actions": 9}, "from 0 to 8"),
        ({"hold": 1.1}, "hold must be from 0 to 1"),
        ({"drop": -0.1}, "drop must be from 0 to 1"),
        ({"lag": float("nan")}, "lag must be from 0"),
        ({"quantize": 1e-9}, "quantize must be 0, or 1e-06 or more"),
        ({"hold": float("nan")}, "hold must be from 0 to 1"),
        ({"force_noise": -1}, "force_noise must be from 0"),
        ({"noise": -0.1}, "noise must be 0 or more"),
        ({"noise": (1, 2)}, "one each for x, x_dot, theta, theta_dot"),
        ({"noise": "a"}, "one number, or four"),
        ({"noise": {"x": 1}}, "one number, or four"),
        ({"bias": float("inf")}, "bias must be a number"),
        ({"quantize": (0.1, 0.1, -0.1, 0.1)}, "quantize must be 0 or more"),
        ({"push": "x"}, "push 'x' is none"),
        ({"pool": 5}, "nothing varies; give vary"),
        ({"widen": 5}, "nothing varies; give vary"),
        ({"observe_context": True}, "nothing varies; give vary"),
        ({"observe_context": 1}, "True or False"),
    ],
)
def test_what_makes_no_sense_is_refused(given: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        Disturbances(**given)


@pytest.mark.parametrize("name", ["delay", "sensor_delay"])
def test_a_delay_is_shorter_than_an_episode(name: str) -> None:
    Disturbances(**{name: 499}).check_fits(CARTPOLE_V1)
    with pytest.raises(ConfigError, match="no shorter than an episode of CartPole-v1"):
        Disturbances(**{name: 500}).check_fits(CARTPOLE_V1)


def test_numbers_of_several_poles() -> None:
    effects, memory = Disturbances(noise=(1, 2, 3, 4)).effects(2, 0.02, CARTPOLE_V1)
    assert memory[effects.constants :][:6] == [1, 2, 3, 4, 3, 4]
    with pytest.raises(ConfigError, match="a model whose states have 4"):
        Disturbances(noise=(1, 2, 3, 4, 5, 6)).effects(1, 0.02, CARTPOLE_V1)


def test_what_tells_left_from_right() -> None:
    assert Disturbances(bias=0.1).one_sided == "bias"
    assert Disturbances(push="1@2s").one_sided == "push"
    assert not Disturbances(push="1@~2s", noise=0.1, delay=2).one_sided


def test_nothing_is_a_word_for_ranges_and_shoves() -> None:
    some = Disturbances(push="1@2s", vary="force=8:12")
    assert dataclasses.replace(some, push="none", vary=("none",)) == NONE


def test_what_is_taken_from_other_settings() -> None:
    settings: dict[str, Any] = {"delay": 2, "noise": None, "x_limit": 1.0}
    assert Disturbances.taken_from(settings, {"lag": 0.1}) == Disturbances(delay=2, lag=0.1)
    assert settings == {"x_limit": 1.0}
    with pytest.raises(TypeError, match="'delya'; did you mean 'delay'"):
        Disturbances.taken_from({"delya": 1})
    with pytest.raises(ConfigError, match="disturbances are a mapping"):
        Disturbances.taken_from({}, 3)  # type: ignore[arg-type]
