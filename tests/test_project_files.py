"""The project's own files agree, and what CONTRIBUTING.md quotes is the real code."""

import importlib.util
import re
import runpy
import sys
import tomllib
from pathlib import Path

import gymnasium
import numpy as np
import pytest

import mjcartpole
from command_line import call
from mjcartpole.commands import registry
from mjcartpole.envs.registration import env_id
from mjcartpole.errors import RenderError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.methods import METHODS
from mjcartpole.learning.training import train
from mjcartpole.media.scene import Scene
from mjcartpole.physics.load import load_model
from mjcartpole.task import TASKS

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
METHODS_FOLDER = "src/mjcartpole/learning/methods"
GITHUB = sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / ".github").rglob("*.yml"))
YAML = [*GITHUB, "CITATION.cff", ".readthedocs.yaml", ".pre-commit-config.yaml"]
LONGEST = 400  # lines of a file
CUT = re.compile(r"^[ +]*…\n", re.MULTILINE)


def read(name):
    return (ROOT / name).read_text(encoding="utf-8")


def parse(name):
    yaml = pytest.importorskip("yaml", reason="PyYAML comes with the extra `dev`")
    return yaml.safe_load(read(name))


def declared():
    """Names and requirements of all that pyproject.toml declares."""
    extras = PROJECT["project"]["optional-dependencies"].values()
    needed = [*PROJECT["project"]["dependencies"], *(one for extra in extras for one in extra)]
    return {plain(re.match(r"[\w.-]+", one)[0]): one for one in needed}


def plain(name):
    return re.sub(r"[-_.]+", "-", name).lower()


def pinned(name):
    lines = [line for line in read(name).splitlines() if not line.startswith("#")]
    matches = [re.fullmatch(r"([\w.-]+)==([\w.]+)(; .*)?", line) for line in lines]
    assert all(matches), lines
    return {plain(match[1]): match[2] for match in matches}


@pytest.mark.parametrize("name", YAML)
def test_it_is_yaml(name):
    assert isinstance(parse(name), dict)


@pytest.mark.parametrize("name", YAML)
def test_its_indents_are_spaces_by_twos(name):
    for number, line in enumerate(read(name).splitlines(), 1):
        indent = re.match(r"\s*", line)[0]
        assert set(indent) <= {" "}, f"{name}:{number}"
        assert len(indent) % 2 == 0 and line == line.rstrip(), f"{name}:{number}"


@pytest.mark.parametrize("name", [name for name in GITHUB if "workflows" in name])
def test_a_workflow_may_only_read_unless_it_publishes(name):
    workflow = parse(name)
    assert workflow["permissions"] == {"contents": "read"}
    rights = {job: of["permissions"] for job, of in workflow["jobs"].items() if "permissions" in of}
    publishing = {
        "release": {"publish": {"id-token": "write"}},
        "docs": {"publish": {"id-token": "write", "pages": "write"}},
    }
    assert rights == publishing.get(Path(name).stem, {})
    for job in workflow["jobs"].values():
        assert job["timeout-minutes"] and job["steps"]


@pytest.mark.parametrize("name", [name for name in GITHUB if "workflows" in name])
def test_what_a_workflow_names_is_there(name):
    text = read(name)
    named = re.findall(r"constraints/\w+\.txt|tests/\w+\.py|(?<=- run: )make [\w-]+", text)
    for one in named:
        if one.startswith("make "):
            assert re.search(rf"^{one.split()[1]}:", read("Makefile"), re.MULTILINE), one
        else:
            assert (ROOT / one).is_file(), one


TIERS = {"test": ' -m "not slow and not long"', "test-ci": ' -m "not slow"', "test-all": ""}


def test_each_command_leaves_out_what_it_says():
    recipes = re.findall(
        r"^(test[\w-]*): lint\n\t\S+ -m pytest -q -n auto(.*)$", read("Makefile"), re.MULTILINE
    )
    assert dict(recipes) == TIERS
    marks = {mark.split(":")[0] for mark in PROJECT["tool"]["pytest"]["ini_options"]["markers"]}
    assert marks == set(re.findall(r"not (\w+)", TIERS["test"]))
    ran = re.findall(r"make (test-ci|test-all|test)\b(?!-)", read(".github/workflows/test.yml"))
    assert ran == ["test-ci", "test-all"]


