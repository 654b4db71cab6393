"""The exception tree."""

import doctest
import inspect

import pytest

from mjcartpole import errors
from mjcartpole.errors import ConfigError, RenderError, check_known

CLASSES = [
    cls
    for _, cls in inspect.getmembers(errors, inspect.isclass)
    if cls.__module__ == errors.__name__
]


def test_all_errors_share_one_base():
    assert len(CLASSES) == 16
    assert all(issubclass(cls, errors.MjCartPoleError) for cls in CLASSES)


def test_errors_that_callers_of_gymnasium_expect():
    assert issubclass(errors.InvalidActionError, AssertionError)
    assert issubclass(errors.ResetNeededError, AssertionError)
    assert issubclass(errors.ConfigError, ValueError)
    assert issubclass(errors.ModelError, ValueError)
    assert issubclass(errors.SettingError, AttributeError)


def test_the_drawing_names_every_class():
    for cls in CLASSES:
        assert cls.__name__ in (errors.__doc__ or ""), cls


def test_a_bad_checkpoint_is_a_run_that_cannot_be_used():
    assert issubclass(errors.CheckpointError, errors.RunError)
    assert issubclass(errors.RunError, errors.FileError)
    assert issubclass(errors.PolicyFileError, errors.FileError)


def test_a_name_that_is_known_passes():
    check_known("task", "one", {"one": 1, "two": 2})


@pytest.mark.parametrize("name", ["three", "", None, ["one"]])
def test_an_unknown_name_is_told_with_those_there_are(name):
    with pytest.raises(ConfigError) as caught:
        check_known("task", name, {"one": 1, "two": 2})
    assert str(caught.value) == f"task {name!r} is unknown; available: one, two"


def test_the_nearest_name_is_told():
    with pytest.raises(ConfigError, match=r"available: one, three; did you mean 'three'\?$"):
        check_known("task", "tree", ("one", "three"))


def test_an_unknown_name_is_the_error_that_was_asked_for():
    with pytest.raises(RenderError, match="rung 7 is unknown; available: 1, 2"):
        check_known("rung", 7, (1, 2), RenderError)


def test_doctests():
    assert doctest.testmod(errors).failed == 0
