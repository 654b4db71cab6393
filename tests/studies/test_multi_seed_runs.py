"""The folder of many seeds."""

import json
import shutil

import pytest

from mjcartpole.errors import FileError, RunError
from mjcartpole.learning import documents, folders, runs
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.episodes import Episode
from mjcartpole.learning.evaluation import Evaluation
from mjcartpole.physics.load import load_model, same_model
from mjcartpole.studies import multi_seed_runs
from mjcartpole.studies.multi_seed import SeedJob, SeedRunner, chosen_for
from mjcartpole.studies.seeds import ManyResult, SeedResult
from nightly import few

CONFIG = TrainConfig(episodes=5, backend="gym", seed=2)

OURS = set(multi_seed_runs.FILES) - {"versions.json", runs.CURVE}


def claim(folder, **options):
    with multi_seed_runs.claimed_seeds(folder, **options):
        pass


def job(config, folder):
    return SeedJob(config, *chosen_for(config, load_model(), "compiled"), folder, "article")


def train_in(folder, seeds=2, config=CONFIG, **options):
    runner = SeedRunner(job(config, folder), seeds)
    with multi_seed_runs.claimed_seeds(folder, **options):
        multi_seed_runs.begin_seeds(folder, config, runner.seeds, load_model(), preset="article")
        for _ in runner.run(lambda: False):
            pass
        multi_seed_runs.write_seeds(folder, runner.result())
    return runner.result()


def evaluation_of(*returns):
    episodes = [Episode(n, float(one), one, "pole fell") for n, one in enumerate(returns)]
    return Evaluation("gym", 0, tuple(episodes))


def names(folder):
    return sorted(path.name for path in folder.iterdir() if path.name != "versions.json")


def test_what_many_seeds_leave(tmp_path):
    many = train_in(tmp_path / "many")
    assert names(tmp_path / "many") == sorted([*OURS, "seed-2", "seed-3"])
    for found in many.seeds:
        folder = multi_seed_runs.seed_folder(tmp_path / "many", found.seed)
        assert runs.is_complete(folder)
        run = runs.load_run(folder)
        assert (run.config, run.preset) == (found.result.config, "article")
        assert documents.read_summary(folder)["evaluation"] == found.evaluation.summary()


def test_a_seed_that_is_complete_on_disk_has_the_same_evaluation(tmp_path):
    first = train_in(tmp_path / "many")
    again = SeedRunner(job(CONFIG, tmp_path / "many"), 2)
    for _ in again.run(lambda: False):
        pass
    evaluations = [[found.evaluation for found in many.seeds] for many in (first, again.result())]
    assert evaluations[0] == evaluations[1]
    assert evaluations[0][0].endings.keys() == {"time limit", "off the track", "pole fell"}


def test_seeds_without_a_policy_are_told_apart(tmp_path):
    folder = tmp_path / "many"
    train_in(folder)
    assert not multi_seed_runs.is_seeds(folder / "seed-2")
    assert multi_seed_runs.learned_seeds(folder) == (
        {2: folder / "seed-2", 3: folder / "seed-3"},
        [],
    )
    (folder / "seed-2" / "policy.json").unlink()
    assert multi_seed_runs.learned_seeds(folder) == ({3: folder / "seed-3"}, [2])
    (folder / "seed-3" / "policy.json").unlink()
    with pytest.raises(RunError, match="train --resume"):
        multi_seed_runs.learned_seeds(folder)


def test_a_seed_that_is_another_run_is_refused(tmp_path):
    folder = tmp_path / "many"
    train_in(folder)
    (folder / "seed-3").rename(tmp_path / "elsewhere")
    (folder / "seed-3").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(RunError, match="is a link"):
        multi_seed_runs.learned_seeds(folder)
    (folder / "seed-3").unlink()
    shutil.copytree(folder / "seed-2", folder / "seed-3")
    with pytest.raises(RunError, match="is the run of another seed"):
        multi_seed_runs.learned_seeds(folder)


def test_what_was_begun_comes_back(tmp_path):
    train_in(tmp_path / "many", seeds=[8, 3])
    with multi_seed_runs.resumed_seeds(tmp_path / "many") as begun:
        assert (begun.preset, begun.config, begun.seeds) == ("article", CONFIG, (8, 3))
        assert same_model(begun.cartpole.model, load_model().model)
        assert begun.cartpole.name == "cartpole"
        with pytest.raises(RunError, match="in use by another training"):
            claim(tmp_path / "many", overwrite=True)
    assert not (tmp_path / "many" / folders.LOCK).exists()


def test_the_table_and_the_figures(tmp_path):
    many = ManyResult(
        CONFIG,
        (
            SeedResult(2, evaluation_of(661, 300)),
            SeedResult(3, error="it fell, over"),
            SeedResult(4),
            SeedResult(5, evaluation_of(191, 9)),
        ),
    )
    multi_seed_runs.write_seeds(tmp_path, many)
    assert (tmp_path / multi_seed_runs.TABLE).read_text().splitlines() == [
        "seed,mean,minimum,failed",
        "2,480.5,300.0,no",
        "3,,,yes",
        "4,,,no",
        "5,100.0,9.0,no",
    ]
    figures = json.loads((tmp_path / multi_seed_runs.AGGREGATE).read_text())
    assert (figures["seeds"], figures["failed"]) == (4, {"3": "it fell, over"})
    assert figures["greedy_return"]["mean"] == 290.25
    assert figures["greedy_return"]["minimum"] == 100
    assert figures["greedy_return"]["solved"] == 0.5


