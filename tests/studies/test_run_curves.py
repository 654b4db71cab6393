"""Learning curves of runs, alone and as bands."""

import numpy as np
import pytest

from mjcartpole.errors import ConfigError, RunError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.episodes import Columns
from mjcartpole.learning.records import Record
from mjcartpole.studies.multi_seed import train_many
from mjcartpole.studies.run_curves import curves_of, line_of_seeds, read_groups
from mjcartpole.studies.statistics import bootstrap_band
from mjcartpole.task import SWING_UP


@pytest.fixture(scope="module")
def many(tmp_path_factory):
    """Three seeds in one folder."""
    folder = tmp_path_factory.mktemp("runs") / "tuned-gym-seeds0-2"
    train_many(TrainConfig(episodes=30, backend="gym", evaluate_every=10), 3, run_dir=folder)
    return folder


def record(*returns, seed=0, **changes):
    totals = np.array(returns, float)
    n = len(returns)
    columns = Columns(totals, np.ones(n, np.int32), *(np.zeros(n, np.int8),) * 2)
    return Record(None, TrainConfig(seed=seed, **changes), columns, ())


def test_seeds_are_one_line_whether_in_one_folder_or_given_one_by_one(many):
    apart = [many / f"seed-{seed}" for seed in (0, 1, 2)]
    together, one_by_one = curves_of(read_groups([many])), curves_of(read_groups(apart))
    (line,), (same,) = together.lines, one_by_one.lines
    assert line.name == "tuned-gym-seeds0-2"
    assert (line.seeds == 3).all()
    assert line.middle.tolist() == same.middle.tolist()
    assert line.greedy[0].tolist() == [10, 20, 30]
    (alone,) = curves_of(read_groups(apart[:1])).lines
    assert (alone.name, alone.interval) == ("seed-0", None)


def test_the_same_run_twice_counts_once(many):
    ((_, records),) = read_groups([many, many / "seed-1", many])
    assert [each.config.seed for each in records] == [0, 1, 2]


def test_a_folder_without_episodes_is_one_line_and_an_unfinished_seed_is_left_out(many, tmp_path):
    import shutil

    copy = shutil.copytree(many, tmp_path / "copy")
    shutil.rmtree(copy / "seed-1")
    assert len(read_groups([copy])[0][1]) == 2
    for seed in (0, 2):
        (copy / f"seed-{seed}" / "episodes.csv").unlink()
    with pytest.raises(RunError, match=r"no episode of a seed in .* is finished"):
        read_groups([copy])


def test_a_line_of_seeds_has_the_band_of_its_running_means():
    rng = np.random.default_rng(0)
    returns = [rng.uniform(0, 500, 50) for _ in range(6)]
    line = line_of_seeds("s", returns, 10, "iqm")
    means = np.array([np.convolve(each, np.full(10, 0.1), "valid") for each in returns])
    middle, low, high = bootstrap_band(means, "iqm")
    assert line.episodes.tolist() == list(range(10, 51))
    for ours, theirs in zip((line.middle, *line.interval), (middle, low, high), strict=True):
        assert ours == pytest.approx(theirs)


def test_where_seeds_are_over_the_others_go_on():
    line = line_of_seeds("s", [np.full(20, 10.0), np.full(40, 30.0), np.full(3, 1.0)], 5)
    assert line.seeds.tolist() == [2] * 16 + [1] * 20
    assert line.middle.tolist() == [20.0] * 16 + [30.0] * 20
    short = line_of_seeds("s", [np.full(1, 7.0), np.full(1, 9.0)], 5)
    assert (short.episodes.tolist(), short.middle.tolist()) == ([1], [8.0])


def test_the_window_is_a_fortieth_and_the_scale_is_of_the_task():
    groups = [("a", [record(*range(80))])]
    curves = curves_of(groups)
    assert (curves.window, curves.span, curves.solved_at) == (2, (0, 500), 475.0)
    other = [*groups, ("b", [record(1.0, task=SWING_UP.name)])]
    assert curves_of(other).span == (None, None)
    with pytest.raises(ConfigError, match="window must be a whole number of episodes"):
        curves_of(groups, window=0)
