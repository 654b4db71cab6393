"""Which bodies of a model are the cart's, and which each pole's."""

import mujoco
import numpy as np

from mjcartpole.physics.cartpole import CartPole, Vector
from mjcartpole.task import Task


def subtree(model: mujoco.MjModel, root: int) -> list[int]:
    """Return a body and all below it; parents come before their children."""
    inside = [root]
    for body in range(root + 1, model.nbody):
        if int(model.body_parentid[body]) in inside:
            inside.append(body)
    return inside


def moving_bodies(cartpole: CartPole) -> list[int]:
    """Return every body that slides, the poles' included."""
    return _under(cartpole, cartpole.slider)


def cart_bodies(cartpole: CartPole) -> list[int]:
    """Return every body that slides and does not turn."""
    turning = {body for hinge in cartpole.hinges for body in _under(cartpole, hinge)}
    return [body for body in moving_bodies(cartpole) if body not in turning]


def pole_bodies(cartpole: CartPole, pole: int = 0) -> list[int]:
    """Return all bodies that turn on a pole's hinge, without those of a pole that stands on it."""
    hinge = cartpole.hinges[pole]
    whole = _under(cartpole, hinge)
    # MuJoCo counts joints from the cart outwards.
    above = [
        other
        for other in cartpole.hinges
        if other > hinge and int(cartpole.model.jnt_bodyid[other]) in whole
    ]
    upper = {body for other in above for body in _under(cartpole, other)}
    return [body for body in whole if body not in upper]


def starting_state(cartpole: CartPole, task: Task) -> Vector:
    """Return the state around which a task's episodes start, shape (2 + 2 poles,)."""
    state = np.zeros(2 * len(cartpole.joints))
    for pole, hinge in enumerate(cartpole.hinges):
        body = int(cartpole.model.jnt_bodyid[hinge])
        others = (other for other in cartpole.hinges if other != hinge)
        # A pole on another is in line with it at its own angle 0.
        if not any(body in _under(cartpole, other) for other in others):
            state[2 + 2 * pole] = task.start_angle
    return state


def data_at_zero(model: mujoco.MjModel, data: mujoco.MjData | None = None) -> mujoco.MjData:
    """Return, in `data` or new ones, where bodies are at coordinates 0, which a `ref` can move."""
    data = mujoco.MjData(model) if data is None else data
    data.qpos[:] = 0.0
    mujoco.mj_kinematics(model, data)
    return data


def farthest_from_origin(cartpole: CartPole) -> float:
    """Return how far what moves stands from the world's origin when all coordinates are 0, m."""
    data = data_at_zero(cartpole.model)
    joints = list(cartpole.joints)
    places = np.concatenate([data.xipos[moving_bodies(cartpole)], data.xanchor[joints]])
    return float(np.abs(places).max())


def mass_of(model: mujoco.MjModel, bodies: list[int]) -> float:
    """Return mass of bodies together, kg."""
    return float(sum(float(model.body_mass[body]) for body in bodies))


def _under(cartpole: CartPole, joint: int) -> list[int]:
    return subtree(cartpole.model, int(cartpole.model.jnt_bodyid[joint]))
