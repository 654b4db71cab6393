"""Other masses and another length of the pole, written into the elements that decide them.

What an <inertial> says is written there; where MuJoCo computes masses from geoms, the geoms change
and MuJoCo computes again.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Final

import mujoco
import numpy as np

from mjcartpole.errors import ConfigError
from mjcartpole.physics.bodies import mass_of, pole_bodies
from mjcartpole.physics.cartpole import CartPole, Vector
from mjcartpole.physics.edit.document import Document, Element
from mjcartpole.physics.edit.xml_elements import Parts, numbers_of
from mjcartpole.physics.parameters import pole_of, rotation

_AS_WRITTEN: Final = 1e-5
"""An inertia this close, relative, to a uniform rod's is one, written with fewer digits."""

_TURNED: Final = {"quat", "euler", "axisangle", "xyaxes", "zaxis", "fullinertia"}
_LONG: Final = (mujoco.mjtGeom.mjGEOM_CAPSULE, mujoco.mjtGeom.mjGEOM_CYLINDER)


# --- mass ---------------------------------------------------------------------------------------


def set_pole_mass(parts: Parts, mass: float, pole: int = 0) -> None:
    """Give a pole another mass, with the inertia that follows.

    Raises:
        ConfigError: There is nothing to scale.
    """
    model, bodies = parts.cartpole.model, pole_bodies(parts.cartpole, pole)
    rod, ratio = _RodInertial.of(parts, pole), _ratio(mass, mass_of(model, bodies))
    alone = len([body for body in bodies if model.body_mass[body] > 0]) == 1
    for body in bodies:
        inertial = parts.inertial(body)
        if inertial is None or (rod is not None and body == bodies[0]):
            continue
        for name in ("diaginertia", "fullinertia"):
            if name in inertial.attributes:
                parts.put(inertial, name, [ratio * value for value in numbers_of(inertial, name)])
    if rod is not None:
        rod.write(mass if alone else ratio * rod.mass, rod.length)
    set_mass(parts, bodies, "pole", mass)


def _ratio(new: float, old: float) -> float:
    """Return new by old; 1 where only rounding is between them: an edit made twice is one."""
    return 1.0 if math.isclose(new, old, rel_tol=1e-14) else new / max(old, mujoco.mjMINVAL)


def set_mass(parts: Parts, bodies: list[int], what: str, mass: float) -> None:
    """Scale the masses of bodies to a sum.

    Raises:
        ConfigError: There is nothing to scale; `what` is the part of the cart-pole that has none.
    """
    model = parts.cartpole.model
    heavy = [body for body in bodies if model.body_mass[body] > 0]
    if not heavy:
        raise ConfigError(f"{what}.mass cannot be set: no body of the {what} has a mass to scale")
    ratio = _ratio(mass, mass_of(model, heavy))
    for body in heavy:
        inertial = parts.inertial(body)
        if inertial is None:
            _scale_geoms(parts, body, ratio)
        else:
            alone = len(heavy) == 1
            parts.put(inertial, "mass", [mass if alone else ratio * float(model.body_mass[body])])


def _scale_geoms(parts: Parts, body: int, ratio: float) -> None:
    if ratio == 1:
        return
    for _, element, geom in parts.geoms(body):
        if math.isnan(geom.mass):
            parts.put(element, "density", [ratio * float(geom.density)])
        elif geom.mass > 0:
            parts.put(element, "mass", [ratio * float(geom.mass)])


# --- length -------------------------------------------------------------------------------------


