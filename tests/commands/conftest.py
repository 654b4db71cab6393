"""Trainings that were killed, and what they would have come to."""

import time

import pytest

from command_line import done
from mjcartpole.learning.checkpoints import LATEST
from trainings import SLOW, Forked, wait_until


@pytest.fixture
def fork():
    """Starts forked commands, and ends those that are left."""
    children = []

    def start(*arguments, **options):
        children.append(Forked(*arguments, **options))
        return children[-1]

    yield start
    for child in children:
        if child.lives():
            child.kill()
            child.wait()


@pytest.fixture(scope="session")
def slow_reference(tmp_path_factory):
    """What `SLOW` comes to."""
    folder = tmp_path_factory.mktemp("reference") / "run"
    done([*SLOW, "--engine", "compiled", "--run-dir", folder])
    return folder


@pytest.fixture
def killed(here, fork):
    """The folder of a run that was killed and has a checkpoint."""
    child = fork([*SLOW, "--run-dir", "run", "--checkpoint-every", "0"])
    wait_until((here / "run" / LATEST).exists, child)
    time.sleep(0.1)
    child.kill()
    child.wait()
    return here / "run"
