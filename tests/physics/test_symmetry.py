"""What is the same to the left and to the right, and what is refused because it is not."""

import dataclasses

import pytest

from mjcartpole.errors import ConfigError
from mjcartpole.physics.load import load_model, model_names
from mjcartpole.physics.symmetry import check_symmetric
from mjcartpole.task import CARTPOLE_V1, Task


@pytest.mark.parametrize("integrator", ["gym", "mujoco"])
@pytest.mark.parametrize("name", [name for name in model_names() if name != "wind"])
def test_the_gallery_is_symmetric_but_for_the_wind(name, integrator):
    check_symmetric(load_model(name), integrator)


@pytest.mark.parametrize(
    ("name", "edits", "seen"),
    [
        ("wind", (), "wind does not: pushed to the right from upright rest, x_dot becomes 0.205"),
        ("cartpole", ("option.gravity=0.1 0 -9.8",), "from upright rest"),
        ("cartpole", ("joint:hinge.springref=0.1", "joint:hinge.stiffness=1"), "from upright rest"),
        ("cartpole", ("joint:slider.limited=true", "joint:slider.range=-1 2"), "from x "),
        ("stops", ("joint:slider.range=-2 1.5",), "from x "),
        ("twopoles", ("option.gravity=0.001 0 -9.8",), "from upright rest"),
    ],
)
def test_what_tells_left_from_right_is_refused(name, edits, seen):
    with pytest.raises(ConfigError, match="left and to the right") as refused:
        check_symmetric(load_model(name, edits))
    assert seen in str(refused.value)


def leans(x, x_dot, theta, theta_dot, terminated):
    return theta


def is_upright(x, x_dot, theta, theta_dot, terminated):
    return 1.0 - theta * theta


def test_rules_that_reward_a_side_are_refused():
    check_symmetric(None, task=dataclasses.replace(CARTPOLE_V1, reward=is_upright))
    check_symmetric(None, task=CARTPOLE_V1.with_changes(reward="minus-one-at-the-end"))
    with pytest.raises(ConfigError, match=r"Leaning rewards x .* with .* and its mirror image"):
        check_symmetric(None, task=Task("Leaning", reward=leans))


def test_a_task_without_limits_is_looked_at():
    endless = Task("Endless", x_limit=float("inf"), theta_limit=float("inf"))
    check_symmetric(load_model(), task=endless)
    with pytest.raises(ConfigError, match="wind does not"):
        check_symmetric(load_model("wind"), task=endless)
