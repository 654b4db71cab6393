"""What all tests share."""

import os
import shutil
import signal

import pytest
from hypothesis import HealthCheck, settings

from command_line import QUICK, done
from mjcartpole.physics.simulation import silence_mujoco
from nightly import FAST, examples


@pytest.fixture(autouse=True)
def _quiet_mujoco():
    """Some tests diverge on purpose: no words on stderr, no log file where pytest runs."""
    silence_mujoco()


@pytest.fixture
def here(tmp_path, monkeypatch):
    """Work in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="session")
def trained(tmp_path_factory):
    """A quick training's folder, for whoever only reads it; its pole falls after 26 steps."""
    folder = tmp_path_factory.mktemp("trained") / "mine"
    done(["train", *QUICK, "--seed", "8", "--run-dir", folder])
    return folder


@pytest.fixture
def run(here, trained):
    """A quick training's folder, runs/mine, for whoever changes it."""
    return shutil.copytree(trained, here / "runs" / "mine")


def pytest_collection_modifyitems(items):
    """Begin with what takes longest, so that no worker is left alone with it at the end."""
    items.sort(key=lambda item: item.path.name != "test_docs.py")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Give each file to one worker, in this order: what a file's tests share is made once."""
    from xdist.scheduler import LoadFileScheduling

    config.option.loadscopereorder = False
    return LoadFileScheduling(config, log)


def pytest_configure(config):
    """Say which set this is, and hear signals, which are ignored in the background or by nohup."""
    if "not slow" in config.option.markexpr:
        os.environ[FAST] = "1"
    # How long an example takes says how busy the machine is, and nothing of what is tested.
    options = {"deadline": None, "suppress_health_check": [HealthCheck.too_slow]}
    settings.register_profile("untimed", examples(100), **options)
    settings.load_profile("untimed")
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if hasattr(signal, "SIGHUP"):
        signal.signal(signal.SIGHUP, signal.SIG_DFL)
