"""Where a policy is played, if not where it was trained; also the flags of commands that play."""

from dataclasses import dataclass
from pathlib import Path

from mjcartpole.envs.backend import Backend
from mjcartpole.integrator import Integrator
from mjcartpole.task import Task, resolve


@dataclass(frozen=True)
class EvalTarget:
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
    seed: int | None = None
    """Seeds the starting states; the same as after training if left out."""
    allow_assets: tuple[Path, ...] = ()
    """Folders in which the meshes and textures of a run's model may lie, besides the run's own."""
    task: str | None = None
    """The rules: limits, starting states, reward, time limit; the run's own if left out."""
    max_episode_steps: int | None = None
    """Control steps until an episode is truncated; the rules' own if left out."""

    def rules(self, otherwise: Task) -> Task:
        """Return the rules that are played by.

        Args:
            otherwise: Where no task is named.

        Raises:
            ConfigError: There is no such task, or there are no such episodes.
        """
        return resolve(self.task or otherwise, max_episode_steps=self.max_episode_steps)
