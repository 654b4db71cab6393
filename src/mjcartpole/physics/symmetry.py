"""Mirror symmetry: whether left and right are alike, for a cart-pole and for the rules.

Where they are, a state and an action teach the same as their mirror images: `-s` and the other
action (Zinkevich and Balch, 2001, call a learning problem with such a map symmetric).
"""

import math
from typing import Final

import numpy as np

from mjcartpole.errors import ConfigError
from mjcartpole.integrator import Integrator
from mjcartpole.physics.cartpole import CartPole, Vector
from mjcartpole.physics.simulation import Simulation
from mjcartpole.rewards import CONSTANT
from mjcartpole.task import CARTPOLE_V1, Task, state_names, worst_pole

SAMPLES: Final = 64

LARGEST_GAP: Final = 1e-6
"""Between a step and the mirror image of its mirror image, relative to what it changes; rounding
and MuJoCo's solver leave less."""

_FASTEST: Final = 3.0
"""Of the states that are looked at, m/s and rad/s."""

_BEYOND: Final = 1.05
"""Times the limits that end an episode: its last step may pass them."""


def check_symmetric(
    cartpole: CartPole | None, integrator: Integrator = "gym", *, task: Task = CARTPOLE_V1
) -> None:
    """Refuse a cart-pole (None: gymnasium's own), or rules, that tell left from right.

    Raises:
        ConfigError: They do; says where they part.
        SimulationError: The physics diverged.
    """
    states = _sampled(1 if cartpole is None else cartpole.poles, task)
    if task.reward not in CONSTANT:
        _check_reward(states, task)
    if cartpole is not None:
        _check_steps(Simulation(cartpole, integrator), states)


def _sampled(poles: int, task: Task) -> Vector:
    """Return states within the rules' limits, and upright rest; shape (SAMPLES, 2 + 2 poles)."""
    x = min(task.x_limit, 2 * CARTPOLE_V1.x_limit)
    theta = min(task.theta_limit, math.pi)
    bound = np.array([x * _BEYOND, _FASTEST, *[theta * _BEYOND, _FASTEST] * poles])
    states = np.random.default_rng(0).uniform(-bound, bound, (SAMPLES, bound.size))
    states[0] = 0.0
    return states


def _check_reward(states: Vector, task: Task) -> None:
    for state in states:
        here, there = worst_pole(state.tolist()), worst_pole((-state).tolist())
        for terminated in (False, True):
            rewards = task.reward(*here, terminated), task.reward(*there, terminated)
            if not math.isclose(*rewards, rel_tol=LARGEST_GAP, abs_tol=LARGEST_GAP):
                raise ConfigError(
                    f"mirror needs rules that treat left and right alike; {task.name} rewards "
                    f"{_in_words(state)} with {rewards[0]:.6g} and its mirror image with "
                    f"{rewards[1]:.6g}"
                )


def _check_steps(simulation: Simulation, states: Vector) -> None:
    right = np.full(len(states), simulation.cartpole.controls[1])
    left = np.full(len(states), simulation.cartpole.controls[0])
    here, there = simulation.steps(states, right), simulation.steps(-states, left)
    gap, change = np.abs(here + there), np.abs(here - states) + np.abs(there + states)
    apart = gap > LARGEST_GAP * (change + LARGEST_GAP)  # A NaN is told of when it is met.
    if apart.any():
        # Upright rest comes first: it says most to a person.
        index = int(np.argmax(apart.any(axis=1)))
        place = int(np.argmax(np.where(apart[index], gap[index], -1.0)))
        name = state_names(simulation.cartpole.poles)[place]
        raise ConfigError(
            f"mirror needs a model that moves alike to the left and to the right; "
            f"{simulation.cartpole.name} does not: pushed to the right from "
            f"{_in_words(states[index])}, {name} becomes {here[index, place]:.6g}, and pushed to "
            f"the left from its mirror image {there[index, place]:.6g}; leave out mirror, or look "
            "at wind, gravity, the ranges of joints and controls, springs and the pole's centre"
        )


def _in_words(state: Vector) -> str:
    if not state.any():
        return "upright rest"
    names = state_names(len(state) // 2 - 1)
    return ", ".join(f"{name} {value:.3g}" for name, value in zip(names, state, strict=True))
