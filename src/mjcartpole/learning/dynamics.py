"""What a step does in any state, from the equations themselves, for methods that plan."""

from typing import Any

import numpy as np
import numpy.typing as npt

from mjcartpole.integrator import Integrator
from mjcartpole.learning.methods.experience import Dynamics, Vector
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.cartpole_v1 import FORCE, cartpole_v1_step
from mjcartpole.physics.simulation import Simulation, check_sane
from mjcartpole.task import Task, worst_pole


def dynamics_of(cartpole: CartPole | None, integrator: Integrator, task: Task) -> Dynamics:
    """Return what a step does; of many states, for each anew. Without a model: CartPole-v1's."""
    simulation = None if cartpole is None else Simulation(cartpole, integrator)

    def dynamics(states: Vector, action: int) -> tuple[Vector, Vector, npt.NDArray[np.bool_]]:
        if simulation is None:
            step: Any = cartpole_v1_step  # of floats, and as well of arrays
            after = np.array(step(*states.T, (-FORCE, FORCE)[action])).T
        else:
            control = simulation.cartpole.controls[action]
            after = simulation.steps(states, np.full(len(states), control))
        rewards, ended = np.empty(len(after)), np.empty(len(after), np.bool_)
        for index, state in enumerate(after.tolist()):
            check_sane(state, "CartPole-v1" if simulation is None else simulation.cartpole.name)
            seen = worst_pole(state)
            ended[index] = task.has_ended(seen[0], seen[2])
            rewards[index] = task.reward(*seen, ended[index])
        return after, rewards, ended

    return dynamics
