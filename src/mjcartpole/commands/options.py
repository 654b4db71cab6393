"""What commands have in common: their base, and small groups of flags that they include.

Nothing here, or at the top of a command's file, imports MuJoCo or a video library: every `--help`
reads all of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Self, TypeVar

import tyro

from mjcartpole.envs.backend import Backend
from mjcartpole.errors import MjCartPoleError
from mjcartpole.integrator import Integrator

FAILED = 2
RUNS = Path("runs")
VIDEOS = Path("videos")

T = TypeVar("T")
Included = Annotated[T, tyro.conf.arg(name=""), tyro.conf.OmitArgPrefixes]
"""A group of flags that become the command's own."""
OutputPath = Annotated[Path | None, tyro.conf.arg(aliases=["-o"])]
Policies = Annotated[
    tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="RUN-OR-POLICY …")
]


class UsageError(MjCartPoleError):
    """The command line cannot be understood."""


@dataclass(frozen=True)
class Command:
    """A command: each field is a flag, each docstring its help.

    It is no `abc.ABC`: of those tyro asks a type checker, whose import costs a tenth of a `--help`.
    """

    @classmethod
    def default(cls, words: Sequence[str]) -> Self | None:
        """Return what is meant by flags that are left out; None: each has its own default.

        Args:
            words: The command line: one flag may decide the defaults of others.

        Raises:
            ConfigError: A word makes no sense.
        """
        return None

    @classmethod
    def explain(cls, words: Sequence[str]) -> str | None:
        """Return what is wrong with a command line that was not understood; None: tyro says it."""
        return None

    def run(self) -> int:
        """Do it, and return the exit code.

        Raises:
            MjCartPoleError: Something cannot be used; its message is all that is said of it.
            Interrupted: After Ctrl-C, SIGTERM or SIGHUP.
        """
        raise NotImplementedError


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
