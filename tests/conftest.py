"""What all tests share."""

import os
import signal

import pytest
from hypothesis import HealthCheck, settings

from command_line import QUICK, call
from mjcartpole.physics.simulation import silence_mujoco
from nightly import FAST

# How long an example takes says how busy the machine is, and nothing of what is tested.
settings.register_profile("untimed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("untimed")


@pytest.fixture(autouse=True)
def _quiet_mujoco():
    """Some tests diverge on purpose: no words on stderr, no log file where pytest runs."""
    silence_mujoco()


@pytest.fixture
def here(tmp_path, monkeypatch):
    """Work in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def run(here, capsys):
    """Train quickly; return the folder, runs/mine."""
    code, *_ = call(["train", *QUICK, "--seed", "3", "--run-dir", "runs/mine"], capsys)
    assert code == 0
    return here / "runs" / "mine"


def pytest_configure(config):
    """Say which set this is, and hear signals, which are ignored in the background or by nohup."""
    if config.option.markexpr == "not slow":
        os.environ[FAST] = "1"
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if hasattr(signal, "SIGHUP"):
        signal.signal(signal.SIGHUP, signal.SIG_DFL)
