"""The reference loop against the same thing written out."""

from itertools import pairwise
from types import SimpleNamespace

import gymnasium
import numpy as np
import pytest

from mjcartpole.envs.backend import make_env
from mjcartpole.errors import SimulationError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.loop import learn_episodes, play_episode
from mjcartpole.learning.presets import PRESETS
from mjcartpole.learning.training import Training
from mjcartpole.task import CARTPOLE_V1


def test_playing_records_every_state_from_first_to_last():
    env = make_env("mujoco")
    episode, states = play_episode(env, lambda observation: 1, seed=4)
    assert episode.steps == len(states) - 1 == episode.total
    first, _ = env.reset(seed=4)
    np.testing.assert_array_equal(states[0].astype(np.float32), first)
    for state, following in pairwise(states):
        assert not CARTPOLE_V1.has_ended(state[0], state[2])
        # Explicit Euler: the new position is the old one and the old velocity.
        assert following[0] == state[0] + 0.02 * state[1]
    assert CARTPOLE_V1.has_ended(states[-1][0], states[-1][2])


def articles_code(episodes, seed, *, terminal):
    """The article's loop as printed, but for the generator, the clipping and gymnasium's API."""
    config = TrainConfig.preset("article", backend="gym", seed=seed, episodes=episodes)
    env = gymnasium.make("CartPole-v1")
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(1,)))
    ranges = np.array([float(env.observation_space.high[2]), 3.5])
    width = ranges * 2 / 25
    table = rng.uniform(0, 1, size=(25 * 25, 2)).reshape(25, 25, 2)
    returns = []

    def cell(state):
        trimmed = state[2:].astype(np.float64)
        return tuple(np.clip(np.floor((trimmed + ranges) / width), 0, 24).astype(int))

    for episode in range(episodes):
        epsilon = 0.1 * (1 - min(1, episode / (episodes / 2)))
        state, _ = env.reset(seed=seed if episode == 0 else None)
        s, done, total = cell(state), False, 0.0
        while not done:
            action = int(rng.random() * 2) if rng.random() < epsilon else int(np.argmax(table[s]))
            state, reward, terminated, truncated, _ = env.step(action)
            done, s_next = terminated or truncated, cell(state)
            if not done:
                new = reward + 0.95 * np.max(table[s_next])
                table[s][action] = 0.9 * table[s][action] + 0.1 * new
            elif terminal and terminated:
                table[s][action] = 0.9 * table[s][action] + 0.1 * reward
            total += reward
            s = s_next
        returns.append(total)
    return config, table, returns


@pytest.mark.parametrize("engine", ["python", "compiled"])
@pytest.mark.parametrize("preset", ["article", "article-terminal"])
def test_the_article_presets_do_what_the_articles_code_does(preset, engine):
    terminal = preset == "article-terminal"
    config, table, returns = articles_code(150, seed=5, terminal=terminal)
    config = TrainConfig(
        **{**PRESETS[preset], "backend": "gym", "seed": 5, "episodes": config.episodes}
    )
    training = Training(config, engine=engine)
    for _ in training.run():
        pass
    assert [episode.total for episode in training.log] == returns
    # (1 - a) q + a t and q + a (t - q) round differently: equal to the last digits only.
    np.testing.assert_allclose(training.result().q_table[0, 0], table, rtol=1e-12)


class Recorder:
    """Stands in for a learner and its method, pushes to the right, and keeps what it is taught."""

    rng = None
    episodes = 9
    discretizer = Discretizer((4,), (0.0,), (4.0,))

    def __init__(self):
        self.method = self
        self.p = SimpleNamespace(tiles=None)
        self.visits = np.zeros(8, np.int64)
        self.steps, self.whole, self.begun = [], [], []

    def quick_memory(self):
        return "memory"

    def begin_episode(self, p, memory, number, episodes):
        assert (memory, episodes) == ("memory", 9)
        self.begun.append(number)
        self.steps.append([])
        return "rates"

    def act(self, p, memory, rates, s, rng):
        return 1

    def after_step(self, p, memory, rates, step, rng):
        assert rates == "rates"
        self.steps[-1].append(tuple(step))

    def after_episode(self, p, memory, rates, episode, rng):
        self.whole.append(tuple(episode))


class ThreeSteps(gymnasium.Env):
    """Ends after three steps, by its rules or by a time limit."""

    observation_space = gymnasium.spaces.Box(-10, 10, (1,), dtype=np.float32)
    action_space = gymnasium.spaces.Discrete(2)

    def __init__(self, terminates):
        self.terminates = terminates

    @property
    def state(self):
        return np.array([self.count, 0.0, 0.0, 0.0])

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.count = 0
        return np.array([0], np.float32), {}

    def step(self, action):
        self.count += 1
        over = self.count == 3
        observation = np.array([self.count], np.float32)
        return observation, 1.0, over and self.terminates, over and not self.terminates, {}


@pytest.mark.parametrize("terminates", [True, False])
def test_what_a_method_is_taught(terminates):
    learner = Recorder()
    episodes = list(learn_episodes(ThreeSteps(terminates), learner, range(5, 7)))
    # Truncated is not terminated: the learner may bootstrap.
    steps = [
        (0, 1, 1.0, 1, False, False),
        (1, 1, 1.0, 2, False, False),
        (2, 1, 1.0, 3, terminates, True),
    ]
    assert learner.steps == [steps] * 2
    assert learner.whole == [([0, 1, 2, 3], [1, 1, 1], [1.0] * 3, 3, terminates)] * 2
    assert learner.visits.tolist() == [0, 2, 0, 2, 0, 2, 0, 0]
    assert learner.begun == [5, 6], "the schedules see the numbers that were asked for"
    assert [(episode.number, episode.total, episode.steps) for episode in episodes] == [
        (5, 3.0, 3),
        (6, 3.0, 3),
    ]


class Diverging(ThreeSteps):
    """Its physics diverge in the second step of the second episode."""

    episodes = 0

    def reset(self, *, seed=None, options=None):
        self.episodes += 1
        return super().reset(seed=seed)

    def step(self, action):
        if (self.episodes, self.count) == (2, 1):
            raise SimulationError("the simulation diverged")
        return super().step(action)


def test_diverging_physics_are_named_by_episode_and_step():
    episodes = learn_episodes(Diverging(True), Recorder(), range(1_300, 1_400))
    assert next(episodes).number == 1_300
    with pytest.raises(SimulationError, match=r"^episode 1,302, step 2: the simulation diverged$"):
        next(episodes)


def test_a_played_episode_names_its_number_where_physics_diverge():
    env = Diverging(True)
    play_episode(env, lambda observation: 1)
    with pytest.raises(SimulationError, match=r"^episode 8, step 2: the simulation diverged$"):
        play_episode(env, lambda observation: 1, number=7)
