"""What all tests share."""

import signal

import pytest

from mjcartpole.physics.simulation import silence_mujoco


@pytest.fixture(autouse=True)
def _quiet_mujoco():
    """Some tests diverge on purpose: no words on stderr, no log file where pytest runs."""
    silence_mujoco()


def pytest_configure():
    """Hear signals, also where the tests run in the background or under nohup: some ignored."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if hasattr(signal, "SIGHUP"):
        signal.signal(signal.SIGHUP, signal.SIG_DFL)
