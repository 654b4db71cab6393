"""Rounding: what a step or an acceleration may be off by, where two worlds agree."""

import math

import numpy as np

from mjcartpole.physics.dry_friction import DryFriction
from mjcartpole.physics.equations import Parameters, coefficients
from mjcartpole.studies.parity.case import Against, Batch, Subject, Vector

LEAST_ARM = 1e-9
"""Metres."""

EPS = float(np.finfo(np.float64).eps)

STEP_BOUNDS: dict[Against, float] = {"cartpole-v1": 4.0, "itself": 16.0}
"""In ulp. CartPole-v1's own numbers leave little to cancel; any other pole may leave more."""


def acceleration_scale(
    p: Parameters, states: Vector, forces: Vector, offset: float = 0.0
) -> Vector:
    """Return how large the terms of both accelerations are before they cancel, shape (n, 2).

    MuJoCo works with points in the world: a lever arm is the difference of two positions and
    rounds with the cart's distance from the origin, even where its sine is small. So does what it
    makes of it, the hinge's inertia included. And it adds up what the velocities do to the angular
    momentum, of which the rotation's own part and the cart's cancel.

    States have the shape (n, 4), forces, N, the shape (n,); the offset is that of the cart at x = 0
    from the world's origin, m.
    """
    k = coefficients(p)
    x, x_dot, _, theta_dot = np.abs(states).T
    # Where the centre of mass is on the hinge, the mass still has an arm.
    arm = max(abs(p.com_distance), math.sqrt(p.inertia / p.pole_mass), LEAST_ARM)
    arms = 1 + (x + offset) / arm
    shared = p.pole_mass * arm
    push = np.abs(forces) + abs(k.pull) + k.slider_damping * x_dot + arms * shared * theta_dot**2
    swing = k.hinge_inertia * theta_dot**2 + shared * x_dot * theta_dot
    weight = np.hypot(k.weight, k.leaning)
    torque = weight + k.hinge_damping * theta_dot + swing
    # A grip is the difference of two accelerations, over its softness.
    push = push + _grip(p.slider_friction, x_dot)
    torque = arms * (torque + _grip(p.hinge_friction, theta_dot))
    product = k.slider_inertia * k.hinge_inertia
    turned = k.coupling * np.cos(states[:, 2]) - k.crossing * np.sin(states[:, 2])
    determinant = product - turned**2
    coupling, condition = arms * shared, product / determinant
    return np.column_stack(
        [
            condition * (k.hinge_inertia * push + coupling * torque) / determinant,
            condition * (k.slider_inertia * torque + coupling * push) / determinant,
        ]
    )


def _grip(friction: DryFriction | None, speed: Vector) -> Vector | float:
    return friction.loss + friction.rate * speed / friction.softness if friction else 0.0


def step_unit(subject: Subject, batch: Batch, expected: Vector) -> Vector:
    """Return what one ulp of a step stands for, (n, 4): of 1, or of the value if it is larger.

    A model that is asked about itself may be anything, such as a heavy pole on a light cart. There
    the terms that the step adds up count as well; of CartPole-v1 those that grow with the distance
    from the world's origin.
    """
    unit = np.maximum(1.0, np.abs(expected))
    p, forces = subject.reference, subject.forces(batch)
    terms = acceleration_scale(p, batch.states, forces, subject.offset)
    if subject.against == "cartpole-v1":
        terms = terms - acceleration_scale(p, batch.states, forces)
    return EPS * np.maximum(unit, p.timestep * terms[:, [0, 0, 1, 1]])
