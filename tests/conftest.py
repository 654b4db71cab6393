"""What all tests share."""

import signal

import pytest
from hypothesis import HealthCheck, settings

from mjcartpole.physics.simulation import silence_mujoco

# How long an example takes says how busy the machine is, and nothing of what is tested.
settings.register_profile("untimed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("untimed")


@pytest.fixture(autouse=True)
def _quiet_mujoco():
    """Some tests diverge on purpose: no words on stderr, no log file where pytest runs."""
    silence_mujoco()


def pytest_configure():
    """Hear signals, also where the tests run in the background or under nohup: some ignored."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if hasattr(signal, "SIGHUP"):
        signal.signal(signal.SIGHUP, signal.SIG_DFL)
