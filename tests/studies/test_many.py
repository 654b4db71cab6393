"""Many seeds as one call."""

import doctest
import json

import pytest

from mjcartpole.errors import RunError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.policy import Policy
from mjcartpole.learning.training import train
from mjcartpole.studies import many

CONFIG = TrainConfig(backend="gym", episodes=20, seed=4)


def test_the_docstrings_hold():
    assert doctest.testmod(many).failed == 0


def test_a_folder_holds_a_run_for_each_seed_and_the_statistics(tmp_path):
    folder = tmp_path / "many"
    found = many.train_many(CONFIG, 3, workers=2, run_dir=folder)
    for one, seed in zip(found.seeds, (4, 5, 6), strict=True):
        alone = train(TrainConfig(backend="gym", episodes=20, seed=seed))
        stored = Policy.load(folder / f"seed-{seed}" / "policy.json")
        assert one.result.q_table.tobytes() == alone.q_table.tobytes() == stored.q_table.tobytes()
    written = json.loads((folder / "aggregate.json").read_text())
    assert written["greedy_return"] == found.aggregate().summary()
    with pytest.raises(RunError, match="exists"):
        many.train_many(CONFIG, 3, run_dir=folder)
    again = many.train_many(CONFIG, 2, run_dir=folder, overwrite=True)
    assert [one.seed for one in again.seeds] == [4, 5]
    assert sorted(path.name for path in folder.glob("seed-*")) == ["seed-4", "seed-5"]
