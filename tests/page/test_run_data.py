"""What a page needs of a run: whole, and to the bit."""

import base64
import gzip
import json
import math

import numpy as np
import pytest

from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.errors import ConfigError
from mjcartpole.learning.discretizer import Discretizer
from mjcartpole.learning.policy import Policy
from mjcartpole.page.run_data import packed, run_data
from mjcartpole.page.told import Picture, Told
from mjcartpole.physics.load import load_model
from mjcartpole.studies.film import play
from mjcartpole.studies.policy_setup import PolicySetup
from mjcartpole.task import Task

GRID = Discretizer((1, 1, 2, 2), (-2.4, -1.0, -0.2, -1.0), (2.4, 1.0, 0.2, 1.0))


def setup(**changes):
    policy = Policy(GRID, np.arange(8.0).reshape(1, 1, 2, 2, 2) * [1.0, 1.1])
    return PolicySetup("mine", policy, **changes)


def unpacked(text):
    return np.frombuffer(gzip.decompress(base64.b64decode(text)), "<f8")


@pytest.mark.parametrize("numbers", [[], [0.1, -0.0, 1e-310, 1.7e308]])
def test_numbers_are_packed_to_the_bit(numbers):
    found = unpacked(packed(np.array(numbers)))
    assert found.tobytes() == np.array(numbers).tobytes()


def test_the_episode_is_the_first_that_is_played():
    data = run_data(setup(), Told(), "mujoco")
    (rollout,) = play(setup())
    assert unpacked(data["episode"]["states"]).tobytes() == rollout.states.tobytes()
    assert data["episode"]["ending"] == rollout.episode.ending


def test_what_was_added_is_told_and_not_played():
    some = Disturbances(delay=3, noise=0.1)
    data = run_data(setup(disturbances=some), Told(), "mujoco")
    assert data["disturbances"] == "--delay 3 --noise 0.1"
    assert data["episode"] == run_data(setup(), Told(), "mujoco")["episode"]
    assert run_data(setup(), Told(), "mujoco")["disturbances"] == ""


def test_a_table_that_looks_at_actions_before_is_refused():
    grid = Discretizer((1, 1, 2, 2, 2), (*GRID.low, -1.0), (*GRID.high, 1.0), actions=1)
    sees = PolicySetup("sees", Policy(grid, np.zeros((*grid.shape, 2))))
    with pytest.raises(ConfigError, match="sees looks at actions before"):
        run_data(sees, Told(), "mujoco")


def test_the_table_and_the_grid_are_the_policys():
    data = run_data(setup(), Told(), "mujoco")
    assert unpacked(data["table"]).tobytes() == setup().policy.q_table.tobytes()
    assert data["grid"]["bins"] == (1, 1, 2, 2) and data["grid"]["tilings"] == 1


def test_the_model_is_the_document_that_runs():
    edited = load_model("long", {"pole.mass": 0.3})
    data = run_data(setup(model=edited, integrator="mujoco"), Told(), "mujoco")
    assert data["document"] == edited.stored[0] and 'mass="0.3"' in data["document"]
    assert data["parts"]["controls"] == edited.controls
    assert data["integrator"] == "mujoco" and not data["own_timestep"]


def test_an_unlimited_track_is_json():
    task = Task("endless", x_limit=math.inf, time_limit=20)
    data = run_data(setup(task=task), Told(), "mujoco")
    assert data["task"]["x_limit"] is None
    json.dumps(data, allow_nan=False)


def test_what_is_told_is_in_words_and_pictures_are_data(tmp_path):
    film = tmp_path / "mine.mp4"
    film.write_bytes(b"film")
    told = Told(
        {"Mean": 499.5}, {"bins": [1, 2], "mirror": None, "set": []},
        pictures=(Picture("Curve", "It rises", "<svg/>"),), film=film,
    )  # fmt: skip
    data = run_data(setup(), told, "mujoco")
    assert data["facts"] == [["Mean", "499.5"]]
    assert data["config"] == [["bins", "1, 2"], ["mirror", "none"], ["set", "none"]]
    assert gzip.decompress(base64.b64decode(data["pictures"][0]["svg"])) == b"<svg/>"
    assert data["film"] == "data:video/mp4;base64,ZmlsbQ=="
