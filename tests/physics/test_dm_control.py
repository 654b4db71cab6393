"""dm_control, fitted to the MuJoCo that is here."""

import sys
from importlib.metadata import version

import pytest

dm_control = pytest.importorskip("mjcartpole.physics.dm_control", exc_type=ImportError)


def test_every_array_that_it_lists_is_there():
    physics = dm_control.mujoco.Physics.from_xml_string("<mujoco/>")
    arrays = dm_control.sizes.array_sizes
    assert arrays["mjmodel"] and arrays["mjdata"]
    for name in arrays["mjmodel"]:
        getattr(physics.model, name)
    for name in arrays["mjdata"]:
        getattr(physics.data, name)


def test_only_what_mujoco_lacks_is_struck_off():
    given = {"mjmodel": {"geom_size": 3, "flex_gone": 1}, "mjdata": {"gone": 1, "qpos": 1}}
    dm_control.strike_off(given)
    assert given == {"mjmodel": {"geom_size": 3}, "mjdata": {"qpos": 1}}


def test_why_it_does_not_load_is_one_line_with_both_versions():
    said = dm_control.why_not(AttributeError("no\nsuch array"))
    pair = f"dm-control {version('dm-control')} with mujoco {version('mujoco')}"
    assert said == f"{pair} does not load: AttributeError: no such array"


@pytest.mark.parametrize(
    ("python", "words"), [((3, 12), "try: pip install dm-control"), ((3, 13), "has no wheel")]
)
def test_where_it_is_not_installed_it_says_what_would_bring_it(monkeypatch, python, words):
    monkeypatch.setattr(dm_control, "version_of", lambda name: None)
    monkeypatch.setattr(sys, "version_info", python)
    said = dm_control.why_not(ModuleNotFoundError("No module named 'dm_control'"))
    assert words in said and "\n" not in said
