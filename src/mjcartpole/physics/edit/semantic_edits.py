"""Edits by meaning: what each name stands for, and that it is what the compiled model then has."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import mujoco
import numpy as np

from mjcartpole import task
from mjcartpole.errors import ConfigError
from mjcartpole.physics.bodies import cart_bodies, mass_of, pole_bodies
from mjcartpole.physics.build import build
from mjcartpole.physics.cartpole import CartPole, Vector
from mjcartpole.physics.edit.document import Document, Element
from mjcartpole.physics.edit.element_path import find_element
from mjcartpole.physics.edit.rescale import set_length, set_mass, set_pole_mass
from mjcartpole.physics.edit.xml_elements import Parts, number_text
from mjcartpole.physics.parameters import forces_of, pole_of


@dataclass(frozen=True)
class Meaning:
    """What a person can name.

    Attributes:
        unit: Of the value.
        text: What it is and what moves along.
        zero: Whether the value may be 0.
    """

    unit: str
    text: str
    zero: bool = True

    def check(self, key: str, value: object) -> float:
        """Return the value as a number.

        Raises:
            ConfigError: It is no number, not finite, or outside physics.
        """
        try:
            if isinstance(value, bool):
                raise TypeError
            number = float(value)  # type: ignore[arg-type]
        except (TypeError, ValueError):
            raise ConfigError(f"{key} must be a number ({self.unit}), not {value!r}") from None
        wanted = "0 or more" if self.zero else "more than 0"
        if not (math.isfinite(number) and (number > 0 or (self.zero and number == 0))):
            raise ConfigError(f"{key} must be finite and {wanted} ({self.unit}), not {value!r}")
        return number + 0.0  # -0.0 is 0


MEANINGS: Final = {
    "pole.length": Meaning(
        "m", "length of the pole, hinge to tip; centre of mass, inertia and drawing follow", False
    ),
    "pole.mass": Meaning("kg", "mass of all that turns on the hinge; inertia follows", False),
    "cart.mass": Meaning("kg", "mass of all that slides and does not turn", False),
    "gravity": Meaning("m/s^2", "gravity, downwards; a horizontal part stays as it is"),
    "force": Meaning("N", "push of an action, to either side", False),
    "timestep": Meaning("s", "one physics step; 0.02 must be a multiple of it", False),
    "hinge.damping": Meaning("N m s/rad", "torque against the pole's turning, per rad/s"),
    "hinge.friction": Meaning("N m", "dry friction of the hinge"),
    "hinge.armature": Meaning("kg m^2", "inertia of the hinge's own, without weight"),
    "rail.damping": Meaning("N s/m", "force against the cart's motion, per m/s"),
    "rail.friction": Meaning("N", "dry friction of the rail"),
    "rail.armature": Meaning("kg", "inertia of the rail's own drive, without weight"),
}
"""By name; of several poles, one has its number in it, as pole2.length."""

_OF_POLE: Final = ("pole.", "hinge.")
_NUMBERED: Final = re.compile(r"^(pole|hinge)([1-9]\d*)\.")
"""Of one of several poles."""

_USUAL: Final = (1e-4, 1e4)
"""Lengths and masses, SI units, of which no product is near what MuJoCo refuses (1e-15)."""

_JOINT_ATTRIBUTES: Final = {
    "damping": "damping",
    "friction": "frictionloss",
    "armature": "armature",
}


def meaning_of(key: str) -> Meaning | None:
    """Return what an edit by meaning stands for; None where a key is none.

    Where there are several poles, a number says which: pole2.length, hinge1.damping.
    """
    return MEANINGS.get(_NUMBERED.sub(r"\1.", key))


def names_like(key: str) -> list[str]:
    """Return what can be named, with the pole's number where a key has one."""
    numbered = _NUMBERED.match(key)
    return [_with_number(name, numbered[2]) if numbered else name for name in MEANINGS]


def _with_number(name: str, number: object) -> str:
    return name.replace(".", f"{number}.", 1) if name.startswith(_OF_POLE) else name


def apply_meanings(
    document: Document, values: Mapping[str, float], name: str, in_one: bool
) -> None:
    """Make edits by meaning, checked values by name, in the document of a cart-pole.

    `in_one` step where that is the same, for all but the words of an error, as if each was tried.

    Raises:
        ConfigError: The document leaves no room for an edit; the reason is said.
        ModelError: The document is no cart-pole, or is none afterwards.
    """
    cartpole = build(document.text, name)
    whole, by_pole = _sort_by_pole(values, cartpole.poles)
    _edit_options(document, cartpole.model, whole)
    parts = Parts(document, cartpole, in_one and max(values.values()) < _USUAL[1])
    _edit_joint(parts, cartpole.slider, "rail", whole)
    if "force" in whole:
        _edit_force(parts, whole["force"])
    if "cart.mass" in whole:
        set_mass(parts, cart_bodies(cartpole), "cart", whole["cart.mass"])
    centres = [_edit_pole(parts, pole, wanted) for pole, wanted in enumerate(by_pole)]
    name += f" with {', '.join(f'{key}={value:g}' for key, value in values.items())}"
    after = build(document, name)
    _check_outcome(_found(after), whole)
    for pole, wanted in enumerate(by_pole):
        found, rigid = _found_of_joint(after, after.hinges[pole], "hinge"), pole_of(after, pole)
        _check_outcome({"pole.mass": rigid.mass, **found}, wanted)
        _check_centre(rigid.com, centres[pole])


