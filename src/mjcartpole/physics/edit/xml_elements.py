"""XML elements of a document that stand for parts of its compiled model, and numbers in them."""

import math
from collections.abc import Sequence
from functools import lru_cache

import mujoco

from mjcartpole.errors import ConfigError
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.edit.document import Document, Element
from mjcartpole.physics.edit.element_path import label_of
from mjcartpole.physics.library import invalid


def number_text(value: float, written: str = "") -> str:
    """Return a number as MJCF writes it, 17 digits where needed; as written, if it is that."""
    try:
        if written and float(written) == value:
            return written
    except ValueError:
        pass
    whole = value == int(value) and abs(value) < 1e15 if math.isfinite(value) else False
    return str(int(value)) if whole else repr(float(value))


_read = lru_cache(maxsize=4)(mujoco.MjSpec.from_string)


class Parts:
    """The elements of a document that stand for parts of its compiled model.

    Attributes:
        document: The document; nothing may be put into it while this is in use.
        cartpole: What it compiles to, but for numbers that were edited since.
        in_one: Whether what was edited so far is taken for valid until all edits are made.
    """

    def __init__(self, document: Document, cartpole: CartPole, in_one: bool = False) -> None:
        self.document, self.cartpole, self._model = document, cartpole, cartpole.model
        self.in_one = in_one
        self._bodies = [each for each in document.elements if each.tag == "body"]

    def body(self, index: int) -> Element:
        """Return the element of a body.

        Raises:
            ConfigError: The document does not write its bodies one by one.
        """
        names = [self._model.body(i).name for i in range(1, self._model.nbody)]
        if [body.name for body in self._bodies] != names:
            raise ConfigError(
                "this cannot be edited by meaning: the document does not write every body itself "
                "(replicate, attach, composite, include, fusestatic); edit by element"
            )
        return self._bodies[index - 1]

    def joint(self, index: int) -> Element:
        """Return the element of a joint.

        Raises:
            ConfigError: Not all joints of its body are in the document.
        """
        model = self._model
        body = int(model.jnt_bodyid[index])
        found = self._all_in(body, "joint", int(model.body_jntnum[body]))
        return found[index - int(model.body_jntadr[body])]

    def geoms(self, body: int) -> list[tuple[int, Element, mujoco.MjsGeom]]:
        """Return index, element, and what it says with its defaults, of each geom of a body.

        Raises:
            ConfigError: Some are not written in the body.
            ModelSyntaxError: An edit has left a number that MuJoCo does not read.
        """
        elements = self._all_in(body, "geom", int(self._model.body_geomnum[body]))
        first = int(self._model.body_geomadr[body])
        try:
            # No geom that is asked for was edited before.
            spec = _read(self.cartpole.xml if self.in_one else self.document.text)
        except ValueError as error:
            raise invalid("the edited document", error) from error
        whole = [geom for each in spec.bodies for geom in each.geoms]
        return [(first + i, element, whole[first + i]) for i, element in enumerate(elements)]

    def _all_in(self, body: int, tag: str, count: int) -> list[Element]:
        """Return as many elements of a tag as a body has in the model; refuse fewer or more."""
        found = self.body(body).find(tag)
        if len(found) != count:
            raise ConfigError(
                f"the {tag}s of body '{self._model.body(body).name}' cannot be edited by meaning: "
                "not all of them are in the document; edit by element"
            )
        return found

    def motor(self) -> Element:
        """Return the element of the motor that the actions control."""
        sections = self.document.root.find("actuator")
        return [child for section in sections for child in section.children][self.cartpole.motor]

    def inertial(self, body: int) -> Element | None:
        """Return the <inertial> that decides a body's mass; None where geoms do."""
        found = self.body(body).find("inertial")
        # An attribute of <compiler> alone.
        said = [each.attributes.get("inertiafromgeom") for each in self.document.root.children]
        from_geoms = [each for each in said if each][-1:] == ["true"]
        return found[0] if found and not from_geoms else None

    def weigh_as_written(self, bodies: Sequence[int]) -> bool:
        """Return whether each of some bodies has the mass that its own <inertial> says."""
        whole = any("settotalmass" in each.attributes for each in self.document.root.children)
        return not whole and all(self.inertial(body) is not None for body in bodies)

    def put(self, element: Element, name: str, values: Sequence[float]) -> None:
        """Write numbers into an attribute; those that do not change keep their spelling.

        Raises:
            ConfigError: A number is too large for a computer.
        """
        if not all(math.isfinite(value) for value in values):
            raise ConfigError(f"{name} of {label_of(element)} would not be finite; edit less")
        written = element.attributes.get(name, "").split()
        spelled = written if len(written) == len(values) else [""] * len(values)
        tokens = [number_text(value, old) for value, old in zip(values, spelled, strict=True)]
        if tokens != written:
            self.document.set(element, name, " ".join(tokens))


def numbers_of(element: Element, name: str) -> list[float]:
    """Return the numbers of an attribute; three zeros where it is missing."""
    return [float(token) for token in element.attributes.get(name, "0 0 0").split()]
