"""Plots of runs, by kind."""

import numpy as np
import pytest

from mjcartpole.errors import ConfigError, RunError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.runs import begin_run, claimed_folder, write_results
from mjcartpole.learning.training import train
from mjcartpole.physics.load import load_model
from mjcartpole.studies.policy_setup import find_setup
from mjcartpole.studies.run_plots import OF_ONE, OF_SEVERAL, numbers, phase, plot

CONFIG = TrainConfig(episodes=30, backend="gym", seed=1)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "a"
    result = train(CONFIG)
    with claimed_folder(folder):
        begin_run(folder, CONFIG, load_model(), preset="tuned")
        write_results(folder, result, {})
    return folder, result


@pytest.mark.parametrize("kind", [*OF_ONE, *OF_SEVERAL])
def test_every_kind_is_drawn_from_a_folder(kind, run):
    options = {"points": 5} if kind == "basin" else {}
    figure = plot(kind, str(run[0]), **options)
    assert type(figure).__name__ == "Figure"
    assert len(list(numbers(kind, [run[0]], **options).rows())) > 20


def test_a_table_has_the_visits_of_its_run_and_a_policys_file_has_none(run):
    folder, result = run
    of_run = numbers("table", [folder])
    seen = sum(field.values.sum() for field in of_run.fields[2])
    assert seen == result.steps
    assert list(numbers("table", [folder / "policy.json"]).notes) == ["its visits were not counted"]


def test_a_phase_has_the_episodes_of_an_evaluation(run):
    grid = phase(find_setup(run[0]), episodes=2)
    rows = [row for row in grid.rows() if row["what"] == "path"]
    assert [len(path.points) for path in grid.paths] == [
        sum(row["episode"] == number for row in rows) for number in (1, 2)
    ]
    assert np.abs(grid.paths[0].points[0]).max() <= 0.05
    assert grid.paths[0].lasted == (grid.paths[0].ending == "time limit")


def test_endings_add_up_and_know_their_sides(run):
    columns = run[1].episodes.columns
    (shown,), looks = (found := numbers("endings", [run[0]])).runs, found.looks
    assert shown.shares.sum(axis=0) == pytest.approx(1.0)
    assert shown.greedy.sum() == pytest.approx(1.0)
    names = [name for _, name in looks]
    lefts = ((columns.endings == 2) & (columns.sides == 1)).sum()
    at = names.index("pole fell left")
    assert (shown.shares[at] * np.diff([0, *shown.episodes])).sum() == pytest.approx(lefts)
    assert "pole fell" not in names


def test_what_is_refused(run):
    with pytest.raises(ConfigError, match="kind of plot 'pie' is unknown; available: curve"):
        plot("pie", run[0])
    with pytest.raises(ConfigError, match="plot basin is for one run, not 2"):
        plot("basin", run[0], run[0])
    with pytest.raises(ConfigError, match="plot curve needs a run folder"):
        plot("curve")
    with pytest.raises(RunError, match="no run folder"):
        plot("curve", run[0] / "policy.json")