@dataclass
class _RodInertial:
    """An <inertial> that is a uniform thin rod from the hinge, along an axis of its body.

    Attributes:
        foot: Of the hinge, m, shape (3,).
        com: From there to the centre of mass, m, shape (3,).
        mass: kg.
        axis: Along which of the body's it lies.
    """

    parts: Parts
    element: Element
    foot: Vector
    com: Vector
    mass: float
    axis: int

    @property
    def length(self) -> float:
        """From the hinge to the tip, m."""
        return 2 * abs(float(self.com[self.axis]))

    @classmethod
    def of(cls, parts: Parts, pole: int) -> "_RodInertial | None":
        """Return a pole's own; None if it has none, or is no such rod."""
        model, hinge = parts.cartpole.model, parts.cartpole.hinges[pole]
        root = int(model.jnt_bodyid[hinge])
        element = parts.inertial(root)
        if element is None or _TURNED & set(element.attributes):
            return None
        foot = np.array(model.jnt_pos[hinge])
        com, mass = np.array(numbers_of(element, "pos")) - foot, float(model.body_mass[root])
        axis = int(np.abs(com).argmax())
        if com[axis] == 0:
            return None
        inertia = np.delete(numbers_of(element, "diaginertia"), axis)
        straight = np.abs(np.delete(com, axis)).max() <= 1e-12 * abs(com[axis])
        rods = mass * com[axis] ** 2 / 3
        uniform = rods > 0 and np.abs(inertia - rods).max() < _AS_WRITTEN * rods
        return cls(parts, element, foot, com, mass, axis) if straight and uniform else None

    def write(self, mass: float, length: float) -> None:
        """Give the rod another mass and length; its thickness stays."""
        pos, inertia = numbers_of(self.element, "pos"), numbers_of(self.element, "diaginertia")
        across, axis = uniform_rod_inertia(mass, length), self.axis
        along = inertia[axis]
        if mass != self.mass:
            along = float(f"{along * (mass / self.mass):.12g}")  # nothing turns it: no noise
        inertia = [across] * 3
        inertia[axis] = min(along, across)  # for a pole thicker than long
        pos[axis] = float(self.foot[axis]) + math.copysign(1.0, self.com[axis]) * length / 2
        for name, values in (("pos", pos), ("mass", [mass]), ("diaginertia", inertia)):
            self.parts.put(self.element, name, values)


def uniform_rod_inertia(mass: float, length: float) -> float:
    """Return M L^2 / 12, kg m^2, of the numbers as they are written.

    Plain floats would leave noise in the last digits, in a file that people read.
    """
    try:
        return float(Fraction(repr(mass)) * Fraction(repr(length)) ** 2 / 12)
    except OverflowError:
        return math.inf


def set_length(parts: Parts, length: float, pole: int = 0) -> float:
    """Give a pole another length, hinge to tip, and return how many times longer it is than it was.

    Everything on it moves along. Bodies that are fixed to the pole, and poles that stand on it,
    keep their shape and move.

    Raises:
        ConfigError: The pole cannot be stretched; the reason is said.
    """
    rod, stretch = _measured(parts, pole)
    stretch.new = length
    inertial = parts.inertial(stretch.root)
    if rod is not None:
        rod.write(rod.mass, length)
    elif inertial is not None:
        stretch.inertial(inertial)
    stretch.geoms()
    for tag in ("site", "body", "camera", "light"):
        for element in parts.body(stretch.root).find(tag):
            if element.parent is not None and element.parent.tag == "frame":
                raise ConfigError("pole.length cannot be set: the pole has a <frame>")
            if "pos" in element.attributes:
                parts.put(element, "pos", stretch.point(numbers_of(element, "pos")))
    return stretch.new / stretch.old


def length_of(cartpole: CartPole, pole: int = 0) -> float:
    """Return a pole's length, hinge to tip, m, as `set_length` has it.

    Raises:
        ConfigError: The document does not show it; the reason is said.
    """
    return _measured(Parts(Document(cartpole.xml), cartpole), pole)[1].old


def _measured(parts: Parts, pole: int) -> "tuple[_RodInertial | None, _Stretch]":
    """Return a pole's rod, if it is one, and a stretch that knows how long the pole is."""
    rod, stretch = _RodInertial.of(parts, pole), _Stretch(parts, pole)
    stretch.old = rod.length if rod else stretch.reach()
    return rod, stretch


