"""Scores and settings that statistics cannot use: one line says what is wrong."""

import re

import numpy as np
import pytest

from mjcartpole.errors import ConfigError
from mjcartpole.studies.statistics import (
    aggregate,
    bootstrap_interval,
    improvement_interval,
    iqm,
    probability_of_improvement,
)

USERS = {
    "iqm": iqm,
    "interval": bootstrap_interval,
    "x": lambda scores: probability_of_improvement(scores, [1.0]),
    "y": lambda scores: improvement_interval([1.0], scores),
    "aggregate": lambda scores: aggregate(scores, solved_at=1),
}


@pytest.mark.parametrize("use", USERS.values(), ids=USERS)
@pytest.mark.parametrize(
    ("scores", "message"),
    [
        ([], r"at least one of each; found (0,)"),
        ([[], []], r"found (2, 0)"),
        (3.0, r"found ()"),
        ([[[1.0]]], r"found (1, 1, 1)"),
        ([1.0, np.nan, np.inf], r"must be finite; 2 of 3 are not, the first is nan in run 1"),
        ([[1.0, 2.0], [3.0, -np.inf]], r"1 of 4 are not, the first is -inf in run 1"),
        ([[1.0, 2.0], [3.0]], r"must be numbers, as many for each run"),
        (["high"], r"must be numbers"),
        ([10**400], r"must be numbers"),
    ],
)
def test_scores_that_cannot_be_used(use, scores, message):
    with pytest.raises(ConfigError, match=re.escape(message)) as caught:
        use(scores)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        *[({"confidence": c}, "between 0 and 1") for c in (0, 1, -0.1, 95, float("nan"))],
        ({"resamples": 0}, "from 1 up, not 0"),
        ({"resamples": -5}, "from 1 up, not -5"),
        ({"seed": -1}, "from 0 up, not -1"),
    ],
)
def test_settings_that_make_no_sense(settings, message):
    with pytest.raises(ConfigError, match=message):
        bootstrap_interval([1.0, 2.0], **settings)
    with pytest.raises(ConfigError, match=message):
        improvement_interval([1.0, 2.0], [1.0], **settings)


@pytest.mark.parametrize(
    ("x", "y"), [([[1.0, 2.0]], [[1.0]]), ([1.0], [[1.0]]), ([[1.0]], [1.0, 2.0])]
)
def test_different_tasks_cannot_be_compared(x, y):
    for compare in (probability_of_improvement, improvement_interval):
        with pytest.raises(ConfigError, match="same tasks"):
            compare(x, y)


@pytest.mark.parametrize("solved_at", [float("nan"), float("inf")])
def test_a_threshold_is_finite(solved_at):
    with pytest.raises(ConfigError, match="solved_at must be a finite number"):
        aggregate([1.0], solved_at=solved_at)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_statistic_is_finite(value):
    with pytest.raises(ConfigError, match="statistic is not finite"):
        bootstrap_interval([1.0, 2.0], lambda sample: value)
