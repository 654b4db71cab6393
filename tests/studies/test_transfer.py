"""Every policy on every model."""

import json
import math

import numpy as np
import pytest

from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.errors import ConfigError, ModelError, ModelNotFoundError
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.evaluation import evaluate
from mjcartpole.learning.policy import Policy
from mjcartpole.physics.load import load_model
from mjcartpole.studies.transfer import Place, find_place, transfer


def a_policy(weights=(1.0, 1.0, 4.0, 4.0)):
    """Pushes to the side to which a weighted sum of the bins' middles points."""
    grid = Discretizer((3, 3, 6, 8), (-2.4, -0.75, -0.2095, -1.5), (2.4, 0.75, 0.2095, 1.5))
    parts = (weight * np.linspace(-1, 1, n) for weight, n in zip(weights, grid.bins, strict=True))
    lean = sum(np.ix_(*parts))
    return Policy(grid, np.stack([-lean, lean], axis=-1))


POLICIES = {"steady": a_policy(), "clumsy": a_policy((0.0, 0.0, 1.0, 0.0))}


@pytest.fixture(scope="module")
def matrix():
    return transfer(POLICIES, ["gym", "cartpole", "long"], episodes=20, seed=5)


def test_every_cell_is_the_evaluation_alone(matrix):
    assert matrix.policies == ("steady", "clumsy")
    assert matrix.places == ("gym", "cartpole", "long")
    assert matrix.means.shape == (2, 3)
    for cell in matrix.cells:
        where = {"backend": "gym"} if cell.place == "gym" else {"model": cell.place}
        alone = evaluate(POLICIES[cell.policy], episodes=20, seed=5, **where)
        assert cell.evaluation == alone
        assert cell.mean == alone.returns.mean()


def test_intervals_hold_the_means(matrix):
    for cell in matrix.cells:
        returns = cell.evaluation.returns
        low, high = cell.interval
        assert returns.min() <= low <= cell.mean <= high <= returns.max()
        assert (low == high) == (len(set(returns.tolist())) == 1)
        # About two standard errors to either side, if there is any spread.
        error = returns.std() / math.sqrt(len(returns))
        assert high - low == pytest.approx(3.9 * error, rel=0.3)


def test_the_same_seed_repeats_with_any_number_of_workers(matrix):
    for workers in (1, 3):
        again = transfer(
            POLICIES, ["gym", "cartpole", "long"], episodes=20, seed=5, workers=workers
        )
        assert again.summary() == matrix.summary()
    other = transfer(POLICIES, ["cartpole"], episodes=20, seed=6)
    assert other.cells[1].evaluation.episodes != matrix.rows[1][1].evaluation.episodes


def test_the_summary_is_plain(matrix):
    summary = json.loads(json.dumps(matrix.summary(), allow_nan=False))
    assert summary["models"] == ["gym", "cartpole", "long"]
    first = summary["cells"][0]
    assert first["policy"] == "steady"
    assert first["episodes"] == 20
    assert first["low"] <= first["mean"] <= first["high"]
    assert first["time limit"] + first["off the track"] + first["pole fell"] == 20


@pytest.mark.parametrize("more", [{}, {"vary": "pole.length=0.5:2", "pool": 3}])
def test_disturbances_are_added_everywhere(more):
    added = Disturbances(delay=1, noise=0.05, **more)
    models = ["cartpole"] if more else ["gym", "cartpole"]
    found = transfer(POLICIES, models, disturbances=added, episodes=5, seed=3)
    for cell in found.cells:
        where = {"backend": "gym"} if cell.place == "gym" else {"model": cell.place}
        alone = evaluate(POLICIES[cell.policy], disturbances=added, episodes=5, seed=3, **where)
        assert cell.evaluation == alone
    said = "--vary pole.length=0.5:2 --delay 1 --noise 0.05 --pool 3"
    assert found.summary()["disturbances"] == (said if more else "--delay 1 --noise 0.05")


def test_what_varies_is_for_models_that_can():
    varied = Disturbances(vary="pole.length=0.5:2")
    with pytest.raises(ConfigError, match="leave out gym among the models, or vary"):
        transfer(POLICIES, ["gym"], disturbances=varied)
    with pytest.raises(ConfigError, match=r"'pole.length' is set, and varies"):
        find_place("cartpole", {"pole.length": 2}, disturbances=varied)


