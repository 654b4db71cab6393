"""The trial of a release: its jobs are commands that there are, and a failure is one line."""

import runpy
import shlex
import sys
from pathlib import Path

import pytest

from mjcartpole.commands.parsing import parse
from mjcartpole.commands.registry import name_of

SCRIPT = Path(__file__).resolve().parents[1] / "scripts" / "release_check.py"


@pytest.fixture
def script():
    return runpy.run_path(str(SCRIPT))


def test_its_jobs_are_understood(script):
    found = [name_of(type(parse(shlex.split(job)))) for job in script["JOBS"]]
    assert found == ["train", "render", "model", "train", "page"]


def test_a_command_that_fails_is_told_in_one_line(script):
    with pytest.raises(script["FailedError"]) as told:
        script["run"](sys.executable, "-c", "print('first'); import nothing_like_it")
    said = str(told.value)
    assert said.endswith("exit code 1: ModuleNotFoundError: No module named 'nothing_like_it'")
    assert "\n" not in said


@pytest.mark.slow
def test_a_failure_ends_it_with_exit_code_1(script, tmp_path, capsys):
    main = script["main"]
    (tmp_path / "pyproject.toml").write_text("[project]\nversion = '1.0'\n")
    (tmp_path / "CHANGELOG.md").write_text("## [1.0]\n")
    # An environment with no such package, and so without its tools.
    main.__globals__.update(ROOT=tmp_path, TOOLS=["./nothing-here"])
    assert main() == 1
    captured = capsys.readouterr()
    assert "changelog" in captured.out and "has it" in captured.out
    assert captured.err.count("\n") == 1 and captured.err.startswith("release-check: ")


def test_sizes_are_of_all_files(script, tmp_path):
    (tmp_path / "inner").mkdir()
    for name in ("a", "inner/b"):
        (tmp_path / name).write_bytes(bytes(600_000))
    assert script["megabytes"](tmp_path) == "1.2 MB"
    assert script["megabytes"](tmp_path / "a") == "0.6 MB"
