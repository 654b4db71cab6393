"""Rung 1: what other programs see of the environment."""

from typing import Any

import gymnasium
import numpy as np

from mjcartpole import task
from mjcartpole.envs.backend import GYM_ID
from mjcartpole.envs.registration import ENV_ID
from mjcartpole.studies.parity.case import Subject
from mjcartpole.studies.parity.result import Figure, Question, Result

QUESTION = Question(
    1, "interface: spaces, metadata, registration, first observations", "equal by definition"
)

BOUNDS: tuple[dict[str, float], ...] = (
    {},
    {"low": -0.2, "high": 0.2},
    {"low": -0.01},
    {"high": 1.0},
    {"low": 0.03, "high": 0.03},
)
"""Options of `reset`."""


def interface(subject: Subject) -> Result:
    """Rung 1: spaces, metadata, registration, and the first observations of many seeds."""
    ours, gyms = subject.ours(), gymnasium.make(GYM_ID, disable_env_checker=True)
    problems = (*_declarations(ours, gyms, subject.reference.timestep), *_registration())
    seeds = 40 if subject.quick else 400
    different = sum(
        not _same_reset(ours, gyms, seed, options) for seed in range(seeds) for options in BOUNDS
    )
    figures = (
        Figure("declarations that differ", float(len(problems)), 0.0),
        Figure(f"first observations that differ ({seeds * len(BOUNDS):,})", float(different), 0.0),
    )
    return QUESTION.answer(figures, problems=tuple(problems))


def _declarations(
    ours: gymnasium.Env[Any, Any], gyms: gymnasium.Env[Any, Any], timestep: float
) -> list[str]:
    # Gymnasium's declaration stays what it is, whatever `tau` it is given.
    metadata = {**gyms.metadata, "render_fps": task.frame_rate(timestep)}
    pairs = {
        "observation_space": (ours.observation_space, gyms.observation_space),
        "action_space": (ours.action_space, gyms.action_space),
        "metadata": (ours.metadata, metadata),
    }
    return _unequal(pairs)


def _registration() -> list[str]:
    ours, gyms = gymnasium.spec(ENV_ID), gymnasium.spec(GYM_ID)
    names = ("max_episode_steps", "reward_threshold", "nondeterministic", "order_enforce")
    return _unequal({name: (getattr(ours, name), getattr(gyms, name)) for name in names})


def _unequal(pairs: dict[str, tuple[Any, Any]]) -> list[str]:
    return [f"{name} {a} instead of {b}" for name, (a, b) in pairs.items() if a != b]


def _same_reset(
    ours: gymnasium.Env[Any, Any],
    gyms: gymnasium.Env[Any, Any],
    seed: int,
    options: dict[str, float],
) -> bool:
    (a, our_info), (b, its_info) = (env.reset(seed=seed, options=options) for env in (ours, gyms))
    states = [env.unwrapped.state for env in (ours, gyms)]  # type: ignore[attr-defined]
    same_state = np.array_equal(*states) and states[0].dtype == states[1].dtype
    return bool(a.dtype == b.dtype and np.array_equal(a, b) and our_info == its_info and same_state)
