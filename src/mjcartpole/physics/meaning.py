"""Edits by meaning: what each name stands for, and that it is what the compiled model then has."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import mujoco
import numpy as np
import numpy.typing as npt

from mjcartpole.errors import ConfigError
from mjcartpole.physics.addresses import find_element
from mjcartpole.physics.document import Document
from mjcartpole.physics.model import CartPole, load_model
from mjcartpole.physics.parameters import forces_of, pole_of
from mjcartpole.physics.parts import Parts, number_text
from mjcartpole.physics.rescale import (
    cart_mass,
    set_cart_mass,
    set_length,
    set_pole_mass,
)


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
        """The value as a number.

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
"""In the order in which they are made."""

_JOINT_ATTRIBUTES: Final = {
    "damping": "damping",
    "friction": "frictionloss",
    "armature": "armature",
}


def apply_meanings(document: Document, values: Mapping[str, float]) -> None:
    """Make edits by meaning in a document.

    Args:
        document: A cart-pole; it is changed.
        values: Checked values by name.

    Raises:
        ConfigError: The document leaves no room for an edit; the reason is said.
        ModelError: The document is no cart-pole, or is none afterwards.
    """
    before, centre = _load(document), None
    _edit_options(document, before.model, values)
    parts = Parts(document)
    _edit_joints(parts, before, values)
    if "force" in values:
        _edit_force(parts, before, values["force"])
    if "cart.mass" in values:
        set_cart_mass(parts, before, values["cart.mass"])
    if "pole.length" in values or "pole.mass" in values:
        pole, longer = pole_of(before.model, before.hinge), 1.0
        if "pole.length" in values:
            longer = set_length(parts, before, values["pole.length"])
            before = _load(document)
        set_pole_mass(parts, before, values.get("pole.mass", pole.mass))
        centre = longer * pole.com
    after = _load(document)
    _check_outcome(after, values)
    if centre is not None:
        _check_centre(after, centre)


def _load(document: Document) -> CartPole:
    return load_model(document.text, own_timestep=True)


def _edit_options(document: Document, model: mujoco.MjModel, values: Mapping[str, float]) -> None:
    if "gravity" in values:
        option, name = find_element(document, "option.gravity")
        tokens = option.attributes.get(name, "").split()
        if len(tokens) != 3:
            tokens = [number_text(float(value)) for value in model.opt.gravity]
        tokens[2] = number_text(0.0 - values["gravity"], tokens[2])
        document.set(option, name, " ".join(tokens))
    if "timestep" in values:
        option, name = find_element(document, "option.timestep")
        written = option.attributes.get(name, "")
        document.set(option, name, number_text(values["timestep"], written))


def _edit_joints(parts: Parts, cartpole: CartPole, values: Mapping[str, float]) -> None:
    for part, joint in (("hinge", cartpole.hinge), ("rail", cartpole.slider)):
        for word, name in _JOINT_ATTRIBUTES.items():
            value = values.get(f"{part}.{word}")
            if value is None:
                continue
            element = parts.joint(cartpole.model, joint)
            tokens = element.attributes.get(name, "").split() or [""]
            tokens[0] = number_text(value, tokens[0])
            if name in element.attributes or value != _joint_value(cartpole, joint, name):
                parts.document.set(element, name, " ".join(tokens))


def _joint_value(cartpole: CartPole, joint: int, name: str) -> float:
    return float(getattr(cartpole.model, f"dof_{name}")[joint])


def _edit_force(parts: Parts, cartpole: CartPole, force: float) -> None:
    """Through the gear, which is what force there is per unit of control."""
    model = cartpole.model
    left, right = forces_of(cartpole)
    fixed = model.actuator_gaintype[0] == mujoco.mjtGain.mjGAIN_FIXED
    if not fixed or model.actuator_biastype[0] != mujoco.mjtBias.mjBIAS_NONE:
        raise ConfigError("force cannot be set: the actuator is no plain motor; edit it by name")
    if left != -right or right == 0:
        raise ConfigError(
            f"force cannot be set: the actions push with {left:g} N and {right:g} N, not equally "
            "to both sides; set the actuator's gear and ctrlrange"
        )
    gear = math.copysign(
        force / abs(right / float(model.actuator_gear[0, 0])), float(model.actuator_gear[0, 0])
    )
    element = parts.actuator()
    tokens = element.attributes.get("gear", "").split() or [""]
    tokens[0] = number_text(gear, tokens[0])
    if "gear" in element.attributes or gear != float(model.actuator_gear[0, 0]):
        parts.document.set(element, "gear", " ".join(tokens))


def _check_centre(cartpole: CartPole, wanted: npt.NDArray[np.float64]) -> None:
    """All that turns on the hinge must have become longer in the same proportion."""
    found = pole_of(cartpole.model, cartpole.hinge).com
    if np.abs(found - wanted).max() > 1e-9 * np.abs(wanted).max():
        raise ConfigError(
            f"pole.length cannot be set: the centre of mass would be {np.linalg.norm(found):g} m "
            f"from the hinge instead of {np.linalg.norm(wanted):g} m, since not all of the pole's "
            "mass lies along it; edit it by element"
        )


def _check_outcome(cartpole: CartPole, values: Mapping[str, float]) -> None:
    """What was asked must be what the model has, whatever else the document says."""
    model = cartpole.model
    found = {
        "pole.mass": pole_of(model, cartpole.hinge).mass,
        "cart.mass": cart_mass(cartpole),
        "gravity": -float(model.opt.gravity[2]),
        "force": abs(forces_of(cartpole)[1]),
        "timestep": float(model.opt.timestep),
    }
    for part, joint in (("hinge", cartpole.hinge), ("rail", cartpole.slider)):
        for word, name in _JOINT_ATTRIBUTES.items():
            found[f"{part}.{word}"] = _joint_value(cartpole, joint, name)
    for key, value in values.items():
        if key in found and not math.isclose(found[key], value, rel_tol=1e-9):
            raise ConfigError(
                f"{key}={value:g} cannot be reached, the model has {found[key]:g}: something else "
                "in the document decides it (settotalmass, inertiafromgeom, springdamper …)"
            )
