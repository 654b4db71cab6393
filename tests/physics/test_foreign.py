"""Cart-poles made by others, in others' manners, are understood, balanced and drawn.

`models/` holds documents of our own in the manner of public ones. dm_control's and gymnasium's
are read where those packages are installed.
"""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from foreign import document
from mjcartpole.envs.cartpole import CartPoleEnv
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.run_model import check_storable
from mjcartpole.learning.training import train
from mjcartpole.media.renderer import open_renderer
from mjcartpole.physics.describe import describe
from mjcartpole.physics.load import load_model, same_model
from mjcartpole.physics.playable import why_unplayable
from mjcartpole.physics.simulation import Simulation

OURS = sorted((Path(__file__).parent / "models").glob("*.xml"))


def installed(package: str, *parts: str) -> Path:
    spec = importlib.util.find_spec(package)
    if spec is None or spec.origin is None:
        return Path(package).joinpath(*parts)
    return Path(spec.origin).parent.joinpath(*parts)


DM_CONTROL = installed("dm_control", "suite", "cartpole.xml")


GYMNASIUM = installed("gymnasium", "envs", "mujoco", "assets", "inverted_pendulum.xml")


EVERY = [DM_CONTROL, GYMNASIUM, *OURS]


def needs(path: Path) -> None:
    if not path.is_file():
        pytest.skip(f"{path} is not installed")


def camera_of(cartpole) -> str:
    """The first of its cameras, or the one that stands in for it."""
    model = cartpole.model
    return model.cam(0).name if model.ncam else "free"


@pytest.mark.parametrize("path", EVERY, ids=lambda path: path.stem)
def test_a_stored_document_gives_the_same_model(path, tmp_path):
    needs(path)
    cartpole = load_model(path)
    check_storable(cartpole)
    stored = tmp_path / "model.xml"
    stored.write_text(cartpole.xml, encoding="utf-8")
    assert same_model(load_model(stored).model, cartpole.model)


@pytest.mark.parametrize("integrator", ["gym", "mujoco"])
@pytest.mark.parametrize("path", EVERY, ids=lambda path: path.stem)
def test_it_plays_episodes_and_falls_when_left_alone(path, integrator):
    needs(path)
    env = CartPoleEnv(model=path, integrator=integrator)
    lengths = []
    for seed in range(5):
        observation, _ = env.reset(seed=seed)
        over, steps = False, 0
        while not over and steps < 500:
            observation, reward, over, _, _ = env.step(steps % 2)
            assert np.isfinite(observation).all()
            assert reward == 1.0
            steps += 1
        lengths.append(steps)
    assert all(5 < length < 500 for length in lengths)


@pytest.mark.parametrize("integrator", ["gym", "mujoco"])
@pytest.mark.parametrize("path", EVERY, ids=lambda path: path.stem)
def test_a_policy_may_balance_it(path, integrator):
    needs(path)
    assert why_unplayable(load_model(path), integrator) is None


@pytest.mark.parametrize("path", EVERY, ids=lambda path: path.stem)
def test_it_is_drawn(path):
    needs(path)
    cartpole = load_model(path)
    with open_renderer(
        cartpole, width=160, height=120, camera=camera_of(cartpole), kind="sketch"
    ) as renderer:
        one, other = (renderer.render((x, 0, theta, 0)) for x, theta in ((0, 0), (0.3, 0.2)))
    assert (one != other).any()


@pytest.mark.parametrize("path", EVERY, ids=lambda path: path.stem)
def test_it_learns(path):
    needs(path)
    result = train(TrainConfig(model=str(path), episodes=60, seed=0))
    assert len(result.returns) == 60
    assert np.mean(result.returns[-10:]) > 2 * np.mean(result.returns[:10])


@pytest.mark.slow
@pytest.mark.parametrize("path", EVERY, ids=lambda path: path.stem)
def test_the_tuned_preset_balances_it(path):
    needs(path)
    result = train(TrainConfig(model=str(path), seed=0))
    assert np.mean(result.returns[-50:]) > 450


def test_dm_controls_cart_pole_is_understood():
    needs(DM_CONTROL)
    found = describe(load_model(DM_CONTROL))
    (pole,) = found.poles
    assert (found.cart, pole.joint) == (
        "joint 'slider' of body 'cart'",
        "joint 'hinge_1' of body 'pole_1'",
    )
    assert (found.forces, found.cartpole.timestep, found.cartpole.substeps) == (
        (-10.0, 10.0),
        0.01,
        2,
    )
    assert (found.rail, found.up, pole.leans, found.cartpole.integrator) == ("+x", "+z", 1, "RK4")
    assert (found.cart_mass, pole.mass, pole.com_distance) == pytest.approx((1, 0.1, 0.5))
    assert found.rail_limits == (-1.8, 1.8)
    assert found.beyond == []


def test_gymnasiums_inverted_pendulum_is_understood():
    needs(GYMNASIUM)
    found = describe(load_model(GYMNASIUM))
    assert (found.forces, found.cartpole.substeps, found.cartpole.integrator) == (
        (-300.0, 300.0),
        1,
        "RK4",
    )
    assert found.cartpole.controls == (-3.0, 3.0)
    assert any("gear 100)" in line for line in found.text())
    assert found.poles[0].balance == pytest.approx(-0.001 / 0.6, rel=1e-3)
    assert found.rail_limits == (-1.0, 1.0)


def test_a_hinge_whose_range_is_infinite_turns_freely():
    """As people write it, `limited` by a default."""
    free = document().replace('name="h"', 'name="h" limited="true" range="-inf inf"')
    cartpole = load_model(free)
    assert not describe(cartpole).beyond
    simulation, plain = (Simulation(load_model(each)) for each in (free, document()))
    for each in (simulation, plain):
        each.state = (0.0, 0.0, 3.0, 9.0)
    assert [simulation.step(1.0) for _ in range(50)] == [plain.step(1.0) for _ in range(50)]
    rail = document().replace('name="s"', 'name="s" limited="true" range="-inf inf"')
    assert describe(load_model(rail)).rail_limits is None
