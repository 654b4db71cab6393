"""Episodes as generators over any gymnasium environment: the reference loop."""

import contextlib
import functools
import math
import operator
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
import numpy.typing as npt

from mjcartpole.disturbances.contexts import Chance
from mjcartpole.errors import SimulationError
from mjcartpole.learning.discretizer import folded, row_of
from mjcartpole.learning.episodes import ENDINGS, SIDES, Episode, ending_index, side_index
from mjcartpole.learning.methods.experience import Trajectory, Transition
from mjcartpole.learning.tiles import home
from mjcartpole.task import CARTPOLE_V1, most_leaning, wrapped

if TYPE_CHECKING:
    from mjcartpole.learning.learner import Learner

State = npt.NDArray[np.float64]


def learn_episodes(
    env: gymnasium.Env[Any, Any], learner: "Learner", numbers: range
) -> Iterator[Episode]:
    """Let a learner play and learn, one episode per item.

    The environment has CartPole-v1's spaces and an end to every episode, and draws its starting
    states from the generator that it has. Episodes are counted from 0, which decides what the
    schedules give.

    Raises:
        SimulationError: The physics diverged; names episode and step.
    """
    for number in numbers:
        observation, _ = env.reset()
        yield _learn_episode(env, learner, observation, number)


def _learn_episode(
    env: gymnasium.Env[Any, Any],
    learner: "Learner",
    observation: npt.NDArray[np.float32],
    number: int,
) -> Episode:
    method, p, rng, memory = learner.method, learner.p, learner.rng, learner.quick_memory()
    act, after_step, step = method.act, method.after_step, env.step
    rates = method.begin_episode(p, memory, number, learner.episodes)
    grid, tiles, visits = learner.discretizer.grid, p.tiles, learner.visits.data
    row = row_of(observation.tolist(), grid)
    s, mirrored = folded(row, grid.folding)
    states, actions, rewards = [s], list[int](), list[float]()
    over = terminated = False
    try:
        while not over:
            a = act(p, memory, rates, s, rng)
            pushed = 1 - a if mirrored else a
            visits[2 * home(tiles, row) + pushed] += 1
            observation, reward, terminated, truncated, _ = step(pushed)
            r, over = float(reward), terminated or truncated
            row = row_of(observation.tolist(), grid)
            s_next, mirrored = folded(row, grid.folding)
            after_step(p, memory, rates, Transition(s, a, r, s_next, terminated, over), rng)
            states.append(s_next)
            actions.append(a)
            rewards.append(r)
            s = s_next
    except SimulationError as error:
        raise in_episode(error, number, len(actions)) from error
    episode = Trajectory(states, actions, rewards, len(actions), terminated)
    method.after_episode(p, memory, rates, episode, rng)
    # As compiled code adds; `sum` rounds otherwise from Python 3.12 on.
    total = functools.reduce(operator.add, rewards, 0.0)
    return _ended(env, number, total, len(actions), terminated)


def lend(
    env: gymnasium.Env[Any, Any], rng: np.random.Generator, chance: Chance | None, episode: int = 0
) -> None:
    """Let an environment draw from generators of one's own, from an episode on."""
    env.unwrapped.np_random = rng
    if chance and env.has_wrapper_attr("disturber"):
        env.get_wrapper_attr("disturber").follow(rng, chance, episode)


def in_episode(error: SimulationError, number: int, steps: int) -> SimulationError:
    """Return the same error with where it happened: in which episode, after how many steps."""
    return SimulationError(f"episode {number + 1:,}, step {steps + 1}: {error}")


def play_episode(
    env: gymnasium.Env[Any, Any],
    policy: Callable[[npt.NDArray[np.float32]], int],
    *,
    number: int = 0,
    seed: int | None = None,
    start: Sequence[float] | None = None,
) -> tuple[Episode, list[State]]:
    """Play one episode without learning; return it, and its states from the first to the last.

    The policy goes from an observation, float32 of shape (4,), to an action. The episode has its
    number for the record; it begins in `start`, or in a state that is drawn, seeded if need be.
    """
    observation = env.reset(seed=seed)[0] if start is None else _begin_at(env, start)
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


def _begin_at(env: gymnasium.Env[Any, Any], start: Sequence[float]) -> npt.NDArray[np.float32]:
    """Begin an episode in a state; returns what is seen of it."""
    disturber = env.get_wrapper_attr("disturber") if env.has_wrapper_attr("disturber") else None
    with disturber.undrawn() if disturber else contextlib.nullcontext():
        env.reset()
    env.unwrapped.state = np.array(start)  # type: ignore[attr-defined]
    seen = _state_of(env)
    if math.isinf(getattr(env.unwrapped, "theta_threshold_radians", 0.0)):
        seen[2::2] = wrapped(seen[2::2])
    if disturber is None:
        return seen.astype(np.float32)
    observation: npt.NDArray[np.float32] = disturber.first(seen, "state")[0]
    return observation


def _ended(
    env: gymnasium.Env[Any, Any], number: int, total: float, steps: int, terminated: bool
) -> Episode:
    x_limit = getattr(env.unwrapped, "x_threshold", CARTPOLE_V1.x_limit)
    state = _state_of(env)
    ending = ending_index(terminated, state[0], x_limit)
    side = side_index(ending, state[0], most_leaning(state[2::2].tolist()))
    return Episode(number, total, steps, ENDINGS[ending], SIDES[side])


def _state_of(env: gymnasium.Env[Any, Any]) -> State:
    """The float64 state; both backends keep it under the same name."""
    state: State = env.unwrapped.state  # type: ignore[attr-defined]
    return np.array(state)
