"""What is seen of the world, and episodes in a fitted model of it."""

import dataclasses

import gymnasium
import numpy as np
import pytest

from mjcartpole.envs.backend import make_env
from mjcartpole.learning.dream import Dream, look
from mjcartpole.learning.fitted import Linear, Rod
from mjcartpole.rewards import minus_one_at_the_end
from mjcartpole.task import CARTPOLE_V1, SWING_UP
from nightly import at_night

REFERENCE = Rod(10 / 1.1, 0.05 / 1.1, 14.7, 1.5, 0.0, 0.02)


class Corridor(gymnasium.Env):
    """An episode of three steps; each state is the number of steps since the beginning."""

    def reset(self, **_):
        self.count = 0.0
        return np.full(4, self.count, np.float32), {}

    def step(self, action):
        assert action in (0, 1)
        self.count += 1
        return np.full(4, self.count, np.float32), 1.0, False, self.count == 3, {}


@pytest.mark.parametrize(
    ("steps", "before", "episodes"),
    [
        (-1, [0, 1, 2], 1),
        (1, [0], 1),
        (3, [0, 1, 2], 1),
        (4, [0, 1, 2, 0], 2),
        (7, [0, 1, 2, 0, 1, 2, 0], 3),
    ],
)
def test_what_is_seen_is_so_many_steps_in_as_many_episodes_as_that_takes(steps, before, episodes):
    seen, played = look(Corridor(), steps, np.random.default_rng(0))
    assert (seen.before[:, 0].tolist(), played) == (before, episodes)
    assert (seen.after == seen.before + 1).all()
    assert set(seen.actions.tolist()) <= {0, 1}


def test_random_actions_are_as_often_one_as_the_other():
    seen, _ = look(Corridor(), 3_000, np.random.default_rng(0))
    assert seen.actions.mean() == pytest.approx(0.5, abs=0.03)


@pytest.mark.parametrize("rules", [CARTPOLE_V1, dataclasses.replace(
    CARTPOLE_V1, name="dreamt", reward=minus_one_at_the_end, theta_limit=0.1, time_limit=15,
    start_low=0.0, start_high=0.02), SWING_UP])  # fmt: skip
def test_a_dream_of_the_world_as_it_is_is_the_world(rules):
    world, dream = make_env("gym", task=rules), Dream(REFERENCE, rules)
    rng = np.random.default_rng(1)
    for number in range(at_night(20, fast=4)):
        seed = 3 if number == 0 else None
        begun = [env.reset(seed=seed)[0] for env in (world, dream)]
        assert begun[0].tolist() == begun[1].tolist()
        over = False
        while not over:
            action = int(rng.integers(2))
            ours, theirs = dream.step(action), world.step(action)
            np.testing.assert_allclose(ours[0], theirs[0], atol=1e-6)
            assert ours[1:4] == pytest.approx(theirs[1:4], abs=1e-9)
            assert ours[0].dtype == theirs[0].dtype and dream.observation_space.contains(ours[0])
            over = ours[2] or ours[3]
    world.close()


def test_a_linear_dream_leaves_the_track():
    coasting = Linear((0.02, 0, 0, 0), (0, 0, 0, 1.0), (0, 0, 0, 0), (0, 0, 0, 0))
    dream = Dream(coasting, CARTPOLE_V1)
    dream.reset(seed=0)
    dream.state = (0.0, 0.0, 0.01, 0.0)
    found = [dream.step(1) for _ in range(16)]
    # x moves by 0.02 (0 + 1 + … + 15) = 2.4 m, which is still on it.
    assert found[-1][0].tolist() == pytest.approx([2.4, 16.0, 0.01, 0.0])
    assert [each[2] for each in found] == [False] * 16
    assert dream.step(1)[1:4] == (1.0, True, False)
