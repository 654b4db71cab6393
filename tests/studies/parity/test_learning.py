"""Rung 8: what the learner of either backend is given."""

import pytest

from mjcartpole.physics.load import load_model
from mjcartpole.studies.parity.case import Subject
from mjcartpole.studies.parity.learning import BLOCKS, _is_symmetric, _Job, _run_one


@pytest.mark.parametrize(("model", "alike"), [("cartpole", True), ("heavy", True), ("wind", False)])
def test_a_learner_is_mirrored_where_left_and_right_are_alike(model: str, alike: bool) -> None:
    assert _is_symmetric(Subject(load_model(model), "itself")) is alike


def test_a_mirrored_learner_learns_otherwise_and_alike_on_both() -> None:
    subject = Subject(load_model("cartpole"))
    rows = {mirror: _run_one(_Job(subject, 3, 30, 2, mirror)) for mirror in (True, False)}
    for ours, gyms in rows.values():
        assert len(ours) == len(gyms) == BLOCKS + 1
        assert ours[0] == gyms[0]
    assert rows[True] != rows[False]
