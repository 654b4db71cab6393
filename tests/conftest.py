"""What all tests share."""

import pytest

from mjcartpole.physics.simulation import silence_mujoco


@pytest.fixture(autouse=True)
def _quiet_mujoco():
    """Some tests diverge on purpose: no words on stderr, no log file where pytest runs."""
    silence_mujoco()
