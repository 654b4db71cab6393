"""The names under which gymnasium knows the environments: one for each task."""

from typing import Final

import gymnasium

from mjcartpole import task
from mjcartpole.errors import ConfigError
from mjcartpole.task import CARTPOLE_V1, TASKS, Task


def env_id(rules: Task) -> str:
    """Return what `gymnasium.make` takes for a task."""
    return f"mjcartpole/{rules.name}"


_CONTINUOUS: Final = "mjcartpole.envs.continuous:ContinuousCartPoleEnv"

ENV_ID: Final = env_id(CARTPOLE_V1)


def register() -> None:
    """Register an environment for each known task, once."""
    for rules in TASKS.values():
        if env_id(rules) not in gymnasium.registry:
            _register(rules)


def register_task(rules: Task) -> Task:
    """Make a task known by its name: to `TrainConfig`, the command line and gymnasium.

    >>> _ = register_task(Task("Short-v0", time_limit=100))
    >>> gymnasium.make("mjcartpole/Short-v0").spec.max_episode_steps
    100

    Raises:
        ConfigError: Another task has that name, or gymnasium allows no such name.
    """
    task.register(rules)
    try:
        register()
    except gymnasium.error.Error as error:
        del TASKS[rules.name]
        raise ConfigError(f"a task cannot be called {rules.name!r}: {error}") from error
    return rules


def _register(rules: Task) -> None:
    gymnasium.register(
        id=env_id(rules),
        entry_point=_CONTINUOUS if rules.continuous else "mjcartpole.envs.cartpole:CartPoleEnv",
        vector_entry_point="mjcartpole.envs.vector:CartPoleVectorEnv",
        max_episode_steps=rules.time_limit,
        reward_threshold=rules.reward_threshold,
        kwargs={} if rules is CARTPOLE_V1 else {"task": rules.name},
    )
