"""Which of many alike run in the fast set, and which at night only."""

import os

import pytest
from hypothesis import settings

FAST = "MJCARTPOLE_FAST_TESTS"
"""Set while the slow tests are left out."""


def examples(count):
    """Hypothesis settings: so many examples at night, a sixth of them in the fast set."""
    return settings(max_examples=max(5, count // 6) if FAST in os.environ else count)


def only(*fast):
    """Return a function that marks all cases but some as slow: `map(only("a", "b"), CASES)`."""
    return lambda case: case if case in fast else pytest.param(case, marks=pytest.mark.slow)
