"""By what a model differs from a reference: phrases, and the parameters behind each.

One thing in a document may change several parameters: an axis that is tilted, a gravity that is not
straight down. It is named as what it is.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.equations import Parameters
from mjcartpole.physics.parameters import (
    differences,
    geometry_of,
    joint_label,
    read_parameters,
    take,
)
from mjcartpole.physics.structure import directions

_SEEN_ALONG_AN_AXIS: Final = frozenset({"com_distance", "inertia"})
"""What is seen along the hinge's axis changes, to second order, with its direction."""


@dataclass(frozen=True)
class Deviation:
    """One thing by which a model differs from a reference.

    Attributes:
        phrase: What is instead of what.
        fields: The parameters that it changes.
    """

    phrase: str
    fields: frozenset[str]


def deviations(cartpole: CartPole, reference: Parameters) -> list[Deviation]:
    """Return everything by which a model's parameters differ from a reference's.

    Raises:
        ModelError: The model's parameters cannot be read.
    """
    own = read_parameters(cartpole)
    found = list(_gravitys_direction(cartpole, own, reference))
    named = {name for deviation in found for name in deviation.fields}
    for name, phrase in _axes(cartpole, own, reference):
        if name not in named:
            turns = name in {"hinge_tilt", "skew"}
            fields = {name} | (_SEEN_ALONG_AN_AXIS if turns else frozenset())
            found.append(Deviation(phrase, frozenset(fields)))
            named.add(name)
    for name in Parameters.__dataclass_fields__:
        phrases = differences(take(reference, own, {name}), reference)
        if phrases and name not in named:
            if name.endswith("friction"):
                phrases = [_friction(cartpole, own, reference, name)]
            found.append(Deviation("; ".join(phrases), frozenset({name})))
    return found


def _friction(cartpole: CartPole, own: Parameters, reference: Parameters, name: str) -> str:
    joint = cartpole.slider if name == "slider_friction" else cartpole.hinges[0]
    before, after = (getattr(p, name).loss if getattr(p, name) else 0.0 for p in (reference, own))
    where = joint_label(cartpole.model, joint)
    if before == after:
        return f"softness of the friction loss in {where}"
    return f"friction loss {after:g} instead of {before:g} in {where}"


def _gravitys_direction(
    cartpole: CartPole, own: Parameters, reference: Parameters
) -> Iterator[Deviation]:
    """Yield gravity that is not straight down, where all else stands square to the world."""
    square = geometry_of(cartpole, directions(cartpole).up)
    angles = {"rail_tilt", "hinge_tilt", "lean"}
    turned = {name for name in angles if getattr(own, name) != getattr(reference, name)}
    if turned and not any(square[name] for name in angles):
        phrase = f"gravity {_gravity(cartpole)} instead of {reference.gravity:g} straight down"
        yield Deviation(phrase, frozenset({"gravity", *turned}))


def _axes(cartpole: CartPole, own: Parameters, reference: Parameters) -> Iterator[tuple[str, str]]:
    slider, hinge = (joint_label(cartpole.model, joint) for joint in cartpole.joints[:2])
    ref = float(cartpole.model.qpos0[cartpole.hinges[0]])
    phrases = {
        "hinge_sign": f"hinge axis of {hinge} turned round: a positive angle leans to "
        f"{'+' if own.hinge_sign > 0 else '-'}x{_upside_down(cartpole)}",
        "rail_tilt": f"slide axis of {slider} tilted by {_degrees(own.rail_tilt)}",
        "hinge_tilt": f"hinge axis of {hinge} tilted by {_degrees(own.hinge_tilt)}",
        "skew": f"slide axis of {slider} and hinge axis of {hinge} out of square by "
        f"{_degrees(own.skew)}",
        "lean": f"the pole leans by {_degrees(own.lean)} at angle 0 of {hinge}"
        + (f" (its ref is {ref:g} rad)" if ref else ""),
    }
    for name, phrase in phrases.items():
        if differences(take(reference, own, {name}), reference):
            yield name, phrase


def _upside_down(cartpole: CartPole) -> str:
    return "" if directions(cartpole).up[2] > 0 else f" (gravity is {_gravity(cartpole)})"


def _gravity(cartpole: CartPole) -> str:
    return " ".join(f"{part:g}" for part in cartpole.model.opt.gravity)


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle):.3g} degrees ({angle:.6g} rad)"
