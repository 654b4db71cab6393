"""What a training leaves on disk, and how it is read back."""

import csv
import json

import pytest

from mjcartpole.errors import FileError, ModelError, PolicyFileError, RunError
from mjcartpole.learning import runs
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.training import train
from mjcartpole.physics.model import load_model, same_model


@pytest.fixture(scope="module")
def result():
    return train(TrainConfig.preset("article", seed=3, episodes=12))


@pytest.fixture
def run(result, tmp_path):
    folder = tmp_path / "run"
    with runs.claimed_folder(folder):
        runs.write_run(folder, result, load_model(), preset="article")
        runs.write_summary(folder, {"episodes": 12})
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
    assert runs.free_folder(tmp_path, "a").name == "a"
    (tmp_path / "a").mkdir()
    (tmp_path / "a-2").mkdir()
    assert runs.free_folder(tmp_path, "a").name == "a-3"


@pytest.mark.parametrize("name", [runs.CONFIG, runs.MODEL, runs.POLICY])
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
    (run / runs.CONFIG).write_text(text)
    with pytest.raises(RunError, match="not the config of a run, or is damaged"):
        runs.load_run(run)


def test_a_damaged_policy_is_refused(run):
    text = (run / runs.POLICY).read_text()
    (run / runs.POLICY).write_text(text[: len(text) // 2])
    with pytest.raises(PolicyFileError):
        runs.load_run(run)


def test_a_model_that_needs_other_files_is_refused_before_training(tmp_path):
    vertices = "0 0 0  1 0 0  0 1 0  0 0 1"
    obj = "".join(f"v {vertex}\n" for vertex in vertices.split("  "))
    (tmp_path / "m.obj").write_text(obj + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    text = load_model().xml
    text = text.replace("<worldbody>", '<asset><mesh name="m" file="m.obj"/></asset><worldbody>', 1)
    text = text.replace('<body name="pole">', '<body name="pole"><geom type="mesh" mesh="m"/>')
    (tmp_path / "mesh.xml").write_text(text, encoding="utf-8")
    with pytest.raises(ModelError, match="needs other files beside it"):
        runs.check_storable(load_model(tmp_path / "mesh.xml"))
    runs.check_storable(load_model())
