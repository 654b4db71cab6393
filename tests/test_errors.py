"""The exception tree."""

import inspect

from mjcartpole import errors


def test_all_errors_share_one_base():
    classes = [cls for _, cls in inspect.getmembers(errors, inspect.isclass)]
    assert len(classes) == 16
    assert all(issubclass(cls, errors.MjCartPoleError) for cls in classes)


def test_errors_that_callers_of_gymnasium_expect():
    assert issubclass(errors.InvalidActionError, AssertionError)
    assert issubclass(errors.ResetNeededError, AssertionError)
    assert issubclass(errors.ConfigError, ValueError)
    assert issubclass(errors.ModelError, ValueError)
    assert issubclass(errors.SettingError, AttributeError)


def test_the_drawing_names_every_class():
    for name, cls in inspect.getmembers(errors, inspect.isclass):
        assert name in (errors.__doc__ or ""), cls


def test_a_bad_checkpoint_is_a_run_that_cannot_be_used():
    assert issubclass(errors.CheckpointError, errors.RunError)
    assert issubclass(errors.RunError, errors.FileError)
    assert issubclass(errors.PolicyFileError, errors.FileError)
