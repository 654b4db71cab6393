"""What is said of a model is what the model does."""

import math
from pathlib import Path

import numpy as np
import pytest

from mjcartpole.physics.describe import Description, axis_name, describe
from mjcartpole.physics.load import load_model, models_folder
from mjcartpole.physics.simulation import Simulation
from mjcartpole.task import Task

MODELS = sorted((Path(__file__).parent / "models").glob("*.xml"))
REFERENCE = (models_folder() / "cartpole.xml").read_text(encoding="utf-8")


def described(name: str) -> Description:
    return describe(load_model(Path(__file__).parent / "models" / f"{name}.xml"))


def test_the_reference():
    assert describe(load_model()).text() == [
        "cart        joint 'slider' of body 'cart', 1 kg",
        "pole        joint 'hinge' of body 'pole', 0.1 kg, centre of mass 0.5 m from the hinge",
        "rail        along +x, no ends; an episode ends at 2.4 m",
        "up          +z; gravity 0 0 -9.8 m/s^2",
        "angle       0 is upright, a positive angle leans to +x of the rail",
        "force       action 0: -10 N, action 1: 10 N (control -1 or 1, gear 10)",
        "time        1 step of 0.02 s per action, 0.02 s",
        "integrator  Euler",
        "equations   apply",
    ]


def test_where_an_episode_ends_is_the_tasks():
    for limit, said in ((1.5, "no ends; an episode ends at 1.5 m"), (math.inf, "no ends")):
        text = describe(load_model(), task=Task("other", x_limit=limit)).text()
        assert f"rail        along +x, {said}" in text


def test_a_rail_along_y_a_hinge_and_a_gear_that_turn_backwards():
    found = described("lying_rail")
    (pole,) = found.poles
    assert (found.rail, found.up, pole.leans) == ("+y", "+z", -1)
    assert (found.forces, found.cartpole.controls) == ((-8.0, 8.0), (1.0, -1.0))
    assert (found.cartpole.substeps, found.cartpole.timestep, found.cartpole.integrator) == (
        5,
        0.004,
        "implicitfast",
    )
    assert found.cartpole.control_step == pytest.approx(0.02)
    assert (found.cart_mass, pole.mass) == pytest.approx((0.8, 0.15))
    assert pole.com_distance == pytest.approx((0.05 * 0.3 + 0.1 * 0.6) / 0.15 - 0.01)
    assert found.rail_limits == (-2.0, 2.0)


def test_a_pole_that_hangs_at_angle_0():
    found = described("hanging")
    assert found.poles[0].upright == pytest.approx(math.pi)
    assert found.poles[0].balance == pytest.approx(0.0, abs=1e-12)
    angle = next(line for line in found.text() if line.startswith("angle"))
    assert "the file has upright at 180 degrees, angles are counted from there" in angle


def test_y_up_and_no_names():
    found = described("y_up")
    assert (found.cart, found.poles[0].joint) == (
        "joint 'a' of body 1 (unnamed)",
        "joint 1 (unnamed) of body 2 (unnamed)",
    )
    assert (found.up, found.poles[0].leans, found.forces) == ("+y", -1, (-10.0, 10.0))
    assert not found.beyond


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (('pos="0 0 0.5" mass', 'pos="0.01 0 0.5" mass'), "it balances at -1.15 degrees"),
        (('pos="0 0 0.5" mass', 'pos="0 0 0" mass'), "on the hinge, so that it cannot fall"),
        (("0 0 -9.8", "0 0 0"), "up          +z; gravity 0 0 0"),
        (("0 0 -9.8", "3 0 -9.8"), "up          +z; gravity 3 0 -9.8"),
        (('axis="0 1 0"', 'axis="0 -1 0"'), "a positive angle leans to -x"),
        (('axis="1 0 0"', 'axis="1 0.5 0"'), "along (0.8944 0.4472 0)"),
        (('ctrlrange="-1 1"', 'ctrlrange="-1 1" forcerange="-0.5 2"'), "action 0: -5 N, action 1"),
        (
            ('<motor name="push" joint="slider" gear="10"', '<position joint="slider" kp="7"'),
            "action 0: -7 N, action 1: 7 N at rest at x = 0, by a servo (control -1 or 1, gear 1)",
        ),
        (('"Euler"', '"RK4"'), "equations   apply"),
        (
            ('name="hinge"', 'name="hinge" stiffness="1"'),
            "do not apply: spring (stiffness) in joint",
        ),
        (('name="hinge"', 'name="hinge" frictionloss="1"'), "equations   apply"),
    ],
)
def test_what_a_change_is_said_to_change(change, line):
    assert change[0] in REFERENCE
    text = "\n".join(describe(load_model(REFERENCE.replace(*change))).text())
    assert line in text


@pytest.mark.parametrize("path", [models_folder() / "cartpole.xml", *MODELS], ids=lambda p: p.stem)
def test_the_simulation_does_what_the_description_says(path):
    """Pushed by action 1, the cart goes to positive x and the pole leans back; it falls from 0.1.

    Balance and force are checked by the accelerations at rest.
    """
    cartpole = load_model(path)
    found, simulation = describe(cartpole), Simulation(cartpole, "gym")
    (pole,) = found.poles
    states = np.array([[0, 0, 0.1, 0], [0, 0, -0.1, 0], [0, 0, pole.balance, 0]])
    middle = sum(found.cartpole.controls) / 2
    accelerations = simulation.accelerations(states, np.full(3, middle))
    assert accelerations[0, 1] > 0 > accelerations[1, 1]
    assert accelerations[2, 1] == pytest.approx(0.0, abs=1e-9)
    pushed = simulation.accelerations(np.zeros((2, 4)), np.array(found.cartpole.controls))
    assert pushed[0, 0] < 0 < pushed[1, 0]
    assert np.sign(pushed[:, 1]).tolist() == [pole.leans, -pole.leans]
    # At rest: force = (all mass) * x_acc + pole's mass * com_distance * theta_acc, signed.
    mass = found.cart_mass + pole.mass
    lever = pole.leans * pole.mass * pole.com_distance * math.cos(pole.balance)
    force = mass * pushed[:, 0] + lever * pushed[:, 1]
    assert force == pytest.approx(found.forces)


def test_axes_have_names():
    assert axis_name(np.array([0.0, -1.0, 0.0])) == "-y"
    assert axis_name(np.array([0.6, 0.0, 0.8])) == "(0.6 0 0.8)"
