"""Flags of `mjcartpole train` that decide nothing of what is learned."""

from dataclasses import dataclass
from pathlib import Path

from mjcartpole.commands.options import RUNS
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.engine import Engine
from mjcartpole.learning.naming import run_name


@dataclass(frozen=True)
class RunLocation:
    """What a run is called and where it goes."""

    preset: str = "tuned"
    """Where the defaults below come from: tuned, article, article-terminal, two-poles, wieland,
    damped, endless, quick, planned or swing-up."""
    run_dir: Path | None = None
    """Folder for the run; runs/<preset>-<backend>-<what was changed>-seed<seed> if left out."""
    overwrite: bool = False
    """Replace the run that is there; without --run-dir, instead of adding a number to its name."""

    def folder(self, config: TrainConfig, seeds: int = 1) -> Path:
        """Return the run's folder: with overwrite the very one, else one that is not there yet."""
        from mjcartpole.learning.folders import free_folder

        usual = self.usual_folder(config, seeds)
        free = self.run_dir is None and not self.overwrite
        return free_folder(usual.parent, usual.name) if free else usual

    def usual_folder(self, config: TrainConfig, seeds: int = 1) -> Path:
        """Return the folder that a run has where its name is not taken."""
        return self.run_dir or RUNS / run_name(self.preset, config, seeds)


@dataclass(frozen=True)
class TrainOptions:
    """How to train; nothing of this changes what is learned."""

    video: bool = True
    """Film the first evaluation episode into videos/<run's name>.mp4."""
    curve: bool = True
    """Draw the learning curve into the run's folder, last of all, where matplotlib is installed."""
    engine: Engine = "compiled"
    """Who runs the loop; both give the same bits."""
    workers: int | None = None
    """How many seeds at once; as many as there are cores if left out."""
    checkpoint_every: float = 30.0
    """Seconds between two checkpoints."""
    tensorboard: bool = False
    """Write the learning curve as TensorBoard events into the run folder."""
    allow_assets: tuple[Path, ...] = ()
    """With --resume: folders in which the meshes and textures of that run's model may lie."""
