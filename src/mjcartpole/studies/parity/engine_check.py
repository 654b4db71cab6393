"""Rung 10: dm_control steps the same document to the same bits."""

from typing import Any

import numpy as np

from mjcartpole.physics.simulation import Simulation
from mjcartpole.studies.parity.case import Subject
from mjcartpole.studies.parity.result import Figure, Question, Result

QUESTION = Question(
    10,
    "third witness: dm_control steps the same document",
    "the same engine on the same document: not one bit may differ",
)
EPISODES, STEPS, FAR = 40, 50, 1e3


def dm_control(subject: Subject) -> Result:
    """Rung 10: `dm_control.mujoco.Physics` against our simulation with the file's integrator."""
    try:
        # Slow to import, and may not load.
        from mjcartpole.physics.dm_control import control, mujoco  # noqa: PLC0415
    except ImportError as error:
        return QUESTION.skip(str(error))
    if any(subject.cartpole.upright):
        why = "the document counts the pole's angle from elsewhere, so that bits cannot be equal"
        return QUESTION.skip(why)
    try:
        physics = mujoco.Physics.from_xml_string(subject.cartpole.xml)
    except Exception as error:
        return QUESTION.skip(f"dm_control does not load this document: {error}")
    try:
        different, compared = _count_differences(subject, physics)
    except (ValueError, control.PhysicsError) as error:
        return QUESTION.skip(f"dm_control does not step this document: {error}")
    figures = (Figure(f"steps that differ ({compared:,})", float(different), 0.0),)
    return QUESTION.answer(figures)


def _count_differences(subject: Subject, physics: Any) -> tuple[int, int]:  # noqa: ANN401
    """Return how many steps end at other bits, and of how many."""
    physics.legacy_step = False
    simulation = Simulation(subject.cartpole, "mujoco")
    order = list(subject.cartpole.joints)
    rng = subject.rng(10)
    compared = different = 0
    for _ in range(EPISODES):
        simulation.state = state = rng.uniform(-0.2, 0.2, size=4)
        physics.reset()
        physics.data.qpos[order], physics.data.qvel[order] = state[[0, 2]], state[[1, 3]]
        for action in rng.integers(2, size=STEPS):
            control = subject.cartpole.controls[action]
            physics.set_control([control])
            physics.step(subject.cartpole.substeps)
            simulation.step(control)
            theirs = np.concatenate([physics.data.qpos[order], physics.data.qvel[order]])
            compared += 1
            different += simulation.state[[0, 2, 1, 3]].tobytes() != theirs.tobytes()
            if np.abs(theirs).max() > FAR:
                break  # dm_control refuses to go on where MuJoCo gives up
    return different, compared
