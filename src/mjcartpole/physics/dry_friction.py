"""Dry friction as MuJoCo has it: the force that would stop a joint, softly, up to a limit.

MuJoCo asks of a joint with `frictionloss` the acceleration `-rate v`, which lets its velocity die
away, and finds the force f that gives it, as if through a spring: `f = -(rate v + a) / softness`,
where |f| is at most the loss. As `a` depends on all forces, each joint either grips or slides this
way or that, and the one combination that agrees with itself is the solution (MuJoCo's manual,
chapter "Computation", on its constraint model).
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from mjcartpole.errors import ConfigError

Number: TypeAlias = float | npt.NDArray[Any]
"""A float or an array; complex numbers pass too."""

Pair: TypeAlias = tuple[Number, Number]
"""One value for the slider, one for the hinge."""

Inertia: TypeAlias = tuple[Number, Number, Number]
"""Of the slider, shared by both, of the hinge: kg, kg m, kg m^2."""


@dataclass(frozen=True)
class DryFriction:
    """Dry friction of one joint.

    Attributes:
        loss: The most that it can be, N or N m.
        softness: Acceleration that is missing from a full grip, by force: 1/kg or 1/(kg m^2).
        rate: By which a gripped joint's velocity dies away, 1/s.
    """

    loss: float
    softness: float
    rate: float

    def __post_init__(self) -> None:
        """Refuse what is no friction.

        Raises:
            ConfigError: A number is not finite, loss or softness not more than 0, or the rate
                negative.
        """
        finite = all(math.isfinite(v) for v in (self.loss, self.softness, self.rate))
        if not (finite and self.loss > 0 and self.softness > 0 and self.rate >= 0):
            raise ConfigError(
                f"{self!r}: loss and softness must be finite and more than 0, the rate 0 or more"
            )


Frictions: TypeAlias = Sequence[DryFriction | None]

_MODES = (0, -1, 1)
"""Grip, and sliding under the full force to one side and the other."""


def friction_forces(frictions: Frictions, inertia: Inertia, velocities: Pair, smooth: Pair) -> Pair:
    """Return dry friction of slider and hinge, N and N m; None in `frictions` is none.

    Velocities are in m/s and rad/s, `smooth` are the accelerations without friction, m/s^2 and
    rad/s^2; all but the frictions broadcast with each other.
    """
    best: Pair = 0.0, 0.0
    least: Number = math.inf
    modes = [(1,) if friction is None else _MODES for friction in frictions]
    for combination in itertools.product(*modes):
        forces, excess = _try(frictions, combination, inertia, velocities, smooth)
        better = excess < least
        least = np.where(better, excess, least)
        best = np.where(better, forces[0], best[0]), np.where(better, forces[1], best[1])
    return best


def _try(
    frictions: Frictions, modes: tuple[int, ...], inertia: Inertia, velocities: Pair, smooth: Pair
) -> tuple[Pair, Number]:
    """Return the forces if each joint grips or slides as said, and how much that contradicts."""
    pairs = list(zip(frictions, modes, strict=True))
    grips = [1 / friction.softness if friction and not mode else 0.0 for friction, mode in pairs]
    slides = [mode * friction.loss if friction else 0.0 for friction, mode in pairs]
    rates = [friction.rate if friction else 0.0 for friction in frictions]
    pulls = [
        slide - grip * rate * velocity
        for slide, grip, rate, velocity in zip(slides, grips, rates, velocities, strict=True)
    ]
    moved = _accelerations(grips, pulls, inertia, smooth)
    forces: list[Number] = [0.0, 0.0]
    excess: Number = 0.0
    for joint, (friction, mode) in enumerate(pairs):
        if friction:
            grip = -(friction.rate * velocities[joint] + moved[joint]) / friction.softness
            forces[joint] = slides[joint] if mode else grip
            pull: Number = np.real(np.asarray(grip))
            over = friction.loss - mode * pull if mode else np.abs(pull) - friction.loss
            excess = excess + np.maximum(over, 0.0) / friction.loss
    return (forces[0], forces[1]), excess


def _accelerations(grips: list[float], pulls: list[Number], inertia: Inertia, smooth: Pair) -> Pair:
    """Return accelerations with some joints gripped, each as if heavier, and others sliding."""
    slider, shared, hinge = inertia
    push = slider * smooth[0] + shared * smooth[1] + pulls[0]
    turn = shared * smooth[0] + hinge * smooth[1] + pulls[1]
    a, b = slider + grips[0], hinge + grips[1]
    determinant = a * b - shared * shared
    return (b * push - shared * turn) / determinant, (a * turn - shared * push) / determinant
