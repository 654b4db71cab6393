"""The model of an environment from one episode to the next."""

import pytest

from mjcartpole.envs.editable import KINEMATICS, Editable
from mjcartpole.errors import ConfigError
from mjcartpole.physics.load import load_model


def test_a_simulation_has_a_model_of_its_own():
    base = load_model("cartpole")
    model = Editable(base, "gym")
    simulation = model.begin()
    simulation.cartpole.model.opt.gravity[2] = -1.0
    assert base.model.opt.gravity[2] == -9.8
    assert not model.is_stale


def test_a_control_step_that_is_set_keeps_its_number_of_steps():
    model = Editable(load_model("cartpole", {"timestep": 0.005}), "gym")
    model.edit({"timestep": 0.01})
    cartpole = model.begin().cartpole
    assert (cartpole.substeps, cartpole.control_step) == (4, 0.04)


@pytest.mark.parametrize("name", list(KINEMATICS))
def test_every_integrator_has_a_word(name):
    model = Editable(load_model("cartpole"), "gym")
    model.kinematics = name
    simulation = model.begin()
    assert model.kinematics == name
    assert simulation.integrator == ("gym" if name == "euler" else "mujoco")
    if name != "euler":
        assert simulation.cartpole.integrator == KINEMATICS[name]


def test_an_edit_that_fails_changes_nothing():
    model = Editable(load_model("cartpole"), "gym")
    with pytest.raises(ConfigError):
        model.edit({"pole.mass": -1})
    assert model.own is model.base
