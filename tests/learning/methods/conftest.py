"""A method at work on a table that a test gives."""

import numpy as np
import pytest

from mjcartpole.learning.config import DEFAULT_METHOD, TrainConfig, config_class
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.learner import Learner
from mjcartpole.learning.methods.experience import Trajectory, Transition


class AtWork(Learner):
    """A learner whose functions are called with what they need."""

    def __init__(self, table, **values):
        usual = {"alpha_final": 0.0, "epsilon_final": 0.0, "episodes": 20}
        known = config_class(values.get("method", DEFAULT_METHOD)).fields()
        config = TrainConfig(**{name: usual[name] for name in usual if name in known} | values)
        super().__init__(config, Discretizer((len(table),), (-1.0,), (1.0,)))
        self.q = self.memory[0]
        self.q[:] = np.ravel(table)
        self.begin(0)

    @property
    def table(self):
        return self.q.reshape(-1, 2).tolist()

    def begin(self, number):
        self.rates = self.method.begin_episode(self.p, self.memory, number, self.episodes)

    def act(self, s):
        return self.method.act(self.p, self.memory, self.rates, s, self.rng)

    def transition(self, s, a, r, s_next, *, terminated=False, truncated=False):
        return Transition(s, a, r, s_next, terminated, terminated or truncated)

    def step(self, *values, **ending):
        step = self.transition(*values, **ending)
        self.method.after_step(self.p, self.memory, self.rates, step, self.rng)

    def replay(self, states, actions, rewards, *, terminated):
        episode = Trajectory(states, actions, rewards, len(actions), terminated)
        self.method.after_episode(self.p, self.memory, self.rates, episode, self.rng)

    def play(self, world, episodes, seed=0):
        """Learn from episodes in a world; returns them as lists of s, a, r, s_next, terminated."""
        played, rng = [], np.random.default_rng(seed)
        for number in range(episodes):
            self.begin(number)
            s, steps, terminated = world.start, [], False
            while not terminated:
                a = self.act(s)
                r, s_next, terminated = world.step(s, a, rng)
                self.step(s, a, r, s_next, terminated=terminated)
                steps.append((s, a, r, s_next, terminated))
                s = s_next
            states = [step[0] for step in steps]
            self.replay([*states, s], *zip(*[x[1:3] for x in steps], strict=True), terminated=True)
            played.append(steps)
        return played


@pytest.fixture
def at_work():
    """Return a learner on a table; keywords are fields of the config."""
    return AtWork
