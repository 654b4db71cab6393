"""Where a policy is played, if not where it was trained; also the flags of commands that play."""

from dataclasses import dataclass
from pathlib import Path

from mjcartpole.disturbances.changes import DisturbanceChanges
from mjcartpole.envs.backend import Backend
from mjcartpole.integrator import Integrator
from mjcartpole.rule_changes import RuleChanges


@dataclass(frozen=True)
class EvalTarget(RuleChanges, DisturbanceChanges):
    """Where a policy is played; None means: where it was trained."""

    backend: Backend | None = None
    """Who does the physics; the run's own if left out."""
    model: str | None = None
    """Model to play on; the run's own if left out."""
    set: tuple[str, ...] = ()
    """Edits of that model, such as pole.length=1.5 or joint:hinge.damping=0.1."""
    own_timestep: bool = False
    """Let a control step be one physics step of that model's file; as a run that was trained so."""
    integrator: Integrator | None = None
    """The run's own if left out."""
    undisturbed: bool = False
    """Leave out all disturbances that the run was trained with; those given here are added."""
    seed: int | None = None
    """Seeds the starting states; the same as after training if left out."""
    allow_assets: tuple[Path, ...] = ()
    """Folders in which the meshes and textures of a run's model may lie, besides the run's own."""
