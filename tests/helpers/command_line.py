"""Commands of ours, run in this process."""

import pytest

from mjcartpole import cli

QUICK = ["--episodes", "3", "--no-video", "--no-curve"]
"""A training that takes no time."""


def call(arguments, capsys):
    """Run a command; return exit code, stdout and stderr, where caches make no difference."""
    with pytest.raises(SystemExit) as stop:
        cli.main([str(argument) for argument in arguments])
    captured = capsys.readouterr()
    told = captured.err.splitlines(keepends=True)
    err = "".join(line for line in told if "compiling the training loop" not in line)
    return stop.value.code, captured.out, err


def done(arguments):
    """Run a command that ends well; what it prints goes wherever prints go."""
    with pytest.raises(SystemExit) as stop:
        cli.main([str(argument) for argument in arguments])
    assert stop.value.code == 0
