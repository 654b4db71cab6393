"""Episodes as generators over any gymnasium environment: the reference loop."""

from collections.abc import Callable, Iterator
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt

from mjcartpole.errors import SimulationError
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.episodes import ENDINGS, Episode, ending_index
from mjcartpole.learning.qlearning import TabularQ

State = npt.NDArray[np.float64]


def learn_episodes(
    env: gymnasium.Env[Any, Any],
    learner: TabularQ,
    discretizer: Discretizer,
    numbers: range,
) -> Iterator[Episode]:
    """Let a learner play and learn, one episode per item.

    Args:
        env: Any environment with CartPole-v1's spaces and an end to every episode; it draws its
            starting states from the generator that it has.
        learner: Chooses actions, and learns after each step or each episode.
        discretizer: From observations to the learner's states.
        numbers: Which episodes, counted from 0: they decide what the schedules give.

    Raises:
        SimulationError: The physics diverged; names episode and step.
    """
    learn = _learn_stepwise if learner.td_lambda is None else _learn_afterwards
    for number in numbers:
        observation, _ = env.reset()
        learner.begin_episode(number)
        yield learn(env, learner, discretizer, observation, number)


def _learn_stepwise(
    env: gymnasium.Env[Any, Any],
    learner: TabularQ,
    discretizer: Discretizer,
    observation: npt.NDArray[np.float32],
    number: int,
) -> Episode:
    """Learn after each step."""
    act, update, step = learner.act, learner.update, env.step
    learn_last_step = learner.learn_last_step
    total, steps, over, terminated = 0.0, 0, False, False
    s = discretizer(observation.tolist())
    try:
        while not over:
            a = act(s)
            observation, r, terminated, truncated, _ = step(a)
            over = terminated or truncated
            s_next = discretizer(observation.tolist())
            if learn_last_step or not over:
                update(s, a, float(r), s_next, terminated)
            total += float(r)
            steps += 1
            s = s_next
    except SimulationError as error:
        raise in_episode(error, number, steps) from error
    return _ended(env, number, total, steps, terminated)


def _learn_afterwards(
    env: gymnasium.Env[Any, Any],
    learner: TabularQ,
    discretizer: Discretizer,
    observation: npt.NDArray[np.float32],
    number: int,
) -> Episode:
    """Play an episode, then learn from all of it."""
    act, step = learner.act, env.step
    states, actions, rewards = [discretizer(observation.tolist())], [], []
    over = terminated = False
    try:
        while not over:
            a = act(states[-1])
            observation, r, terminated, truncated, _ = step(a)
            over = terminated or truncated
            actions.append(a)
            rewards.append(float(r))
            states.append(discretizer(observation.tolist()))
    except SimulationError as error:
        raise in_episode(error, number, len(actions)) from error
    if learner.learn_last_step:
        learner.replay(states, actions, rewards, terminated)
    else:
        learner.replay(states[:-1], actions[:-1], rewards[:-1], over=False)
    return _ended(env, number, sum(rewards), len(actions), terminated)


def in_episode(error: SimulationError, number: int, steps: int) -> SimulationError:
    """The same error with where it happened.

    Args:
        error: What went wrong.
        number: The episode, counted from 0.
        steps: Its steps before that.
    """
    return SimulationError(f"episode {number + 1:,}, step {steps + 1}: {error}")


def play_episode(
    env: gymnasium.Env[Any, Any],
    policy: Callable[[npt.NDArray[np.float32]], int],
    *,
    number: int = 0,
    seed: int | None = None,
) -> tuple[Episode, list[State]]:
    """Play one episode without learning.

    Args:
        env: The environment.
        policy: From an observation, float32 of shape (4,), to an action.
        number: Number of the episode, for the record.
        seed: Seeds the environment if given.

    Returns:
        The episode, and its states from the first to the last, each float64 of shape (4,).
    """
    observation, _ = env.reset(seed=seed)
    states = [_state_of(env)]
    total, over, terminated = 0.0, False, False
    try:
        while not over:
            observation, r, terminated, truncated, _ = env.step(policy(observation))
            over = terminated or truncated
            total += float(r)
            states.append(_state_of(env))
    except SimulationError as error:
        raise in_episode(error, number, len(states) - 1) from error
    return _ended(env, number, total, len(states) - 1, terminated), states


def _ended(
    env: gymnasium.Env[Any, Any], number: int, total: float, steps: int, terminated: bool
) -> Episode:
    ending = ENDINGS[ending_index(terminated, _state_of(env)[0])]
    return Episode(number, total, steps, ending)


def _state_of(env: gymnasium.Env[Any, Any]) -> State:
    """The float64 state; both backends keep it under the same name."""
    state: State = env.unwrapped.state  # type: ignore[attr-defined]
    return np.array(state)
