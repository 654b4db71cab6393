"""A command is one file and one entry in the list: a scratch one is added here."""

import importlib.util
import sys
import textwrap

import pytest

from mjcartpole import cli
from mjcartpole.commands.options import Command
from mjcartpole.commands.registry import COMMANDS, name_of

SCRATCH = '''
"""`mjcartpole count`: of how many bins a table would be."""

import math
from dataclasses import dataclass, field

from mjcartpole.commands.options import Command, Included
from mjcartpole.studies.eval_target import EvalTarget
from mjcartpole.errors import ConfigError


@dataclass(frozen=True)
class Count(Command):
    """Count what nobody asked for."""

    bins: tuple[int, ...] = (1, 2)
    """How many of each."""
    target: Included[EvalTarget] = field(default_factory=EvalTarget)

    def run(self) -> int:
        """Print it."""
        if min(self.bins) < 1:
            raise ConfigError("bins must be from 1 up")
        print(math.prod(self.bins), *self.target.set)
        return 3
'''


@pytest.fixture
def count(tmp_path, monkeypatch):
    """Add a command: its file, and its entry."""
    file = tmp_path / "count.py"
    file.write_text(textwrap.dedent(SCRATCH))
    spec = importlib.util.spec_from_file_location("mjcartpole.commands.count", file)
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, spec.name, module)
    spec.loader.exec_module(module)
    COMMANDS.append(module.Count)
    yield
    COMMANDS.remove(module.Count)


def call(words, capsys):
    """Run a command line in this process; returns exit code, stdout, stderr."""
    with pytest.raises(SystemExit) as stop:
        cli.main(words)
    return stop.value.code, *capsys.readouterr()


def test_a_new_command_is_in_the_help(count, capsys):
    code, out, err = call(["--help"], capsys)
    assert (code, err) == (0, "")
    assert "count" in out
    assert "Count what nobody asked for." in out
    code, out, _ = call(["count", "--help"], capsys)
    assert code == 0
    for said in ("--bins", "How many of each.", "--integrator", "The run's own if left out."):
        assert said in out


def test_a_new_command_runs(count, capsys):
    assert call(["count"], capsys) == (3, "2\n", "")
    words = ["count", "--set", "a.b=1,c=2", "--bins", "3,4", "--set=d=3"]
    assert call(words, capsys) == (3, "12 a.b=1 c=2 d=3\n", "")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--bins", "0,1"], "bins must be from 1 up"),
        (["--bins", "x"], "--bins: 'x' is no whole number; see mjcartpole count --help"),
        (["--bin", "1"], "perhaps you meant --bins"),
    ],
)
def test_mistakes_in_a_new_command_are_one_line(count, words, said, capsys):
    code, out, err = call(["count", *words], capsys)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert said in err


def test_commands_are_called_by_their_files_names():
    for command in COMMANDS:
        assert issubclass(command, Command)
        assert command.__module__ == f"mjcartpole.commands.{name_of(command)}"
        assert command.__doc__


def test_a_preset_is_read_for_the_command_that_is_named(capsys):
    code, _, err = call(["watch", "--preset", "article", "--help"], capsys)
    assert (code, err) == (0, "")
    code, _, err = call(["evaluate", "run", "--preset", "nothing"], capsys)
    assert (code, "--preset" in err, "available" in err) == (2, True, False)
