"""A cart-pole: a compiled model, and where its parts are."""

import copy
import dataclasses
import functools
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import mujoco
import numpy as np
import numpy.typing as npt

from mjcartpole.physics.includes import portable
from mjcartpole.task import CONTROL_STEP, in_words

Vector: TypeAlias = npt.NDArray[np.float64]
"""Numbers, vectors and matrices in float64."""

INTEGRATORS = {
    int(value): {"EULER": "Euler", "RK4": "RK4"}.get(
        name := key.removeprefix("mjINT_"), name.lower()
    )
    for key, value in mujoco.mjtIntegrator.__members__.items()
}
"""MuJoCo's integrators by its own numbers, spelled as MJCF spells them."""


@dataclass(frozen=True, repr=False)
class CartPole:
    """A compiled cart-pole and where its parts are.

    Attributes:
        name: What a person calls it: a model's name, a file's path.
        xml: The whole document as text; it compiles to the same model anywhere.
        model: The compiled model.
        slider: Index of the cart's joint in qpos and qvel.
        hinges: Index of each pole's joint in qpos and qvel, in the document's order.
        controls: The actuator's control for action 0 and for action 1.
        substeps: Physics steps per control step.
        upright: Each hinge's angle as the document counts it at which the model's angle is 0, rad.
            It is 0 but where a document has the pole hang, or lie, at its own angle 0.
    """

    name: str
    xml: str
    model: mujoco.MjModel
    slider: int
    hinges: tuple[int, ...]
    controls: tuple[float, float]
    substeps: int
    upright: tuple[float, ...]

    def __repr__(self) -> str:
        name = self.name if len(self.name) <= 200 else f"{self.name[:200]}…"
        return f"CartPole({name!r}, {in_words(self.poles)}, timestep {self.timestep:g} s)"

    @functools.cached_property
    def stored(self) -> tuple[str, dict[str, Path | str]]:
        """The document as a run stores it, and the files that lie beside it (see `portable`)."""
        return portable(self.xml)

    @property
    def poles(self) -> int:
        """How many poles it has."""
        return len(self.hinges)

    @property
    def joints(self) -> tuple[int, ...]:
        """Indices in qpos and qvel in the order of a state: the slider, then each hinge."""
        return (self.slider, *self.hinges)

    @property
    def motor(self) -> int:
        """Index of the actuator that the actions control."""
        return motor_of(self.model)

    @property
    def timestep(self) -> float:
        """Seconds of one physics step."""
        return float(self.model.opt.timestep)

    @property
    def has_own_timestep(self) -> bool:
        """Whether a control step is one physics step of another length than 0.02 s."""
        return self.substeps == 1 and self.timestep != CONTROL_STEP

    @property
    def control_step(self) -> float:
        """Seconds between two actions."""
        return self.timestep * self.substeps

    @property
    def integrator(self) -> str:
        """The integrator that the file names, as MJCF spells it (see `INTEGRATORS`)."""
        return str(INTEGRATORS[int(self.model.opt.integrator)])


def motor_of(model: mujoco.MjModel) -> int:
    """Return the index of the actuator that takes a model's one control (others may take none)."""
    return int(np.flatnonzero(model.actuator_ctrlnum)[0])


def own_copy(cartpole: CartPole) -> CartPole:
    """Return the same cart-pole with a compiled model of its own, which may be changed."""
    return dataclasses.replace(cartpole, model=copy.copy(cartpole.model))


def with_options(
    cartpole: CartPole, *, timestep: float | None = None, integrator: str | None = None
) -> CartPole:
    """Return a cart-pole with another timestep (s) or integrator, one step per control step.

    For studies of integrators; the document stays as it was. Options are no geometry: changing
    them in a compiled model leaves no derived value stale. Integrators are spelled as in MJCF.
    """
    changed = dataclasses.replace(own_copy(cartpole), substeps=1)
    if timestep is not None:
        changed.model.opt.timestep = timestep
    if integrator is not None:
        numbers = {name: number for number, name in INTEGRATORS.items()}
        changed.model.opt.integrator = numbers[integrator]
    return changed
