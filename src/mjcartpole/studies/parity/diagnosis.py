"""Which parameter would explain what was measured?"""

import dataclasses
from collections.abc import Callable, Iterator

import numpy as np

from mjcartpole.integrator import Integrator
from mjcartpole.physics import equations
from mjcartpole.physics.equations import Parameters
from mjcartpole.physics.parameters import differences
from mjcartpole.studies.parity.subject import Batch, Subject, Vector

_NUDGE = 1e-6
"""Relative change by which a parameter's effect is measured."""

_ENOUGH = 0.9
"""A share of the squared error that one parameter must explain to be blamed alone."""


_NOTHING = 0.01
"""A share that says nothing."""


def likely_cause(
    subject: Subject,
    integrator: Integrator,
    batch: Batch,
    found: Vector,
) -> str:
    """The one parameter that best explains wrong steps, in words.

    Where the model's own parameters differ from the reference, each difference is tried alone.
    Where they do not (the model is right and the steps are wrong all the same), the parameter
    is fitted whose change would come closest.

    Args:
        subject: What is examined.
        integrator: Which integrator made the steps.
        batch: Before the steps.
        found: After the steps, shape (n, 4).
    """

    def steps(p: Parameters) -> Vector:
        return equations.step(p, batch.states, np.array(p.forces)[batch.actions], integrator)

    reference = subject.reference
    base = steps(reference)
    error = found - base
    if not np.isfinite(error).all():
        return "likely cause: none can be named, since the steps are not finite"
    own = differences(subject.own, reference)
    if not own and subject.causes:
        return f"likely cause: {'; '.join(subject.causes)}"
    candidates = list(_own_differences(subject.own, reference)) or list(
        _fitted(reference, steps, base, error)
    )
    total = float(np.sum(error**2))
    shares = [1 - float(np.sum((found - steps(p)) ** 2)) / total for _, p in candidates]
    best = int(np.argmax(shares))
    name, share = candidates[best][0], max(shares[best], 0.0)
    if share < _NOTHING and not own:
        return "likely cause: none of the parameters explains it"
    if share < _ENOUGH and len(own) > 1:
        return f"likely cause: more than one parameter: {'; '.join(own)}"
    return f"likely cause: {name} (alone it explains {share:.1%} of the error)"


def _own_differences(own: Parameters, reference: Parameters) -> Iterator[tuple[str, Parameters]]:
    """The reference with one of the model's own parameters at a time."""
    for field in dataclasses.fields(Parameters):
        changed = dataclasses.replace(reference, **{field.name: getattr(own, field.name)})
        if phrases := differences(changed, reference):
            yield "; ".join(phrases), changed


def _fitted(
    reference: Parameters, steps: Callable[[Parameters], Vector], base: Vector, error: Vector
) -> Iterator[tuple[str, Parameters]]:
    """The reference with one parameter at a time moved by least squares."""
    for name in ("cart_mass", "pole_mass", "com_distance", "inertia", "gravity", "timestep"):
        value = getattr(reference, name)
        nudged = dataclasses.replace(reference, **{name: value * (1 + _NUDGE)})
        effect = (steps(nudged) - base) / (value * _NUDGE)
        change = float(np.sum(effect * error) / np.sum(effect**2))
        if value + change > 0:
            moved = dataclasses.replace(reference, **{name: value + change})
            yield "; ".join(differences(moved, reference)) or f"{name} as it is", moved
