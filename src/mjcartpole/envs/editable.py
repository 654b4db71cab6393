"""The model of an environment, which may be edited from one episode to the next."""

import dataclasses
from collections.abc import Mapping
from typing import Final

from mjcartpole.disturbances.contexts import Context
from mjcartpole.errors import check_known
from mjcartpole.integrator import Integrator, check_integrator
from mjcartpole.physics.cartpole import INTEGRATORS, CartPole, own_copy
from mjcartpole.physics.edit.edits import edits_of
from mjcartpole.physics.load import Edits, load_shared
from mjcartpole.physics.simulation import Simulation
from mjcartpole.physics.variants import variant

KINEMATICS: Final = {"euler": "", "semi-implicit": "Euler"} | {
    name: name for name in INTEGRATORS.values() if name != "Euler"
}
"""CartPole-v1's words for an integrator, and the file's own beside them, to MJCF's."""


class Editable:
    """A model, what was changed of it since, and what of that the running episode has.

    Attributes:
        base: The model as the environment was made with.
        own: The model with all changes that last.
        shown: The one whose numbers are read: as it moves, or as it was changed last.
        is_stale: Whether the next episode needs another simulation than the one before.
    """

    def __init__(self, base: CartPole, integrator: Integrator) -> None:
        """Begin without changes; nothing is simulated yet, and `base` is only read.

        Raises:
            ConfigError: The integrator is unknown.
        """
        check_integrator(integrator)
        self.base = self.own = self.shown = base
        self.is_stale = True
        self._integrator: Integrator = integrator
        self._changes: dict[str, object] = {}

    def edit(self, edits: Mapping[str, object]) -> None:
        """Edit the document from the next episode on; later edits are added to earlier ones.

        Raises:
            ConfigError: An edit makes no sense.
            ModelError: It makes the model one that cannot be used.
        """
        changes = self._changes | edits_of(edits)
        self.own = self.shown = self._load(changes)
        self._changes, self.is_stale = changes, True

    def begin(self, edits: Edits = None, context: Context | None = None) -> Simulation:
        """A simulation of the model as it is now, with what lasts one episode: edits, a context."""
        changed = self._load(self._changes, edits) if edits else self.own
        changed = variant(changed, context) if context else changed
        simulation = Simulation(own_copy(changed), self._integrator)
        self.shown, self.is_stale = simulation.cartpole, bool(edits or context)
        return simulation

    def _load(self, changes: Mapping[str, object], edits: Edits = None) -> CartPole:
        own_timestep = self.base.has_own_timestep or "timestep" in changes
        both = {**changes, **edits_of(edits or {})}
        loaded = load_shared(self.base, both, own_timestep=own_timestep)
        # A control step that was set is made of as many physics steps as before.
        substeps = self.base.substeps if own_timestep else loaded.substeps
        return dataclasses.replace(loaded, substeps=substeps)

    @property
    def kinematics(self) -> str:
        """Who moves the state, in CartPole-v1's words."""
        if self._integrator == "gym":
            return "euler"
        name = self.shown.integrator
        return "semi-implicit" if name == "Euler" else name

    @kinematics.setter
    def kinematics(self, name: str) -> None:
        check_known("kinematics_integrator", name, KINEMATICS)
        if name != "euler" and self.own.integrator != KINEMATICS[name]:
            self.edit({"option.integrator": KINEMATICS[name]})
        self._integrator, self.is_stale = "gym" if name == "euler" else "mujoco", True
