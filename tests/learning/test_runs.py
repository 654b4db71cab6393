"""What a training leaves on disk, and how it is read back."""

import contextlib
import csv
import dataclasses
import json

import pytest

from mjcartpole.errors import CheckpointError, FileError, ModelError, PolicyFileError, RunError
from mjcartpole.learning import documents, folders, run_model, runs
from mjcartpole.learning.checkpoints import LATEST
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.session import Session
from mjcartpole.learning.training import Training, train
from mjcartpole.physics.load import load_model, same_model

SUMMARY = {
    "preset": "article",
    "backend": "mujoco",
    "model": "cartpole",
    "seed": 3,
    "episodes": 12,
    "interrupted": False,
    "steps": 200,
    "mean_return_last_100": 16.5,
    "evaluation": {
        "backend": "mujoco",
        "seed": 1_000_000,
        "episodes": 100,
        "mean": 20.5,
        "minimum": 9.0,
        "endings": {"time limit": 0, "off the track": 1, "pole fell": 99},
    },
}


@pytest.fixture(scope="module")
def result():
    return train(TrainConfig.preset("article", seed=3, episodes=12))


@pytest.fixture
def run(result, tmp_path):
    folder = tmp_path / "run"
    with runs.claimed_folder(folder):
        runs.begin_run(folder, result.config, load_model(), preset="article", video=True)
        runs.write_results(folder, result, SUMMARY)
    return folder


def test_a_run_is_complete_and_comes_back(run, result):
    assert sorted(path.name for path in run.iterdir()) == sorted(runs.FILES)
    again = runs.load_run(run)
    assert again.config == result.config
    assert again.preset == "article"
    assert again.policy.q_table.tobytes() == result.q_table.tobytes()
    assert same_model(load_model(again.model).model, load_model().model)


def test_the_episodes_are_all_there(run, result):
    with (run / runs.EPISODES).open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["episode"]) for row in rows] == list(range(1, 13))
    assert [float(row["return"]) for row in rows] == result.returns.tolist()
    assert sum(int(row["steps"]) for row in rows) == result.steps
    assert {row["ending"] for row in rows} <= {"time limit", "off the track", "pole fell"}


def test_the_versions_are_named(run):
    versions = json.loads((run / runs.VERSIONS).read_text())
    assert {"python", "platform", "mjcartpole", "mujoco", "gymnasium", "numpy"} <= set(versions)


def claim(folder, **options):
    with runs.claimed_folder(folder, **options):
        pass


def test_a_run_is_not_overwritten_by_accident(run):
    before = {path.name: path.read_bytes() for path in run.iterdir()}
    with pytest.raises(RunError, match=r"exists; choose another --run-dir, or .* --overwrite"):
        claim(run)
    claim(run, overwrite=True)
    assert {path.name: path.read_bytes() for path in run.iterdir()} == before


