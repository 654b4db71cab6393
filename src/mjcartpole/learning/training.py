"""From a `TrainConfig` to a `TrainResult`."""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import gymnasium
import numpy as np
import numpy.typing as npt

from mjcartpole import task
from mjcartpole.envs.backend import make_env
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.loop import Episode, learn_episodes
from mjcartpole.learning.policy import Policy
from mjcartpole.learning.qlearning import TabularQ
from mjcartpole.learning.schedules import LinearSchedule

LEARNER_STREAM: Final = 1
"""Spawn key of the learner's generator: its draws are independent of the env's."""


@dataclass(frozen=True, eq=False)
class TrainResult:
    """What a training, or the part of it that was done, has come to.

    Attributes:
        config: What was asked for.
        policy: The greedy policy of the final table.
        episodes: One record per episode that was finished.
        seconds: Time it took.
    """

    config: TrainConfig
    policy: Policy
    episodes: tuple[Episode, ...]
    seconds: float

    @property
    def q_table(self) -> npt.NDArray[np.float64]:
        """Action values, shape (*bins, 2)."""
        return self.policy.q_table

    @property
    def returns(self) -> npt.NDArray[np.float64]:
        """Undiscounted return of each episode, shape (episodes,)."""
        return np.array([episode.total for episode in self.episodes])

    @property
    def steps(self) -> int:
        """Environment steps of all episodes."""
        return sum(episode.steps for episode in self.episodes)


class Training:
    """A training that can be watched, and left at any episode.

    Iterating `run()` does the work; `result()` says what has been learned so far.
    """

    def __init__(self, config: TrainConfig, env: gymnasium.Env[Any, Any] | None = None) -> None:
        """Make the environment and the learner.

        Args:
            config: What to train.
            env: Trains here instead of on the config's own environment.

        Raises:
            ModelError: The model cannot be used.
        """
        self.config = config
        self.env = env or make_env(config.backend, config.model, config.integrator)
        self.learner = _make_learner(config)
        self.episodes: list[Episode] = []
        self._seconds = 0.0

    def run(self) -> Iterator[Episode]:
        """Train to the end, yielding each episode when it is over."""
        config = self.config
        started = time.perf_counter()
        for episode in learn_episodes(
            self.env,
            self.learner,
            config.discretizer,
            episodes=config.episodes,
            seed=config.seed,
        ):
            self.episodes.append(episode)
            self._seconds = time.perf_counter() - started
            yield episode
        self.env.close()

    def result(self) -> TrainResult:
        """What has been learned so far; later episodes do not change it."""
        discretizer = self.config.discretizer
        table = self.learner.q_table.reshape(*discretizer.bins, task.N_ACTIONS).copy()
        return TrainResult(
            config=self.config,
            policy=Policy(discretizer, table),
            episodes=tuple(self.episodes),
            seconds=self._seconds,
        )


def train(config: TrainConfig | None = None) -> TrainResult:
    """Train a Q-table; nothing is written.

    >>> result = train(TrainConfig.preset("tuned", backend="gym", seed=3, episodes=5))
    >>> result.q_table.shape
    (1, 3, 6, 8, 2)
    >>> len(result.returns)
    5

    Args:
        config: What to train; the preset `tuned` if left out.

    Raises:
        ModelError: The model cannot be used.
        SimulationError: The physics diverged.
    """
    training = Training(config or TrainConfig())
    for _ in training.run():
        pass
    return training.result()


def _make_learner(config: TrainConfig) -> TabularQ:
    slope = config.decay * config.episodes
    stream = np.random.SeedSequence(config.seed, spawn_key=(LEARNER_STREAM,))
    rng = np.random.default_rng(stream)
    shape = (config.discretizer.n_states, task.N_ACTIONS)
    return TabularQ(
        rng.uniform(config.q_init_low, config.q_init_high, size=shape),
        gamma=config.gamma,
        alpha=LinearSchedule(config.alpha, config.alpha_final, slope),
        epsilon=LinearSchedule(config.epsilon, config.epsilon_final, slope),
        ties=config.ties,
        learn_last_step=config.learn_last_step,
        td_lambda=config.td_lambda,
        rng=rng,
    )
