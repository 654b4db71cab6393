"""Diagnosis: what would explain an error that was measured.

Each thing by which the model differs from the reference is tried alone: the equations with that one
change predict an error, and the share of the measured error that it explains is compared. What lies
beyond the equations predicts what they leave over with all of the model's own parameters.
"""

import dataclasses
from collections.abc import Callable, Iterable, Iterator
from typing import Final, NamedTuple, TypeAlias

import numpy as np

from mjcartpole.physics.equations import Parameters
from mjcartpole.physics.parameters import differences, take
from mjcartpole.studies.parity.case import Subject, Vector

Predict: TypeAlias = Callable[[Parameters], Vector]
"""What a cart-pole with such parameters would give, of the shape of what was measured."""

_NUDGE: Final = 1e-6
"""Relative change by which a parameter's effect is measured."""

_ENOUGH: Final = 0.9
"""A share of the squared error that a cause must explain to be named."""


class _Candidate(NamedTuple):
    phrase: str
    fields: frozenset[str]
    predicted: Vector


def likely_cause(
    subject: Subject, predict: Predict, found: Vector, beyond: Iterable[str] | None = None
) -> str:
    """Return what best explains a wrong answer, in words: the fewest changes that do.

    What was found is held against what `predict` says of parameters; what acts `beyond` the
    equations is the subject's own list if None.
    """
    base = predict(subject.reference)
    total = float(np.sum((found - base) ** 2))
    if not np.isfinite(total):
        return "likely cause: none can be named, since the answers are not finite"
    left_out = "; ".join(subject.beyond if beyond is None else beyond)

    def share(predicted: Vector) -> float:
        return 1 - float(np.sum((found - predicted) ** 2)) / total

    candidates = list(_candidates(subject, predict, base, found, left_out))
    if not candidates:
        candidates = list(_fitted(subject.reference, predict, base, found - base))
    enough = [each for each in candidates if share(each.predicted) >= _ENOUGH]
    if enough:
        best = min(enough, key=lambda each: (len(each.fields), -share(each.predicted)))
        return (
            f"likely cause: {best.phrase} (alone it explains {share(best.predicted):.1%} of the "
            "error)"
        )
    together = _fewest(subject, predict, share)
    phrases = [*together, *([left_out] if left_out and subject.deviations else [])]
    if together or len(phrases) > 1:
        return f"likely cause: more than one: {'; '.join(phrases)}"
    return "likely cause: nothing that was looked for explains it"


def _candidates(
    subject: Subject, predict: Predict, base: Vector, found: Vector, left_out: str
) -> Iterator[_Candidate]:
    """Yield each deviation alone, each parameter alone, and what the equations leave out."""
    own, reference = subject.own, subject.reference
    for deviation in subject.deviations:
        changed = take(reference, own, deviation.fields)
        yield _Candidate(deviation.phrase, deviation.fields, predict(changed))
    if left_out:
        yield _Candidate(left_out, frozenset({left_out}), base + found - predict(own))


def _fewest(subject: Subject, predict: Predict, share: Callable[[Vector], float]) -> list[str]:
    """Return the deviations that explain enough together, the one that adds most first."""
    own, reference = subject.own, subject.reference
    left, chosen, fields = list(subject.deviations), [], frozenset[str]()
    while left:
        shares = [share(predict(take(reference, own, fields | each.fields))) for each in left]
        best = left.pop(int(np.argmax(shares)))
        chosen.append(best.phrase)
        fields |= best.fields
        if max(shares) >= _ENOUGH:
            return chosen
    return []


def _fitted(
    reference: Parameters, predict: Predict, base: Vector, error: Vector
) -> Iterator[_Candidate]:
    """Yield the reference with one parameter at a time moved by least squares."""
    for name in ("cart_mass", "pole_mass", "com_distance", "inertia", "gravity", "timestep"):
        value = getattr(reference, name)
        nudged = dataclasses.replace(reference, **{name: value * (1 + _NUDGE)})
        effect = (predict(nudged) - base) / (value * _NUDGE)
        squares = float(np.sum(effect**2))
        change = float(np.sum(effect * error)) / squares if squares else 0.0
        if value + change > 0 and change:
            moved = dataclasses.replace(reference, **{name: value + change})
            phrase = "; ".join(differences(moved, reference)) or f"{name} as it is"
            yield _Candidate(phrase, frozenset({name}), predict(moved))