def test_a_folder_with_other_files_is_never_taken(tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    for overwrite in (False, True):
        with pytest.raises(RunError, match="holds other files"):
            claim(tmp_path, overwrite=overwrite)


def test_an_empty_folder_is_taken_and_goes_again_if_nothing_came_of_it(tmp_path):
    (tmp_path / "empty").mkdir()
    claim(tmp_path / "empty")
    assert list(tmp_path.iterdir()) == []


def test_a_file_in_the_way(tmp_path):
    (tmp_path / "run").write_text("")
    with pytest.raises(FileError):
        claim(tmp_path / "run")


def test_free_folders_are_counted(tmp_path):
    assert folders.free_folder(tmp_path, "a").name == "a"
    (tmp_path / "a").mkdir()
    (tmp_path / "a-2").mkdir()
    assert folders.free_folder(tmp_path, "a").name == "a-3"


@pytest.mark.parametrize("name", [documents.CONFIG, run_model.MODEL, runs.POLICY])
def test_a_missing_file_is_named(run, name):
    (run / name).unlink()
    with pytest.raises(RunError, match=f"{name} missing"):
        runs.load_run(run)


def test_a_folder_that_is_not_there(tmp_path):
    with pytest.raises(RunError, match="no run folder or policy file"):
        runs.load_run(tmp_path / "nothing")


@pytest.mark.parametrize(
    "text",
    ["", "{", "[]", "{}", '{"preset": "tuned", "bins": 3}', '{"preset": "x", "unknown": 1}'],
)
def test_a_damaged_config_is_refused(run, text):
    (run / documents.CONFIG).write_text(text)
    with pytest.raises(RunError, match="not the config of a run, or is damaged"):
        runs.load_run(run)


def test_a_damaged_policy_is_refused(run):
    text = (run / runs.POLICY).read_text()
    (run / runs.POLICY).write_text(text[: len(text) // 2])
    with pytest.raises(PolicyFileError):
        runs.load_run(run)


def test_a_model_is_stored_as_long_as_its_other_files_are_there(tmp_path):
    vertices = "0 0 0  1 0 0  0 1 0  0 0 1"
    obj = "".join(f"v {vertex}\n" for vertex in vertices.split("  "))
    (tmp_path / "m.obj").write_text(obj + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    text = load_model().xml
    text = text.replace("<worldbody>", '<asset><mesh name="m" file="m.obj"/></asset><worldbody>', 1)
    text = text.replace('<body name="pole">', '<body name="pole"><geom type="mesh" mesh="m"/>')
    (tmp_path / "mesh.xml").write_text(text, encoding="utf-8")
    cartpole = load_model(tmp_path / "mesh.xml")
    run_model.check_storable(cartpole)
    (tmp_path / "m.obj").unlink()
    with pytest.raises(ModelError, match=r"a file of the model cannot be read: .*m\.obj"):
        run_model.check_storable(dataclasses.replace(cartpole))


def test_a_run_with_a_mesh_is_continued_elsewhere(tmp_path):
    obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    (tmp_path / "here").mkdir()
    (tmp_path / "here" / "m.obj").write_text(obj)
    mesh = '<asset><mesh name="m" file="m.obj"/></asset><worldbody>'
    model = tmp_path / "here" / "mesh.xml"
    model.write_text(load_model().xml.replace("<worldbody>", mesh, 1), encoding="utf-8")
    config = TrainConfig(model=str(model), episodes=40)
    runs.begin_run(tmp_path / "run", config, config.load_model(), preset="tuned")
    checkpointed(tmp_path / "run", config, 10)
    (tmp_path / "here").rename(tmp_path / "gone")
    (tmp_path / "run").rename(tmp_path / "moved")
    for _ in range(2):
        with runs.resumed_folder(tmp_path / "moved") as begun:
            assert begun.checkpoint is not None
            assert begun.cartpole.model.nmesh == 1
            training = Training(begun.config, cartpole=begun.cartpole)
            session = Session(tmp_path / "moved", training, begun.cartpole, every=0)
            session.resume(begun.checkpoint)
            session.save()
    (asset,) = (tmp_path / "moved").glob("asset-*")
    asset.rename(tmp_path / "m.obj")
    asset.symlink_to(tmp_path / "m.obj")
    with pytest.raises(ModelError, match=r"lies outside the run's folder.*--allow-assets"):
        runs.resumed_folder(tmp_path / "moved").__enter__()
    with runs.resumed_folder(tmp_path / "moved", [tmp_path]) as begun:
        assert begun.checkpoint is not None
    runs.remove_run(tmp_path / "moved")
    assert not (tmp_path / "moved").exists()
    assert (tmp_path / "m.obj").read_text() == obj


def test_a_run_may_be_replaced_by_one_with_its_own_model(tmp_path):
    (tmp_path / "m.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\n")
    mesh = '<asset><mesh name="m" file="m.obj"/></asset><worldbody>'
    (tmp_path / "m.xml").write_text(load_model().xml.replace("<worldbody>", mesh, 1))
    config = TrainConfig(model=str(tmp_path / "m.xml"))
    runs.begin_run(tmp_path / "run", config, config.load_model(), preset="tuned")
    config = TrainConfig(model=str(tmp_path / "run" / "model.xml"))
    (tmp_path / "run" / f"asset-{'0' * 32}.obj").touch()
    runs.begin_run(tmp_path / "run", config, config.load_model(), preset="tuned")
    assert len(list((tmp_path / "run").glob("asset-*"))) == 1
    assert load_model(tmp_path / "run" / "model.xml").model.nmesh == 1


def checkpointed(folder, config, episodes):
    """Leave checkpoints in a folder, as a training that was killed does."""
    training = Training(config)
    cartpole = load_model(config.model)
    session = Session(folder, training, cartpole, every=0)
    for _ in training.run():
        if len(training.log) >= episodes:
            break
    session.save()
    session.save()


@pytest.fixture
def begun(result, tmp_path):
    """A run that was killed, with two checkpoints."""
    folder = tmp_path / "begun"
    with contextlib.suppress(KeyboardInterrupt), runs.claimed_folder(folder):
        runs.begin_run(folder, result.config, load_model(), preset="article", video=True)
        checkpointed(folder, result.config, 5)
        raise KeyboardInterrupt
    return folder


def resumed(path):
    with runs.resumed_folder(path) as found:
        return found


def test_a_run_that_was_begun_comes_back(begun, result):
    for path in (begun, begun / LATEST):
        found = resumed(path)
        assert (found.folder, found.preset, found.video) == (begun, "article", True)
        assert found.config == result.config
        assert found.cartpole.name == "cartpole"
        assert same_model(found.cartpole.model, load_model().model)
        assert found.checkpoint.episodes >= 5
    assert sorted(path.name for path in begun.iterdir()) == sorted([*runs.BEGINNING, LATEST])


def test_a_run_without_checkpoints_begins_again(begun):
    (begun / LATEST).unlink()
    assert resumed(begun).checkpoint is None


def test_a_damaged_checkpoint_is_refused_and_a_good_copy_is_taken(begun):
    good = begun / "copy.bin"
    (begun / LATEST).rename(good)
    (begun / LATEST).write_bytes(b"damaged")
    with pytest.raises(CheckpointError, match="start again with --overwrite"):
        resumed(begun)
    assert (begun / LATEST).read_bytes() == b"damaged"
    assert resumed(good).checkpoint.episodes >= 5


def test_a_folder_is_locked_once(begun):
    with runs.resumed_folder(begun):
        with pytest.raises(RunError, match="in use by another training"):
            resumed(begun)
        with pytest.raises(RunError, match="in use by another training"):
            claim(begun, overwrite=True)
        with pytest.raises(RunError, match="in use by another training"):
            runs.remove_run(begun)
    resumed(begun)
    assert not (begun / folders.LOCK).exists()


def test_a_run_is_complete_when_its_checkpoints_are_gone(begun, result):
    assert not runs.is_complete(begun)
    runs.write_results(begun, result, SUMMARY)
    assert not runs.is_complete(begun)
    runs.finish_run(begun)
    assert runs.is_complete(begun)
    assert sorted(path.name for path in begun.iterdir()) == sorted(runs.FILES)
    assert documents.read_summary(begun) == SUMMARY
    assert runs.check_complete(begun).config == result.config
    assert runs.load_run(begun).preset == "article"


def test_a_run_without_results_says_how_to_go_on(begun):
    with pytest.raises(RunError, match=f"policy.json missing; go on with .*--resume {begun}"):
        runs.load_run(begun)


@pytest.mark.parametrize("text", ["", "{", None])
def test_a_summary_that_cannot_be_read(run, text):
    (run / documents.SUMMARY).unlink()
    if text is not None:
        (run / documents.SUMMARY).write_text(text)
    with pytest.raises(RunError, match=r"summary\.json' cannot be read"):
        documents.read_summary(run)


def test_beginning_again_mixes_nothing_with_the_older_run(begun, result):
    (begun / "events.out.tfevents.1.x").write_text("of the older run")
    with runs.claimed_folder(begun, overwrite=True):
        runs.begin_run(begun, result.config, load_model(), preset="tuned")
        assert sorted(path.name for path in begun.iterdir()) == sorted(
            [*runs.BEGINNING, folders.LOCK]
        )


def test_removing_a_run_removes_nothing_else(begun):
    (begun / "notes.txt").write_text("mine")
    (begun / "events.out.tfevents.1.x").write_text("of the run")
    runs.remove_run(begun)
    assert [path.name for path in begun.iterdir()] == ["notes.txt"]
    (begun / "notes.txt").unlink()
    runs.remove_run(begun)
    assert not begun.exists()
    runs.remove_run(begun)


@pytest.mark.parametrize("left", [[], [runs.VERSIONS], [runs.VERSIONS, run_model.MODEL]])
def test_what_a_kill_in_the_first_moment_leaves_is_no_obstacle(left, tmp_path, result):
    for name in left:
        (tmp_path / name).write_text("left by a kill")
    (tmp_path / ".model-0123abcd.xml").write_text("left by a kill")
    (tmp_path / folders.LOCK).write_text("")
    with runs.claimed_folder(tmp_path):
        runs.begin_run(tmp_path, result.config, load_model(), preset="article")
        assert sorted(path.name for path in tmp_path.iterdir()) == sorted(
            [*runs.BEGINNING, folders.LOCK]
        )


@pytest.mark.parametrize("overwrite", [False, True])
@pytest.mark.parametrize("names", [["model.xml"], ["model.xml", "thesis.tex"], ["seeds.json"]])
def test_files_of_somebody_else_are_never_taken(names, overwrite, tmp_path):
    for name in names:
        (tmp_path / name).write_text("years of work")
    with pytest.raises(RunError, match="holds other files"):
        claim(tmp_path, overwrite=overwrite)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(names)


@pytest.mark.parametrize("document", ["cartpole", "long", "elsewhere.xml", "/etc/passwd", ""])
def test_a_stored_model_is_never_taken_for_a_name_or_a_path(document, begun, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "elsewhere.xml").write_text("a secret")
    (begun / run_model.MODEL).write_text(document)
    with pytest.raises(ModelError, match=r"model\.xml' is not a valid MJCF") as refused:
        resumed(begun)
    assert "secret" not in str(refused.value)


def test_a_complete_run_is_read_before_it_is_said_to_be_so(run, result):
    assert runs.check_complete(run).config == result.config
    summary = run / documents.SUMMARY
    for change, why in (
        ({"interrupted": True}, "not over"),
        ({"seed": 4}, "seed of another training"),
        ({"evaluation": {}}, "is missing"),
    ):
        summary.write_text(json.dumps({**SUMMARY, **change}))
        with pytest.raises(RunError, match=why):
            runs.check_complete(run)
    fewer = {**SUMMARY, "episodes": SUMMARY["episodes"] - 1}
    for change in ({}, {"stopped": "since somebody says so"}):
        summary.write_text(json.dumps(fewer | change))
        with pytest.raises(RunError, match="episodes of another training"):
            runs.check_complete(run)
    summary.write_text(json.dumps(SUMMARY))
    (run / documents.CONFIG).write_text("{}")
    with pytest.raises(RunError, match="is not the config of a run"):
        runs.check_complete(run)


def test_a_folder_in_the_place_of_a_file_is_told_before_anything_is_lost(begun):
    (begun / runs.POLICY).mkdir()
    before = sorted(begun.iterdir())
    with pytest.raises(RunError, match="is a folder where a run has a file"):
        resumed(begun)
    with pytest.raises(RunError, match="is a folder where a run has a file"):
        claim(begun, overwrite=True)
    assert sorted(begun.iterdir()) == before
