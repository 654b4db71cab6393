"""Episodes as generators over any gymnasium environment: the reference loop."""

from collections.abc import Callable, Iterator
from typing import Any, Literal, NamedTuple

import gymnasium
import numpy as np
import numpy.typing as npt

from mjcartpole import task
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.qlearning import TabularQ

Ending = Literal["time limit", "off the track", "pole fell"]
ENDINGS: tuple[Ending, ...] = ("time limit", "off the track", "pole fell")

State = npt.NDArray[np.float64]


class Episode(NamedTuple):
    """What one episode came to."""

    number: int
    total: float
    """Undiscounted return."""
    steps: int
    ending: Ending


def ending_of(terminated: bool, state: State) -> Ending:
    """Why an episode ended, from its last state `(x, x_dot, theta, theta_dot)`."""
    if not terminated:
        return "time limit"
    return "off the track" if abs(state[0]) > task.X_LIMIT else "pole fell"


def learn_episodes(
    env: gymnasium.Env[Any, Any],
    learner: TabularQ,
    discretizer: Discretizer,
    *,
    episodes: int,
    seed: int,
) -> Iterator[Episode]:
    """Let a learner play and learn, one episode per item.

    Args:
        env: Any environment with CartPole-v1's spaces and an end to every episode.
        learner: Chooses actions, and learns after each step.
        discretizer: From observations to the learner's states.
        episodes: How many.
        seed: Seeds the environment before the first episode; later ones go on from there.
    """
    for number in range(episodes):
        observation, _ = env.reset(seed=seed if number == 0 else None)
        learner.begin_episode(number)
        if learner.td_lambda is None:
            yield _learn_stepwise(env, learner, discretizer, observation, number)
        else:
            yield _learn_afterwards(env, learner, discretizer, observation, number)


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
    return Episode(number, total, steps, ending_of(terminated, _state_of(env)))


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
    while not over:
        a = act(states[-1])
        observation, r, terminated, truncated, _ = step(a)
        over = terminated or truncated
        actions.append(a)
        rewards.append(float(r))
        states.append(discretizer(observation.tolist()))
    if learner.learn_last_step:
        learner.replay(states, actions, rewards, terminated)
    else:
        learner.replay(states[:-1], actions[:-1], rewards[:-1], over=False)
    ending = ending_of(terminated, _state_of(env))
    return Episode(number, sum(rewards), len(actions), ending)


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
    while not over:
        observation, r, terminated, truncated, _ = env.step(policy(observation))
        over = terminated or truncated
        total += float(r)
        states.append(_state_of(env))
    return Episode(number, total, len(states) - 1, ending_of(terminated, states[-1])), states


def _state_of(env: gymnasium.Env[Any, Any]) -> State:
    """The float64 state; both backends keep it under the same name."""
    state: State = env.unwrapped.state  # type: ignore[attr-defined]
    return np.array(state)