def test_tests_run_on_every_system_python_and_mujoco():
    matrix = parse(".github/workflows/test.yml")["jobs"]["everywhere"]["strategy"]["matrix"]
    assert [system.split("-")[0] for system in matrix["os"]] == ["ubuntu", "macos", "windows"]
    assert matrix["python"] == ["3.11", "3.12", "3.13", "3.14"]
    assert PROJECT["project"]["requires-python"] == f">={matrix['python'][0]}"
    assert declared()["mujoco"].startswith(f"mujoco>={matrix['mujoco'][0]}")


def test_pre_commit_takes_the_versions_of_ci():
    text, versions = read(".pre-commit-config.yaml"), pinned("constraints/ci.txt")
    found = dict(re.findall(r"repo: https://github\.com/[\w-]+/([\w-]+)\n +rev: v([\d.]+)", text))
    assert found == {"ruff-pre-commit": versions["ruff"], "codespell": versions["codespell"]}
    assert re.findall(r"- id: ([\w-]+)", text) == ["ruff-check", "ruff-format", "codespell", "mypy"]


def test_ci_pins_every_declared_dependency_and_names_no_place():
    versions = pinned("constraints/ci.txt")
    assert sorted(set(declared()) - set(versions)) == []


def test_ci_takes_both_mujocos_and_all_else_alike():
    first, second = pinned("constraints/ci.txt"), pinned("constraints/mujoco4.txt")
    assert (first["mujoco"].split(".")[0], second["mujoco"].split(".")[0]) == ("3", "4")
    mujoco = {name for name in second if name.startswith("mujoco")}
    others = [{one: of[one] for one in of if one not in mujoco} for of in (first, second)]
    assert others[0] == others[1], "run: make constraints"


def test_the_lowest_versions_are_those_declared():
    made = runpy.run_path(str(ROOT / "scripts" / "lowest_versions.py"))["lowest"]()
    assert made == read("constraints/lowest.txt"), "run: python scripts/lowest_versions.py"
    assert set(pinned("constraints/lowest.txt")) == set(declared())


def test_the_citation_is_of_this_version():
    version = PROJECT["project"]["version"]
    assert re.findall(r"^version: (.*)$", read("CITATION.cff"), re.MULTILINE) == [version]
    assert re.findall(r"^license: (.*)$", read("CITATION.cff"), re.MULTILINE) == [
        PROJECT["project"]["license"]
    ]


def test_the_changelog_and_the_package_are_of_this_version():
    version = PROJECT["project"]["version"]
    headings = re.findall(r"^## \[(.+)\]", read("CHANGELOG.md"), re.MULTILINE)
    assert headings == ["Unreleased"] or version in headings[:2]
    assert mjcartpole.__version__ == version


def test_the_source_distribution_has_what_is_there():
    included = PROJECT["tool"]["hatch"]["build"]["targets"]["sdist"]["include"]
    assert [name for name in included if not (ROOT / name.lstrip("/")).exists()] == []
    kept = {".gitignore", "videos", "pyproject.toml"}  # which a sdist need not have, or always has
    names = {path.name for path in ROOT.iterdir() if path.suffix in {".md", ".cff", ".yaml"}}
    assert {f"/{name}" for name in names - kept} <= set(included)


@pytest.mark.parametrize("folder", ["src", "tests", "benchmarks", "scripts"])
def test_no_file_is_long(folder):
    paths = (path.relative_to(ROOT).as_posix() for path in (ROOT / folder).rglob("*.py"))
    assert {name: n for name in paths if (n := len(read(name).splitlines())) > LONGEST} == {}


def quotes():
    """Yield kind, file and text of every block of CONTRIBUTING.md that has a title."""
    found = re.findall(r"^```(\w+) (.+)\n((?s:.*?))^```$", read("CONTRIBUTING.md"), re.MULTILINE)
    return [pytest.param(*one, id=f"{number}-{one[1]}") for number, one in enumerate(found)]


