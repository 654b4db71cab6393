"""CartPole-v1 as real physics: an MJCF cart-pole in MuJoCo, a Q-table, and a video.

    import gymnasium
    import mjcartpole

    env = gymnasium.make("mjcartpole/CartPole-v1")

    result = mjcartpole.train(mjcartpole.TrainConfig.preset("tuned", backend="mujoco", seed=3))

Importing the package registers the environment and nothing else: MuJoCo, OpenGL and the video
libraries are imported when they are first needed.
"""

import importlib
from typing import TYPE_CHECKING

from mjcartpole.garbage import kept

with kept():
    from mjcartpole.envs.registration import ENV_ID, register, register_task
    from mjcartpole.task import Task

if TYPE_CHECKING:
    from mjcartpole.disturbances.disturbances import Disturbances
    from mjcartpole.envs.cartpole import CartPoleEnv
    from mjcartpole.envs.vector import CartPoleVectorEnv
    from mjcartpole.learning.config import TrainConfig
    from mjcartpole.learning.evaluation import Evaluation, evaluate
    from mjcartpole.learning.policy import Policy
    from mjcartpole.learning.training import TrainResult, train
    from mjcartpole.physics.cartpole import CartPole
    from mjcartpole.physics.load import load_model, model_names
    from mjcartpole.physics.simulation import Simulation
    from mjcartpole.studies.multi_seed import train_many
    from mjcartpole.studies.run_plots import plot
    from mjcartpole.studies.seeds import ManyResult

__version__ = "0.1.0"

__all__ = [
    "ENV_ID",
    "CartPole",
    "CartPoleEnv",
    "CartPoleVectorEnv",
    "Disturbances",
    "Evaluation",
    "ManyResult",
    "Policy",
    "Simulation",
    "Task",
    "TrainConfig",
    "TrainResult",
    "evaluate",
    "load_model",
    "model_names",
    "plot",
    "register_task",
    "train",
    "train_many",
]

_HOMES = {
    "CartPole": "physics.cartpole",
    "CartPoleEnv": "envs.cartpole",
    "CartPoleVectorEnv": "envs.vector",
    "Disturbances": "disturbances.disturbances",
    "Evaluation": "learning.evaluation",
    "ManyResult": "studies.seeds",
    "Policy": "learning.policy",
    "Simulation": "physics.simulation",
    "TrainConfig": "learning.config",
    "TrainResult": "learning.training",
    "evaluate": "learning.evaluation",
    "load_model": "physics.load",
    "model_names": "physics.load",
    "plot": "studies.run_plots",
    "train": "learning.training",
    "train_many": "studies.multi_seed",
}

register()


def __getattr__(name: str) -> object:
    """Import a public name from its module when it is first asked for."""
    if name not in _HOMES:
        raise AttributeError(f"module 'mjcartpole' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"mjcartpole.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