@pytest.mark.parametrize(
    ("added", "match"),
    [
        ({"delay": 500}, "no shorter than an episode"),
        ({"noise": (1, 1, 1, 1, 1, 1)}, "6 numbers for what is seen"),
        ({"vary": "pole.length=-1:1"}, r"vary 'pole.length=-1:1' cannot be"),
    ],
)
def test_disturbances_that_make_no_sense_are_refused_before_anything_is_played(added, match):
    with pytest.raises(ConfigError, match=match):
        transfer(POLICIES, ["cartpole"], disturbances=Disturbances(**added))


def test_edits_make_a_place():
    place = find_place("cartpole", {"pole.length": 1.5})
    assert place.name == "cartpole with pole.length=1.5"
    assert place.backend == "mujoco"
    assert place.cartpole.name == place.name
    edited = transfer(POLICIES, [place, "cartpole"], episodes=10)
    assert edited.rows[1][0].evaluation.episodes != edited.rows[1][1].evaluation.episodes


def test_gym_is_a_place_that_no_edit_changes():
    place = find_place("gym", {"pole.length": 1.5}, "mujoco")
    assert (place.name, place.cartpole, place.backend) == ("gym", None, "gym")


def test_the_integrator_is_the_places():
    long = load_model("long")
    euler, own = (Place(kind, long, kind) for kind in ("gym", "mujoco"))
    result = transfer(POLICIES, [euler, own], episodes=5, seed=1)
    for cell, kind in zip(result.rows[1], ("gym", "mujoco"), strict=True):
        alone = evaluate(POLICIES["clumsy"], model=long, integrator=kind, episodes=5, seed=1)
        assert cell.evaluation == alone


def test_a_model_that_cannot_be_loaded_is_named_before_any_work():
    calls = []

    class Counting(Policy):
        def __call__(self, observation):
            calls.append(observation)
            return 0

    policy = Counting(POLICIES["steady"].discretizer, POLICIES["steady"].q_table)
    with pytest.raises(ModelNotFoundError, match="no model is called 'lnog'"):
        transfer({"p": policy}, ["cartpole", "lnog"], episodes=1)
    with pytest.raises(ConfigError, match=r"pole\.length"):
        find_place("cartpole", {"pole.length": -1.0})
    assert not calls


def test_an_edited_model_that_is_refused_is_named():
    with pytest.raises((ConfigError, ModelError), match=r"cartpole with option\.timestep=0\.017"):
        find_place("cartpole", {"option.timestep": "0.017"})


@pytest.mark.parametrize("settings", [{"episodes": 0}, {"seed": -1}, {"workers": 0}], ids=str)
def test_refused_numbers(settings):
    with pytest.raises(ConfigError, match=next(iter(settings))):
        transfer(POLICIES, ["cartpole"], **settings)


def test_nothing_to_do_is_refused():
    with pytest.raises(ConfigError, match="one policy and one model"):
        transfer({}, ["cartpole"])
    with pytest.raises(ConfigError, match="one policy and one model"):
        transfer(POLICIES, [])


def test_a_simulation_that_diverges_fails_its_cell_alone():
    wild = load_model("cartpole")
    wild.model.actuator_gear[0] = 1e300
    result = transfer(POLICIES, [Place("wild", wild), "cartpole"], episodes=2)
    assert [cell.place for cell in result.failed] == ["wild", "wild"]
    assert "diverged" in result.failed[0].error
    assert np.isnan(result.means[:, 0]).all()
    assert np.isfinite(result.means[:, 1]).all()
    json.dumps(result.summary(), allow_nan=False)


def test_a_learner_of_several_seeds_is_the_mean_over_them():
    group = [POLICIES["steady"], POLICIES["clumsy"]]
    mixed = transfer({"both": group, **POLICIES}, ["long", "gym"], episodes=8, seed=5)
    for both, *alone in zip(*mixed.rows, strict=True):
        assert both.mean == pytest.approx(np.mean([cell.mean for cell in alone]))
        assert both.evaluation.minimum == min(cell.evaluation.minimum for cell in alone)
        assert len(both.evaluation.episodes) == 16
        means = sorted(cell.mean for cell in alone)
        assert both.interval == pytest.approx(tuple(means))
    with pytest.raises(ConfigError, match="poles"):
        transfer({"both": [POLICIES["steady"], POLICIES["clumsy"]]}, ["twopoles"], episodes=1)


def test_what_a_notebook_shows_is_short(matrix):
    assert repr(matrix) == "TransferResult(policies: 2, models: 3, seed 5)"
    for shown in (matrix.cells[0], matrix.cells[0].evaluation, find_place("long")):
        assert len(repr(shown)) < 250
        assert "\n" not in repr(shown)
