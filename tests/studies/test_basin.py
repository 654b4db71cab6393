"""How long a policy lasts, from many starts."""

from dataclasses import replace

import numpy as np
import pytest

from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.envs.backend import make_env
from mjcartpole.errors import ConfigError
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.loop import play_episode
from mjcartpole.learning.policy import Policy
from mjcartpole.studies.basin import basin, limit_along, survival
from mjcartpole.studies.policy_setup import PolicySetup
from mjcartpole.task import CARTPOLE_V1, SWING_UP
from nightly import few

BANG = Discretizer((1, 1, 2, 1), (-2.4, -1, -0.2, -1), (2.4, 1, 0.2, 1))
LEANS = Policy(BANG, np.array([1.0, 0.0, 0.0, 1.0]).reshape(1, 1, 2, 1, 2))
"""Pushes to where the pole leans."""


def starts(n=20, poles=1):
    return np.random.default_rng(0).uniform(-0.15, 0.15, (n, 2 + 2 * poles))


@pytest.mark.parametrize("backend", few(["mujoco", "gym"], "gym", long=("mujoco",)))
def test_both_engines_agree_with_episodes_played_one_by_one(backend):
    setup = PolicySetup("leans", LEANS, backend)
    found = survival(setup, starts())
    assert found.tolist() == survival(setup, starts(), "python").tolist()
    env = make_env(backend)
    episode, states = play_episode(env, LEANS, start=starts()[3])
    assert states[0].tolist() == starts()[3].tolist()
    assert episode.steps == found[3]
    assert len(set(found.tolist())) > 5


@pytest.mark.parametrize("backend", few(["mujoco", "gym"], "gym", long=("mujoco",)))
def test_both_engines_disturb_alike(backend):
    vary = {"vary": "pole.length=0.5:2", "pool": 3} if backend == "mujoco" else {}
    some = Disturbances(**vary, delay=1, noise=0.02, hold=0.1, push="0.5@~0.5s", sensor_delay=1)
    setup = PolicySetup("leans", LEANS, backend, disturbances=some)
    found = survival(setup, starts())
    assert found.tolist() == survival(setup, starts(), "python").tolist()
    assert found.tolist() != survival(PolicySetup("leans", LEANS, backend), starts()).tolist()


def test_what_was_added_is_said_and_models_are_of_a_pool():
    some = Disturbances(vary="pole.length=0.5:2", delay=1)
    grid = basin(PolicySetup("leans", LEANS, disturbances=some), points=3)
    assert grid.notes[1] == "with --vary pole.length=0.5:2 --delay 1 --pool 100"
    pooled = PolicySetup("leans", LEANS, disturbances=replace(some, pool=100))
    again = basin(pooled, points=3)
    assert again.fields[0][0].values.tolist() == grid.fields[0][0].values.tolist()


def test_a_table_that_looks_at_actions_starts_before_any():
    grid = Discretizer((1, 1, 2, 1, 2), (*BANG.low, -1), (*BANG.high, 1), actions=1)
    policy = Policy(grid, np.stack([LEANS.q_table] * 2, axis=4))
    sees = Disturbances(observe_actions=1)
    grid = basin(PolicySetup("sees", policy, disturbances=sees), points=5)
    blind = basin(PolicySetup("leans", LEANS), points=5)
    assert grid.fields[0][0].values.tolist() == blind.fields[0][0].values.tolist()
    assert grid.notes == blind.notes
    for asked in ({"dims": ("theta", "action_1_before")}, {"at": {"action_1_before": 1}}):
        with pytest.raises(ConfigError, match="of a state 'action_1_before' is unknown"):
            basin(PolicySetup("sees", policy, disturbances=sees), **asked)


def test_several_poles_start_where_they_are_put():
    grid = Discretizer((1, 1, 2, 1, 1, 1), (-1,) * 6, (1,) * 6)
    policy = Policy(grid, LEANS.q_table.reshape(*grid.shape, 2))
    setup = PolicySetup("two", policy, model="twopoles")
    assert (
        survival(setup, starts(4, 2)).tolist() == survival(setup, starts(4, 2), "python").tolist()
    )


def test_a_basin_is_as_wide_as_the_rules_and_about_symmetric():
    grid = basin(PolicySetup("leans", LEANS, "gym"), points=11)
    ((field,),) = grid.fields
    limit = CARTPOLE_V1.theta_limit
    assert [edges[[0, -1]].tolist() for edges in field.edges] == [[-limit, limit], [-1.0, 1.0]]
    assert field.values.shape == (11, 11)
    # But for what rounding decides: upright counts as leaning to the right.
    assert (field.values == field.values[::-1, ::-1]).mean() > 0.8
    assert (grid.names, grid.most) == (("theta", "theta_dot"), 500)
    assert field.values[0, 0] < 10


def test_others_are_held_where_it_is_asked():
    near = basin(
        PolicySetup("leans", LEANS, "gym"), dims=("theta", "x_dot"), at={"x": 2.39}, points=4
    )
    assert near.fields[0][0].values.max() < 60
    assert "x = 2.39" in near.notes[0]


@pytest.mark.long
def test_where_no_angle_ends_an_episode_the_table_says_how_far():
    assert limit_along(2, SWING_UP) is None
    assert limit_along(0, CARTPOLE_V1) == 2.4
    setup = PolicySetup("leans", LEANS, "gym", task=SWING_UP.with_changes(max_episode_steps=20))
    ((field,),) = basin(setup, points=3).fields
    assert field.edges[0].tolist() == pytest.approx([-0.2, -0.2 / 3, 0.2 / 3, 0.2])
    assert (field.values == 20).all()


def test_points_that_make_no_sense_are_refused():
    for points in (1, 1_001):
        with pytest.raises(ConfigError, match="points must be a whole number from 2 to 1,000"):
            basin(PolicySetup("leans", LEANS), points=points)
