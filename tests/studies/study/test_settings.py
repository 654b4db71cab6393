"""What a study may set: whatever a training has, and edits."""

import dataclasses
import doctest

import pytest

from mjcartpole.errors import ConfigError
from mjcartpole.learning.config import config_class
from mjcartpole.learning.methods import METHODS
from mjcartpole.studies.study import settings
from mjcartpole.studies.study.settings import (
    check_setting,
    config_of,
    is_number,
    is_whole,
    kinds,
    read_value,
)


def test_the_examples():
    assert doctest.testmod(settings).attempted == 3


def test_every_field_of_every_method_is_a_setting_but_for_the_seed():
    fields = {name for method in METHODS for name in config_class(method).fields()}
    assert set(kinds()) == fields - {"seed"} | {"preset"}


@pytest.mark.parametrize("method", METHODS)
def test_the_values_of_a_config_are_read_back_as_they_are(method):
    config = config_class(method)()
    values = {name: config.values()[name] for name in kinds() if name in config.fields()}
    for name, value in values.items():
        written = "none" if value in (None, ()) else value
        written = list(value) if isinstance(value, tuple) and value else written
        assert read_value(name, written) == value
    assert config_of({}, values, 3) == dataclasses.replace(config, seed=3)


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("alpha", "x", "alpha must be a number, not 'x'"),
        ("episodes", 1.5, "episodes must be a whole number, not 1.5"),
        ("mirror", 1, "mirror must be true or false or 'none', not 1"),
        ("bins", [1, "x"], r"bins must be a list, each a whole number, not \[1, 'x'\]"),
        ("backend", "moon", "backend must be one of mujoco, gym, not 'moon'"),
        ("pole.length", "long", "pole.length must be a number"),
        ("pole.length", True, "pole.length must be a number or a text, not True"),
        ("pole.length", [1], "pole.length must be a number or a text"),
    ],
)
def test_a_value_of_another_kind_is_refused(name, value, said):
    with pytest.raises(ConfigError, match=said):
        read_value(name, value)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("alpa", "nothing is called 'alpa'; did you mean alpha"),
        ("seed", r"\[study\] has seeds = 6"),
        ("pole.lenght", "did you mean 'pole.length'"),
        ("joint:hinge.dampnig", "has no attribute 'dampnig'"),
        ("qqqq", "known are preset, "),
    ],
)
def test_a_name_that_nothing_has_is_refused(name, said):
    with pytest.raises(ConfigError, match=said):
        check_setting(name)


def test_edits_and_numbers_have_ranges():
    assert is_number("pole.length") and is_number("alpha") and is_number("until")
    assert not is_number("bins") and not is_number("method") and not is_number("mirror")
    assert is_whole("episodes") and is_whole("max_episode_steps")
    assert not is_whole("alpha") and not is_whole("gravity")


def test_what_a_point_gives_goes_before_what_all_have():
    config = config_of({"alpha": 0.1, "episodes": 7}, {"alpha": 0.2, "pole.length": 1.0}, 4)
    assert (config.alpha, config.episodes, config.seed, config.set) == (
        0.2,
        7,
        4,
        ("pole.length=1.0",),
    )


def test_an_edit_replaces_that_of_the_preset_and_leaves_the_others():
    assert config_of({"preset": "damped"}, {"gravity": 5}, 0).set == (
        "hinge.damping=0.5",
        "gravity=5",
    )
    assert config_of({"preset": "damped", "hinge.damping": 0.1}, {}, 0).set == (
        "hinge.damping=0.1",
    )
    base = {"set": ("gravity=3", "pole.mass=0.2")}
    assert config_of(base, {"force": 5}, 0).set == (
        "gravity=3.0",
        "pole.mass=0.2",
        "force=5",
    )
    for here, there in ((base, {"gravity": 5}), ({"gravity": 5}, base)):
        with pytest.raises(ConfigError, match="gravity stands in set and by itself; give it once"):
            config_of(here, there, 0)


def test_a_method_takes_of_the_base_what_it_has_and_refuses_what_a_point_gives():
    base = {"alpha": 0.1, "episodes": 9}
    assert config_of(base, {"method": "planning"}, 0).episodes == 9
    with pytest.raises(ConfigError, match="method 'planning' has no alpha"):
        config_of({}, {"method": "planning", "alpha": 0.1}, 0)
