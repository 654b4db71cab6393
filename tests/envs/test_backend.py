"""One interface to both physics."""

import numpy as np
import pytest

from mjcartpole.envs.backend import check_backend, make_env
from mjcartpole.errors import ConfigError


@pytest.mark.parametrize("backend", ["mujoco", "gym"])
def test_both_backends_keep_their_state_and_limit_the_time(backend):
    env = make_env(backend)
    observation, _ = env.reset(seed=7)
    np.testing.assert_array_equal(observation, env.unwrapped.state.astype(np.float32))
    assert env.spec.max_episode_steps == 500
    assert ("mjcartpole" in type(env.unwrapped).__module__) == (backend == "mujoco")


def test_the_integrator_reaches_the_simulation():
    env = make_env("mujoco", integrator="mujoco")
    assert env.unwrapped.simulation.integrator == "mujoco"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("bullet", "cartpole", "gym"), "backend 'bullet' is unknown; available: mujoco, gym"),
        (("mujoco", "cartpole", "euler"), "integrator 'euler' is unknown; available: gym, mujoco"),
        (("gym", "long", "gym"), "takes no model, integrator, timestep or edits"),
        (("gym", "cartpole", "mujoco"), "takes no model, integrator, timestep or edits"),
    ],
)
def test_nothing_is_silently_ignored(arguments, message):
    with pytest.raises(ConfigError, match=message):
        check_backend(*arguments)
