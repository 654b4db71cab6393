"""What one training and one of many seeds share: checks before it begins, and words for it."""

import shlex
import sys
from pathlib import Path

from mjcartpole.commands.train_options import RunLocation, TrainOptions
from mjcartpole.files import is_file
from mjcartpole.learning import runs
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.documents import CONFIG
from mjcartpole.learning.naming import in_flags, namesakes
from mjcartpole.learning.run_model import check_storable
from mjcartpole.learning.session import check_interval
from mjcartpole.learning.training_grid import training_grid
from mjcartpole.media import plots
from mjcartpole.packages import check_installed
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.playable import why_unplayable
from mjcartpole.physics.simulation import silence_mujoco


def prepare(config: TrainConfig, how: TrainOptions) -> CartPole:
    """Check all that can be checked before a folder is touched, and return the model.

    Raises:
        MjCartPoleError: Something makes no sense or cannot be used.
    """
    check(how)
    cartpole = config.load_model()
    training_grid(config, cartpole)
    check_storable(cartpole)
    if config.backend == "mujoco":
        why = why_unplayable(cartpole, config.integrator, task=config.rules)
        if why:
            print(f"mjcartpole: {why}", file=sys.stderr)
    return cartpole


def check(how: TrainOptions) -> None:
    """Refuse options that make no sense (ConfigError)."""
    silence_mujoco()
    check_interval(how.checkpoint_every)
    if how.tensorboard:
        check_installed("--tensorboard", "tensorboardX")


def draw_curve(folder: Path, how: TrainOptions) -> None:
    """Draw the learning curve beside a run, or beside many seeds; nothing without matplotlib.

    It comes last, when all else is written and said: to import matplotlib takes a while.

    Raises:
        FileError: It cannot be written.
    """
    if not (how.curve and plots.is_installed()):
        return
    from mjcartpole.studies.run_curves import curves_of, read_groups

    plots.write_plot(curves_of(read_groups([folder])).figure(), folder / runs.CURVE)


def changes(preset: str, config: TrainConfig) -> str:
    """Return what a headline says of a config: by what it differs from its preset."""
    flags = in_flags(preset, config)
    return f", with {flags}" if flags else ""


def about(where: RunLocation, folder: Path, config: TrainConfig, seeds: int = 1) -> str:
    """Return what a headline says of a new run: its changes, and where it goes if not as usual."""
    usual, changed = where.usual_folder(config, seeds), changes(where.preset, config)
    if folder == usual:
        return changed
    return f"{changed}\n{usual} is there already: this goes to {folder}{unfinished(folder)}"


def unfinished(folder: Path) -> str:
    """Return how to go on with runs of the same name, but for its number, that are incomplete."""
    begun = [path for path in namesakes(folder) if is_file(path / CONFIG)]
    hints = [go_on(path) for path in begun if path != folder and not runs.is_complete(path)]
    return f"; unfinished beside it: {', '.join(hints)}" if hints else ""


def go_on(folder: Path) -> str:
    """Return the command that goes on with a run."""
    return f"mjcartpole train --resume {shlex.quote(str(folder))}"
