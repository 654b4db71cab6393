"""What makes the same environment again, as JSON."""

import gymnasium
import mujoco
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec

from mjcartpole.physics.load import load_model, models_folder

ENV_ID = "mjcartpole/CartPole-v1"
LONG = models_folder() / "long.xml"


@pytest.mark.parametrize(
    "model",
    [
        "long",
        LONG,
        LONG.read_text(encoding="utf-8"),
        mujoco.MjSpec.from_file(str(LONG)),
        load_model("long"),
        load_model("long", {"timestep": 0.015}, own_timestep=True),
    ],
    ids=["name", "path", "text", "spec", "loaded", "own step"],
)
@pytest.mark.parametrize("edits", [None, {"pole.mass": np.float32(0.25)}, ("pole.mass=0.25",)])
def test_the_same_environment_is_made_again(model, edits):
    arguments = {"model": model, "edits": edits, "width": np.int64(320)}
    own = getattr(model, "has_own_timestep", False)
    env = gymnasium.make(ENV_ID, **arguments, **({"own_timestep": True} if own and edits else {}))
    again = gymnasium.make(EnvSpec.from_json(env.spec.to_json()))
    first, second = env.reset(seed=1)[0], again.reset(seed=1)[0]
    for turn in range(20):
        np.testing.assert_array_equal(first, second)
        first, second = env.step(turn % 2)[0], again.step(turn % 2)[0]


def test_plain_arguments_are_left_alone():
    env = gymnasium.make(ENV_ID, model="long", width=320)
    assert env.spec.kwargs == {"model": "long", "width": 320}


def test_a_document_that_is_not_the_model_is_a_word():
    cartpole = load_model("cartpole")
    cartpole.model.opt.gravity[2] = -1.0
    with pytest.warns(UserWarning, match="compiles to another model"):
        gymnasium.make(ENV_ID, model=cartpole)
