"""Causes are found from the motion alone."""

import dataclasses

import numpy as np
import pytest

from mjcartpole.physics import equations
from mjcartpole.physics.equations import CARTPOLE_V1
from mjcartpole.physics.load import load_model
from mjcartpole.studies.parity import Subject
from mjcartpole.studies.parity.diagnosis import likely_cause


@pytest.mark.parametrize(
    ("changes", "likely"),
    [
        ({"pole_mass": 0.1001}, "pole mass 0.1001"),
        ({"gravity": 9.81}, "gravity 9.81"),
        ({"timestep": 0.02002}, "timestep 0.02002"),
        ({"com_distance": 0.5005}, "com distance 0.5005"),
    ],
)
def test_the_cause_is_found_from_the_motion_alone(changes, likely):
    """A right model whose steps are wrong: nothing in the document says why."""
    subject = Subject(load_model("cartpole"))
    batch = subject.random_batch(99, 500, (2.4, 3.0, 0.2, 3.0))
    wrong = dataclasses.replace(CARTPOLE_V1, **changes)
    found = equations.step(wrong, batch.states, subject.forces(batch), "gym")

    def predict(p):
        return equations.step(p, batch.states, np.array(p.forces)[batch.actions], "gym")

    assert likely in likely_cause(subject, predict, found)