def _sort_by_pole(
    values: Mapping[str, float], poles: int
) -> tuple[dict[str, float], list[dict[str, float]]]:
    """Return edits of the whole, and those of each pole without its number.

    Raises:
        ConfigError: It is not clear which pole, or there is no such pole.
    """
    whole: dict[str, float] = {}
    by_pole: list[dict[str, float]] = [{} for _ in range(poles)]
    for key, value in values.items():
        plain = _NUMBERED.sub(r"\1.", key)
        if not plain.startswith(_OF_POLE):
            whole[key] = value
            continue
        names = [plain]
        if poles > 1:
            names = [_with_number(plain, pole + 1) for pole in range(poles)]
        if key not in names:
            raise ConfigError(
                f"{key!r} names no pole of the model, it has {task.in_words(poles)}; "
                f"use {' or '.join(names)}"
            )
        by_pole[names.index(key)][plain] = value
    return whole, by_pole


def _edit_pole(parts: Parts, pole: int, values: Mapping[str, float]) -> Vector:
    """Make the edits of one pole; returns where its centre of mass must then be, from the hinge."""
    before, longer = parts.cartpole, 1.0
    wanted = pole_of(before, pole)
    _edit_joint(parts, before.hinges[pole], "hinge", values)
    if "pole.length" in values:
        longer = set_length(parts, values["pole.length"], pole)
    if "pole.length" in values or "pole.mass" in values:
        mass = values.get("pole.mass", wanted.mass)
        sizes = wanted.mass, mass, values.get("pole.length", 1.0)
        usual = all(_USUAL[0] < size < _USUAL[1] for size in sizes)
        if not (parts.in_one and usual and parts.weigh_as_written(pole_bodies(before, pole))):
            parts = Parts(parts.document, build(parts.document, before.name))
        set_pole_mass(parts, mass, pole)
    return longer * wanted.com


def _edit_options(document: Document, model: mujoco.MjModel, values: Mapping[str, float]) -> None:
    if "gravity" in values:
        option, name = find_element(document, "option.gravity")
        tokens = option.attributes.get(name, "").split()
        if len(tokens) != 3:
            tokens = [number_text(float(value)) for value in model.opt.gravity]
        tokens[2] = number_text(0.0 - values["gravity"], tokens[2])
        document.set(option, name, " ".join(tokens))
    if "timestep" in values:
        _set_first(document, *find_element(document, "option.timestep"), values["timestep"])


def _set_first(document: Document, element: Element, name: str, value: float) -> None:
    """Write the first number of an attribute; what else it has stays."""
    tokens = element.attributes.get(name, "").split() or [""]
    tokens[0] = number_text(value, tokens[0])
    document.set(element, name, " ".join(tokens))


def _edit_joint(parts: Parts, joint: int, part: str, values: Mapping[str, float]) -> None:
    for word, name in _JOINT_ATTRIBUTES.items():
        value = values.get(f"{part}.{word}")
        if value is None:
            continue
        element = parts.joint(joint)
        if name in element.attributes or value != _joint_value(parts.cartpole, joint, name):
            _set_first(parts.document, element, name, value)


def _joint_value(cartpole: CartPole, joint: int, name: str) -> float:
    return float(getattr(cartpole.model, f"dof_{name}")[joint])


def _edit_force(parts: Parts, force: float) -> None:
    """Set the force through the gear, which is what force there is per unit of control."""
    model, motor = parts.cartpole.model, parts.cartpole.motor
    left, right = forces_of(parts.cartpole)
    fixed = model.actuator_gaintype[motor] == mujoco.mjtGain.mjGAIN_FIXED
    if not fixed or model.actuator_biastype[motor] != mujoco.mjtBias.mjBIAS_NONE:
        raise ConfigError("force cannot be set: the actuator is no plain motor; edit it by name")
    if left != -right or right == 0:
        raise ConfigError(
            f"force cannot be set: the actions push with {left:g} N and {right:g} N, not equally "
            "to both sides; set the actuator's gear and ctrlrange"
        )
    before = float(model.actuator_gear[motor, 0])
    gear = math.copysign(force / abs(right / before), before)
    element = parts.motor()
    if "gear" in element.attributes or gear != before:
        _set_first(parts.document, element, "gear", gear)


def _check_centre(found: Vector, wanted: Vector) -> None:
    """Refuse a pole of which not all has become longer in the same proportion."""
    if np.abs(found - wanted).max() > 1e-9 * np.abs(wanted).max():
        raise ConfigError(
            f"pole.length cannot be set: the centre of mass would be {np.linalg.norm(found):g} m "
            f"from the hinge instead of {np.linalg.norm(wanted):g} m, since not all of the pole's "
            "mass lies along it; edit it by element"
        )


def _found(cartpole: CartPole) -> dict[str, float]:
    """Return what a model has, by the names of the edits of the whole."""
    model = cartpole.model
    return {
        "cart.mass": mass_of(model, cart_bodies(cartpole)),
        "gravity": -float(model.opt.gravity[2]),
        "force": abs(forces_of(cartpole)[1]),
        "timestep": float(model.opt.timestep),
        **_found_of_joint(cartpole, cartpole.slider, "rail"),
    }


def _found_of_joint(cartpole: CartPole, joint: int, part: str) -> dict[str, float]:
    values = {word: _joint_value(cartpole, joint, name) for word, name in _JOINT_ATTRIBUTES.items()}
    return {f"{part}.{word}": value for word, value in values.items()}


def _check_outcome(found: Mapping[str, float], values: Mapping[str, float]) -> None:
    """Refuse a model that has not what was asked, whatever else the document says."""
    for key, value in values.items():
        if key in found and not math.isclose(found[key], value, rel_tol=1e-9):
            raise ConfigError(
                f"{key}={value:g} cannot be reached, the model has {found[key]:g}: something else "
                "in the document decides it (settotalmass, inertiafromgeom, springdamper …)"
            )
