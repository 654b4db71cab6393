"""Rewards: their names, and those that are the same number for every step."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjcartpole.rewards import CONSTANT, REWARDS

STATES = st.tuples(*[st.floats(allow_nan=False, allow_infinity=False)] * 4)


@pytest.mark.parametrize("reward", CONSTANT)
@given(state=STATES)
def test_constant_rewards_are_constant(reward, state):
    assert reward(*state, False) == CONSTANT[reward]
    assert reward(*state, True) == reward(0.0, 0.0, 0.0, 0.0, True)


def test_each_pays_what_its_name_says():
    state, over = (0.1, 0.2, math.pi / 3, 0.4), (False, True)
    paid = {name: [reward(*state, end) for end in over] for name, reward in REWARDS.items()}
    assert paid["upright"] == pytest.approx([0.75, 0.75])
    assert paid["one-per-step"] == [1.0, 1.0]
    assert paid["minus-one-at-the-end"] == [0.0, -1.0]
