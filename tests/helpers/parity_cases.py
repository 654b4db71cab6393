"""The reference with changes, and the ladder climbed with it."""

import re

from mjcartpole.physics.load import load_model
from mjcartpole.studies.parity import Subject, run_ladder

REFERENCE = load_model("cartpole").xml


PHYSICS = (2, 3, 4, 6, 7, 9)
"""Rungs that look at the motion."""


def changed(*changes):
    """The reference with changes, each a pattern and its replacement."""
    text = REFERENCE
    for pattern, replacement in changes:
        text, count = re.subn(pattern, replacement, text, count=1, flags=re.DOTALL)
        assert count == 1, pattern
    return text


def climb(text, against="cartpole-v1", rungs=PHYSICS):
    """The subject and its quick results, by rung."""
    subject = Subject(load_model(text, own_timestep=True), against, quick=True)
    return subject, {result.rung: result for result in run_ladder(subject, rungs)}


def failures(results):
    return {rung for rung, result in results.items() if result.verdict in {"fails", "beyond"}}


POLE = '<inertial pos="0 0 0.5" mass="0.1"'


INERTIA = 'diaginertia="0.008333333333333333 0.008333333333333333'


WRONG = {
    "pole mass": ([(POLE, POLE.replace("0.1", "0.1001"))], 2, "pole mass 0.1001 instead of 0.1"),
    "cart mass": ([('mass="1.0"', 'mass="1.001"')], 2, "cart mass 1.001 instead of 1"),
    "inertia": (
        [(INERTIA, INERTIA.replace("0.008333333333333333", "0.008341666666666666"))],
        2,
        "inertia 0.00834167 instead of 0.00833333",
    ),
    "centre": ([(POLE, POLE.replace("0.5", "0.5005"))], 2, "com distance 0.5005 instead of 0.5"),
    "gravity": ([("-9.8", "-9.81")], 2, "gravity 9.81 instead of 9.8"),
    "gear": ([('gear="10"', 'gear="10.01"')], 2, "force of action 1 10.01 instead of 10"),
    "timestep": ([('timestep="0.02"', 'timestep="0.02002"')], 3, "timestep 0.02002 instead of"),
    "half the timestep": ([('timestep="0.02"', 'timestep="0.01"')], 3, "timestep 0.01 instead of"),
    "damping": ([('name="hinge"', 'name="hinge" damping="1e-4"')], 2, "hinge damping 0.0001"),
    "armature": ([('name="slider"', 'name="slider" armature="1e-3"')], 2, "slider armature 0.001"),
    "hinge axis": (
        [('axis="0 1 0"', 'axis="0 -1 0"')],
        2,
        "turned round: a positive angle",
    ),
    "slider axis": (
        [('axis="1 0 0"', 'axis="-1 0 0"')],
        2,
        "turned round: a positive angle",
    ),
    "limit": ([('name="slider"', 'name="slider" range="-2 2"')], 2, "limit of joint 'slider'"),
    "friction": ([('name="hinge"', 'name="hinge" frictionloss="1e-5"')], 2, "friction loss"),
    "tilted rail": ([('axis="1 0 0"', 'axis="1 0 0.001"')], 2, "slide axis of joint 'slider' tilt"),
    "tilted hinge": ([('axis="0 1 0"', 'axis="0 1 0.001"')], 2, "hinge axis of joint 'hinge' tilt"),
    "out of square": ([('axis="0 1 0"', 'axis="0.001 1 0"')], 2, "out of square by 0.0573 degrees"),
    "tilted pole": ([('name="pole">', 'name="pole" euler="0 0.001 0">')], 2, "leans by 0.0573"),
    "rolled cart": ([('name="cart">', 'name="cart" euler="0.01 0 0">')], 2, "hinge axis of joint"),
    "ref": ([('name="hinge"', 'name="hinge" ref="0.01"')], 2, "its ref is 0.01 rad"),
    "gravity aside": ([("0 0 -9.8", "0.01 0 -9.8")], 2, "gravity 0.01 0 -9.8 instead of"),
    "brake": (
        [
            (
                "</actuator>",
                '<dcmotor name="brake" joint="hinge" input="none" motorconst="0.05" '
                'resistance="1"/></actuator>',
            )
        ],
        2,
        "actuator force by actuator 'brake' on joint 'hinge'",
    ),
    "spring": ([('name="hinge"', 'name="hinge" stiffness="1e-4"')], 2, "spring"),
    "contact": (
        [
            ('<geom name="cart"', '<geom name="cart" contype="1" conaffinity="1"'),
            (
                "<worldbody>",
                '<worldbody><geom name="ground" type="plane" size="9 9 1" contype="1" '
                'conaffinity="1" pos="0 0 -0.099"/>',
            ),
        ],
        2,
        "contact between geoms 'ground' and 'cart'",
    ),
    "geom mass": (
        [
            ('angle="radian"', 'angle="radian" inertiafromgeom="true"'),
            ('<geom name="cart"', '<geom name="cart" mass="1"'),
            ('<geom name="pole"', '<geom name="pole" mass="0.1"'),
        ],
        2,
        "inertia",
    ),
    "integrator": ([('integrator="Euler"', 'integrator="RK4"')], 4, "integrator RK4 instead of"),
}