def test_without_scores_there_are_no_figures(tmp_path):
    multi_seed_runs.write_seeds(tmp_path, ManyResult(CONFIG, (SeedResult(2, error="no"),)))
    assert json.loads((tmp_path / multi_seed_runs.AGGREGATE).read_text())["greedy_return"] is None


def test_seeds_that_are_there_need_overwrite_and_then_go(tmp_path):
    folder = tmp_path / "many"
    train_in(folder, seeds=4)
    with pytest.raises(RunError, match=r"exists; .* go on with --resume .*, or .* --overwrite"):
        claim(folder)
    train_in(folder, seeds=[3], overwrite=True)
    assert names(folder) == sorted([*OURS, "seed-3"])


def test_overwriting_removes_nothing_that_is_not_ours(tmp_path):
    folder = tmp_path / "many"
    train_in(folder)
    (folder / "notes.txt").write_text("mine")
    (folder / "seed-2" / "notes.txt").write_text("mine")
    (folder / "seed-9").mkdir()
    claim(folder, overwrite=True)
    assert (folder / "notes.txt").read_text() == "mine"
    assert [path.name for path in (folder / "seed-2").iterdir()] == ["notes.txt"]
    assert (folder / "seed-9").is_dir()


@pytest.mark.parametrize("overwrite", [False, True])
@pytest.mark.parametrize("names", [["thesis.tex"], ["model.xml"], ["config.json"], ["seed-0"]])
def test_files_of_somebody_else_are_never_taken(names, overwrite, tmp_path):
    for name in names:
        (tmp_path / name).write_text("years of work")
    with pytest.raises(RunError, match="holds other files"):
        claim(tmp_path, overwrite=overwrite)
    assert sorted(path.name for path in tmp_path.iterdir()) == names


LEFT = [folders.LOCK, ".seeds-0123abcd.json", ".model-0123abcd.xml"]


@pytest.mark.parametrize("left", few(LEFT, folders.LOCK))
def test_what_a_kill_in_the_first_moment_leaves_is_no_obstacle(left, tmp_path):
    (tmp_path / left).write_text("")
    train_in(tmp_path)
    assert names(tmp_path) == sorted([*OURS, "seed-2", "seed-3"])


def test_an_empty_folder_goes_again_if_nothing_came_of_it(tmp_path):
    claim(tmp_path / "deep" / "many")
    assert not (tmp_path / "deep" / "many").exists()


def test_a_file_in_the_way(tmp_path):
    (tmp_path / "many").write_text("")
    with pytest.raises(FileError):
        claim(tmp_path / "many")


DAMAGED = ["", "{", "[]", "{}", '{"seeds": [1], "config": {"gamma": 9}}']


@pytest.mark.parametrize("text", few(DAMAGED, *DAMAGED[::4]))
def test_damaged_seeds_are_refused(text, tmp_path):
    train_in(tmp_path)
    (tmp_path / multi_seed_runs.SEEDS).write_text(text)
    with (
        pytest.raises(RunError, match="does not name the seeds of a run, or is damaged"),
        multi_seed_runs.resumed_seeds(tmp_path),
    ):
        pass


@pytest.mark.parametrize("seeds", few([[], [1, 1], [-1], list(range(100_001))], [1, 1]))
def test_seeds_are_held_to_their_limits_on_resume_and_overwrite(seeds, tmp_path):
    train_in(tmp_path)
    path = tmp_path / multi_seed_runs.SEEDS
    path.write_text(json.dumps({**json.loads(path.read_text()), "seeds": seeds}))
    with pytest.raises(RunError, match="must be"), multi_seed_runs.resumed_seeds(tmp_path):
        pass
    with pytest.raises(RunError, match="must be"):
        claim(tmp_path, overwrite=True)


def test_a_complete_seed_of_another_config_is_not_counted(tmp_path):
    train_in(tmp_path)
    runner = SeedRunner(job(TrainConfig(episodes=6, backend="gym", seed=2), tmp_path), 2)
    for _ in runner.run(lambda: False):
        pass
    assert all("another config" in found.error for found in runner.result().failed)
    assert len(runner.result().failed) == 2


@pytest.mark.parametrize("overwrite", [False, True])
def test_a_seed_that_is_a_link_is_refused_and_nothing_is_lost(overwrite, tmp_path):
    folder, mine = tmp_path / "many", tmp_path / "mine"
    train_in(folder)
    (folder / "seed-2").rename(mine)
    (folder / "seed-2").symlink_to(mine)
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    if overwrite:
        with pytest.raises(RunError, match="seed-2' is a link"):
            claim(folder, overwrite=True)
    else:
        runner = SeedRunner(job(CONFIG, folder), 2)
        for _ in runner.run(lambda: False):
            pass
        assert ["is a link" in found.error for found in runner.result().seeds] == [True, False]
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


@pytest.mark.long
def test_an_overwriting_that_was_killed_is_gone_on_with(tmp_path):
    train_in(tmp_path)
    (tmp_path / "seed-2" / "config.json").unlink()
    train_in(tmp_path, overwrite=True)
    (tmp_path / multi_seed_runs.SEEDS).unlink()
    for seed in (2, 3):
        runs.remove_run(tmp_path / f"seed-{seed}")
    train_in(tmp_path)
    assert names(tmp_path) == sorted([*OURS, "seed-2", "seed-3"])
