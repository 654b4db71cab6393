"""Who does the physics: our MuJoCo cart-pole or gymnasium's CartPole-v1, behind one interface."""

from collections.abc import Collection
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Unpack, get_args

import gymnasium

from mjcartpole.disturbances.disturbances import NONE, Disturbances
from mjcartpole.envs.gym_task import GymTask
from mjcartpole.envs.registration import ENV_ID, env_id
from mjcartpole.errors import ConfigError, check_known
from mjcartpole.integrator import Integrator, check_integrator
from mjcartpole.rules import Changes
from mjcartpole.task import CARTPOLE_V1, CONTINUOUS, Task, resolve

if TYPE_CHECKING:
    from mjcartpole.physics.load import ModelLike

Backend = Literal["mujoco", "gym"]

GYM_ID = "CartPole-v1"


class World(NamedTuple):
    """Where episodes are played, as `make_env` and the compiled loop take it; all of it checked."""

    backend: Backend
    model: "ModelLike" = "cartpole"
    integrator: Integrator = "gym"
    task: Task = CARTPOLE_V1
    disturbances: Disturbances = NONE


def check_backend(
    backend: str,
    model: object,
    integrator: str,
    edits: Collection[str] = (),
    *,
    own_timestep: bool = False,
) -> None:
    """Refuse a backend that does not exist, or settings that it would ignore (ConfigError)."""
    check_known("backend", backend, get_args(Backend))
    check_integrator(integrator)
    others = (*edits, *(("own-timestep",) if own_timestep else ()))
    if backend == "gym" and ((model, integrator) != ("cartpole", "gym") or others):
        asked = ", ".join(f"'{word}'" for word in (model, integrator, *others))
        raise ConfigError(
            f"backend 'gym' is gymnasium's {GYM_ID} as it is: it takes no model, integrator, "
            f"timestep or edits (asked for {asked}); use backend 'mujoco' for these"
        )


def make_env(
    backend: Backend,
    model: "ModelLike" = "cartpole",
    integrator: Integrator = "gym",
    task: Task | str = CARTPOLE_V1,
    disturbances: Disturbances = NONE,
    *,
    max_episode_steps: int | None = None,
    **changes: Unpack[Changes],
) -> gymnasium.Env[Any, Any]:
    """Make the environment of a backend, with the task's time limit, or with rules changed.

    Gymnasium's passive checker is left out: both environments pass it in the tests, and it costs
    more than the physics.

    Raises:
        ConfigError: The backend or the task is unknown, or the backend would ignore a setting.
        ModelError: The model cannot be used.
    """
    check_backend(backend, model, integrator, disturbances.vary)
    rules = resolve(task, max_episode_steps=max_episode_steps, **changes)
    if backend == "gym":
        env = gymnasium.make(GYM_ID, max_episode_steps=rules.time_limit, disable_env_checker=True)
        is_plain = rules is CARTPOLE_V1 and not disturbances.are_some
        return env if is_plain else GymTask(env, rules, disturbances)
    return gymnasium.make(
        env_id(CONTINUOUS) if rules.continuous else ENV_ID,
        max_episode_steps=rules.time_limit,
        disable_env_checker=True,
        model=model,
        integrator=integrator,
        task=rules,
        **disturbances.given,
    )