class _Stretch:
    """From one length to another, along the pole and from the hinge."""

    def __init__(self, parts: Parts, pole: int) -> None:
        self.parts, self.model = parts, parts.cartpole.model
        com, hinge = pole_of(parts.cartpole, pole).com, parts.cartpole.hinges[pole]
        distance = float(np.linalg.norm(com))
        if distance < 1e-9:
            raise ConfigError(
                "pole.length cannot be set: the pole's centre of mass is at the hinge, so it has "
                "no direction"
            )
        self.root, self.foot = int(self.model.jnt_bodyid[hinge]), self.model.jnt_pos[hinge].copy()
        along = com / distance
        axis = int(np.abs(along).argmax())
        self.axis = axis if abs(along[axis]) > 1 - 1e-15 else None
        self.along = np.eye(3)[axis] * np.sign(along[axis]) if self.axis is not None else along
        self.old = self.new = 1.0

    def value(self, old: float) -> float:
        """Return a distance along the pole; its tip and its middle come out without rounding."""
        for share in (1.0, 0.5):
            if math.isclose(abs(old), share * self.old, rel_tol=1e-12):
                return math.copysign(share * self.new, old)
        return old * _ratio(self.new, self.old)

    def point(self, point: Sequence[float]) -> list[float]:
        """Return a point in the frame of the pole's body."""
        arm = np.array(point) - self.foot
        if self.axis is not None:
            along = float(self.foot[self.axis]) + self.value(float(arm[self.axis]))
            return [along if axis == self.axis else old for axis, old in enumerate(point)]
        if np.linalg.norm(np.cross(arm, self.along)) <= 1e-12 * np.linalg.norm(arm):
            return [float(a) + self.value(float(b)) for a, b in zip(self.foot, arm, strict=True)]
        moved = point + (_ratio(self.new, self.old) - 1) * (arm @ self.along) * self.along
        return [float(value) for value in moved]

    def reach(self) -> float:
        """Return how far the pole reaches from the hinge: its geoms' axes, without round ends."""
        reached = [0.0]
        for index, _, geom in self._geoms:
            reached += [float((end - self.foot) @ self.along) for end in self._ends(index, geom)]
        if max(reached) <= 0:
            raise ConfigError("pole.length cannot be set: no geom of the pole shows its length")
        return max(reached)

    def inertial(self, element: Element) -> None:
        """Return any mass distribution along the pole: inertia goes with the length squared."""
        if self.axis is None or _TURNED & set(element.attributes):
            raise ConfigError(
                "pole.length cannot be set: the pole's <inertial> is turned or beside its axis; "
                "edit it by element"
            )
        ratio = _ratio(self.new, self.old) * _ratio(self.new, self.old)
        inertia = [value * ratio for value in numbers_of(element, "diaginertia")]
        inertia[self.axis] /= ratio
        self.parts.put(element, "pos", self.point(numbers_of(element, "pos")))
        self.parts.put(element, "diaginertia", inertia)

    def geoms(self) -> None:
        """Stretch what lies along the pole, move the rest."""
        for index, element, geom in self._geoms:
            fromto = _fromto(geom)
            if fromto is not None:
                ends = [*self.point(fromto[:3]), *self.point(fromto[3:])]
                if ends != fromto:
                    self.parts.put(element, "fromto", ends)
                continue
            self._resize(index, element, geom)
            pos = [float(value) for value in geom.pos]
            moved = self.point(pos)
            if moved != pos:
                self.parts.put(element, "pos", moved)

    @cached_property
    def _geoms(self) -> list[tuple[int, Element, mujoco.MjsGeom]]:
        return self.parts.geoms(self.root)

    def _resize(self, index: int, element: Element, geom: mujoco.MjsGeom) -> None:
        kind, size = int(self.model.geom_type[index]), [float(value) for value in geom.size]
        parallel = self._shares(index)
        side = int(parallel.argmax())
        if kind == mujoco.mjtGeom.mjGEOM_SPHERE:
            return
        if kind in _LONG:
            if side == 2 and parallel[2] > 1 - 1e-9:
                self.parts.put(element, "size", [size[0], self.value(size[1])])
        elif kind in {mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_ELLIPSOID}:
            if parallel[side] > 1 - 1e-9:
                size[side] = self.value(size[side])
                self.parts.put(element, "size", size)
        else:
            raise ConfigError("pole.length cannot be set: a mesh of the pole cannot be stretched")

    def _ends(self, index: int, geom: mujoco.MjsGeom) -> tuple[Vector, Vector]:
        fromto = _fromto(geom)
        if fromto is not None:
            return np.array(fromto[:3]), np.array(fromto[3:])
        model = self.model
        half = model.geom_size[index]
        if int(model.geom_type[index]) in _LONG:
            half = np.array([0.0, 0.0, half[1]])
        arm = self._shares(index) @ half * self.along
        return model.geom_pos[index] - arm, model.geom_pos[index] + arm

    def _shares(self, index: int) -> Vector:
        """Return how much each axis of a geom goes along the pole, shape (3,)."""
        shares: Vector = np.abs(rotation(self.model.geom_quat[index]).T @ self.along)
        return shares


def _fromto(geom: mujoco.MjsGeom) -> list[float] | None:
    values = [float(value) for value in geom.fromto]
    return None if math.isnan(values[0]) else values
