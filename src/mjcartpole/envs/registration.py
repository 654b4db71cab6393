"""The name under which gymnasium knows the environment."""

from typing import Final

import gymnasium

from mjcartpole import task

ENV_ID: Final = "mjcartpole/CartPole-v1"
"""What `gymnasium.make` takes."""


def register() -> None:
    """Register the environment with CartPole-v1's time limit and reward threshold, once."""
    if ENV_ID in gymnasium.registry:
        return
    gymnasium.register(
        id=ENV_ID,
        entry_point="mjcartpole.envs.cartpole:CartPoleEnv",
        vector_entry_point="mjcartpole.envs.vector:CartPoleVectorEnv",
        max_episode_steps=task.TIME_LIMIT,
        reward_threshold=task.REWARD_THRESHOLD,
    )