@pytest.fixture
def scratch(tmp_path, monkeypatch):
    """Import complete examples of CONTRIBUTING.md by their titles."""

    def load(title):
        word = title.rsplit(maxsplit=1)[1]
        file = tmp_path / f"scratch_{word}.py"
        texts = (quote.values[2] for quote in quotes() if quote.values[1] == f"example: {title}")
        file.write_text(next(texts), encoding="utf-8")
        spec = importlib.util.spec_from_file_location(file.stem, file)
        module = importlib.util.module_from_spec(spec)
        monkeypatch.setitem(sys.modules, spec.name, module)
        spec.loader.exec_module(module)
        return module

    return load


@pytest.mark.parametrize(("kind", "name", "text"), quotes())
def test_what_is_quoted_is_the_code(kind, name, text):
    if name.startswith("example: "):
        return
    code, before = read(name), ""
    if kind == "diff":
        before = "".join(line[1:] for line in text.splitlines(True) if line.startswith("-"))
        kept = "".join(line for line in text.splitlines(True) if not line.startswith("-"))
        text = re.sub(r"^[ +]", "", kept, flags=re.MULTILINE)
    assert not before or before not in code
    place = 0
    for piece in CUT.split(text):
        place = code.find(piece, place)
        assert place >= 0, f"{name} has not, in this order:\n{piece}"
        place += len(piece)


@pytest.mark.parametrize("method", ["sarsa", "expected_sarsa"])
def test_the_methods_are_shown_whole(method):
    name = f"{METHODS_FOLDER}/{method}.py"
    shown = {quote.values[1]: quote.values[2] for quote in quotes()}
    assert shown[name] == read(name)
    assert (ROOT / "tests" / "learning" / "methods" / f"test_{method}.py").is_file()
    assert method.replace("_", "-") in METHODS


def test_every_file_that_contributing_names_is_there():
    names = re.findall(
        r"`((?:src|tests|docs|scripts|constraints)/[\w./]*)`", read("CONTRIBUTING.md")
    )
    assert len(names) > 10
    missing = {name for name in names if not (ROOT / name).exists()}
    assert missing == {"tests/media/test_scope.py"}  # of the example


def test_the_renderer_of_the_example_draws(scratch):
    scene = Scene(load_model(), 80, 60, "side", "draft")
    renderer = scratch("a renderer").ScopeRenderer(scene)
    with renderer:
        frame = renderer.render((0.0, 0.0, 0.0, 0.0))
        assert frame.shape == (60, 80, 3)
        assert np.argwhere(frame.any(axis=2)).tolist() == [[30, 40]]
        right = renderer.render((2.3, 0.0, -0.2, 0.0))
        (row, column), *rest = np.argwhere(right.any(axis=2)).tolist()
        assert row > 50 and column > 70 and rest == []
    with pytest.raises(RenderError, match="closed"):
        renderer.render((0.0, 0.0, 0.0, 0.0))


@pytest.mark.slow
def test_the_task_of_the_example_is_learned_alike_by_both_engines(scratch):
    calm = scratch("a task").CALM
    try:
        config = TrainConfig(task=calm.name, episodes=60, seed=1)
        found = [train(config, engine=engine) for engine in ("compiled", "python")]
        assert found[0].q_table.tobytes() == found[1].q_table.tobytes()
        assert gymnasium.make(env_id(calm)).spec.max_episode_steps == 300
    finally:
        del TASKS[calm.name], gymnasium.registry[env_id(calm)]


def test_the_command_of_the_example_runs(scratch, monkeypatch, capsys):
    monkeypatch.setattr(registry, "COMMANDS", [*registry.COMMANDS, scratch("a command").Bins])
    assert call(["bins", "--preset", "article"], capsys) == (0, "1 x 1 x 25 x 25\n", "")
    code, out, err = call(["bins", "--preset", "none"], capsys)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "available: " in err
    assert "Whose." in call(["bins", "--help"], capsys)[1]
