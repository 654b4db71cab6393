"""What is worked out ahead of an action is the step itself, bit for bit."""

import numba
import numpy as np

from mjcartpole.learning import ahead, compiled, kinds, stepping
from mjcartpole.task import CARTPOLE_V1

RULES = compiled._rules(CARTPOLE_V1)
GYM = kinds.GymPhysics(-10.0, 10.0, 0.0)


@numba.njit(error_model="numpy")
def both(physics, rules, states, actions):
    """Fill one table by `advance`, and the other by what was foreseen."""
    state = same = stepping.put(physics, rules, states[0, 0])
    known = ahead.foresee(physics, same)
    for number, action in enumerate(actions):
        state = stepping.advance(physics, rules, state, action)
        same, known = ahead.go_on(physics, rules, same, action, known)
        for place in range(4):
            states[0, number + 1, place] = state[place]
            states[1, number + 1, place] = same[place]


def test_both_are_the_same_bits():
    rng = np.random.default_rng(0)
    for start in rng.uniform(-0.5, 0.5, (100, 4)):
        states = np.zeros((2, 41, 4))
        states[:, 0] = start
        both(GYM, RULES, states, rng.integers(2, size=40))
        assert states[0].tobytes() == states[1].tobytes()
        assert np.isfinite(states).all() and len(np.unique(states[0, :, 3])) > 30
