"""Which of many alike run in the fast set, which take a while, and which run at night only."""

import os

import pytest
from hypothesis import settings
from hypothesis import strategies as st

FAST = "MJCARTPOLE_FAST_TESTS"
"""Set while the slow tests are left out."""


def examples(count):
    """Hypothesis settings: so many examples at night, a sixth of them in the fast set."""
    return settings(max_examples=at_night(count, fast=max(5, count // 6)))


def at_night(count, *, fast):
    """So many at night, fewer in the fast set."""
    return fast if FAST in os.environ else count


def characters(*, control=True):
    """Characters of texts: of all Unicode at night, for to list it takes seconds."""
    some = "a1 <>&\"';=/ä→文🂡\u00a0\u2028" + "\n\t\0" * control
    every = st.characters(codec="utf-8", exclude_categories=[] if control else ["C"])
    return at_night(every, fast=st.sampled_from(some))


def few(cases, *fast, long=()):
    """Return cases for parametrize: some are fast, some take a while, the others run at night."""
    others = ((case, pytest.mark.long if case in long else pytest.mark.slow) for case in cases)
    return [case if case in fast else _marked(case, mark) for case, mark in others]


def _marked(case, mark):
    values = case if isinstance(case, tuple) else (case,)
    return pytest.param(*values, marks=mark)
