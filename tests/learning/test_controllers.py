"""Controllers: the regulator against the equations, and all of them at play."""

import numpy as np
import pytest

from mjcartpole.errors import ConfigError, ModelError
from mjcartpole.learning import controllers
from mjcartpole.learning.controllers import CONTROLLERS, controller, gains
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.evaluation import evaluate, player
from mjcartpole.learning.policy import Policy
from mjcartpole.physics.linear import step_matrix
from mjcartpole.physics.load import load_model
from mjcartpole.physics.parameters import read_parameters
from mjcartpole.physics.simulation import Simulation
from mjcartpole.task import CARTPOLE_V1, CONTINUOUS, SWING_UP

MODELS = ("cartpole", "long", "damped")


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("integrator", ["gym", "mujoco"])
def test_a_step_near_rest_is_that_of_the_equations(model, integrator):
    cartpole = load_model(model)
    by_state, by_push = controllers._one_step(Simulation(cartpole, integrator))
    p = read_parameters(cartpole)
    one = step_matrix(p, integrator)
    assert cartpole.substeps == 1
    np.testing.assert_allclose(by_state, one, atol=1e-8)
    assert (by_push[[1, 3], 0] * [1, -1] > 0).all(), "a push to the right tips the pole to the left"


def test_the_gains_are_what_the_riccati_recursion_comes_to():
    cartpole = load_model()
    a, b = controllers._one_step(Simulation(cartpole))
    weights = np.diag([1 / 2.4**2, 0, 1 / CARTPOLE_V1.theta_limit**2, 0])
    cost = weights
    for _ in range(5_000):
        k = np.linalg.solve(1 + b.T @ cost @ b, b.T @ cost @ a)
        cost = weights + a.T @ cost @ (a - b @ k)
    np.testing.assert_allclose(gains(cartpole), k[0], rtol=1e-9)
    assert max(abs(np.linalg.eigvals(a - b @ k))) < 1


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("task", [CARTPOLE_V1, CONTINUOUS])
def test_the_regulator_balances(model, task):
    cartpole = load_model(model)
    played = evaluate(controller("lqr", cartpole), model=cartpole, task=task, episodes=5)
    assert played.minimum == 500


def test_the_regulator_balances_gymnasiums_own():
    played = evaluate(controller("lqr", load_model()), backend="gym", task=CONTINUOUS, episodes=3)
    assert played.minimum == 500


@pytest.mark.parametrize("backend", ["mujoco", "gym"])
def test_energy_swings_up(backend):
    swing = controller("energy", load_model())
    assert evaluate(swing, backend=backend, task=SWING_UP, episodes=6).minimum > 400


def test_energy_is_for_one_pole():
    with pytest.raises(ModelError, match="poles"):
        controller("energy", load_model("twopoles"))


def test_random_is_the_same_for_the_same_observation_and_fair():
    observations = np.random.default_rng(0).normal(size=(1_000, 4)).astype(np.float32)
    drawn = [controller("random")(each) for each in observations]
    assert drawn == [controller("random")(each) for each in observations]
    assert 450 < sum(drawn) < 550
    pushes = [controller("random").push(each)[0] for each in observations]
    assert -1 <= min(pushes) < -0.95
    assert 0.95 < max(pushes) <= 1


def test_constant_pushes_to_the_right():
    assert controller("constant")(np.zeros(4, np.float32)) == 1
    assert controller("constant").push(np.zeros(4, np.float32)).tolist() == [1.0]


def test_who_cannot_play():
    with pytest.raises(ConfigError, match=r"'lq' is unknown; available: lqr, energy, .* 'lqr'"):
        controller("lq")
    with pytest.raises(ConfigError, match=r"lqr is for 1 pole, and .* has 2 poles"):
        evaluate(controller("lqr", load_model()), model="twopoles")
    table = Policy(Discretizer((1,) * 4, (-1.0,) * 4, (1.0,) * 4), np.zeros((1, 1, 1, 1, 2)))
    with pytest.raises(ConfigError, match="a table chooses between two actions"):
        player(table, CONTINUOUS)


def test_a_model_that_its_motor_does_not_move():
    stuck = load_model("cartpole", {"motor:push.gear": "1e-300"})
    with pytest.raises(ConfigError, match=r"no regulator holds .* upright"):
        gains(stuck)


def test_each_has_its_name():
    cartpole = load_model()
    assert [made(cartpole).name for made in CONTROLLERS.values()] == list(CONTROLLERS)
