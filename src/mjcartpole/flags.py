"""The commands and their flags, as dataclasses: tyro derives grammar and help from them.

What decides a training stands in `TrainConfig`, and its flags with it.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from mjcartpole.envs.backend import Backend
from mjcartpole.integrator import Integrator
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.engine import Engine
from mjcartpole.studies.evaluation import EPISODES, SEED

Against = Literal["cartpole-v1", "itself"]
Quality = Literal["draft", "normal", "high"]


@dataclass(frozen=True)
class Train:
    """Train a Q-table, evaluate it, and film it."""

    config: Annotated[TrainConfig, tyro.conf.arg(name=""), tyro.conf.OmitArgPrefixes]
    preset: str = "tuned"
    """Where the defaults below come from: tuned, article, article-terminal or two-poles."""
    run_dir: Path | None = None
    """Folder for the run; runs/<preset>-<backend>-<what was changed>-seed<seed> if left out."""
    video: bool = True
    """Film the first evaluation episode into videos/<run's name>.mp4."""
    overwrite: bool = False
    """Replace the run that is there; without --run-dir, instead of adding a number to its name."""
    resume: Path | None = None
    """Continue the training of this run folder, or from a checkpoint in it, as it began."""
    engine: Engine = "compiled"
    """Who runs the loop; both give the same bits."""
    seeds: int = 1
    """Train this many seeds from --seed on, side by side, for statistics; nothing is filmed."""
    workers: int | None = None
    """How many seeds at once; as many as there are cores if left out."""
    checkpoint_every: float = 30.0
    """Seconds between two checkpoints."""
    tensorboard: bool = False
    """Write the learning curve as TensorBoard events into the run folder."""
    allow_assets: tuple[Path, ...] = ()
    """With --resume: folders in which the meshes and textures of that run's model may lie."""


@dataclass(frozen=True)
class Played:
    """What evaluating and filming have in common: where a policy is played."""

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


@dataclass(frozen=True)
class Evaluate(Played):
    """Play greedy episodes from fresh starting states, and count."""

    source: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN-OR-POLICY")] = (
        tyro.MISSING
    )
    """A run folder, one of many --seeds, or a policy file."""
    episodes: int = EPISODES
    """How many."""
    json: bool = False
    """Print JSON."""


@dataclass(frozen=True)
class Render(Played):
    """Film greedy episodes, the first that an evaluation with the same seed plays."""

    sources: Annotated[
        tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="RUN-OR-POLICY …")
    ] = tyro.MISSING
    """Run folders or policy files; several are shown side by side, from the same start. Of many
    --seeds in one folder, the median seed is shown."""
    output: Annotated[Path | None, tyro.conf.arg(aliases=["-o"])] = None
    """An .mp4, .gif or .webp, or a folder for pictures; videos/<name>.mp4 if left out, with a
    number where that is there already."""
    overwrite: bool = False
    """Replace what is there."""
    episodes: int = 1
    """How many, one after the other."""
    camera: str = "side"
    """A camera of the model."""
    size: str = "640x480"
    """Pixels, width x height, of each run's picture."""
    quality: Quality = "normal"
    """draft is quick, high is fine, normal is what the model's file says."""
    overlay: bool = False
    """Write step, return, state, action and action values into the picture."""
    speed: float = 1.0
    """0.25 is four times slower than the motion."""
    fps: float = 50.0
    """Frames per second."""
    fall: bool = False
    """Show the last second of each episode alone, four times slower."""
    sheet: bool = False
    """Write equally spaced frames as one .png instead of a video."""


@dataclass(frozen=True)
class Parity:
    """Hold MuJoCo against CartPole-v1, rung by rung."""

    model: str = "cartpole"
    """A shipped model's name or an MJCF file."""
    set: tuple[str, ...] = ()
    """Edits of the model, such as pole.length=1.5 or joint:hinge.damping=0.1."""
    against: Against = "cartpole-v1"
    """cartpole-v1: is this model CartPole-v1? itself: does MuJoCo move it as its equations do?"""
    rungs: tuple[int, ...] = tuple(range(1, 11))
    """Which rungs of the ladder."""
    quick: bool = False
    """Fewer samples."""
    strict: bool = False
    """Exit with 1 also where the motion holds and the model's numbers are not CartPole-v1's."""
    json: Path | None = None
    """Write every figure to this file."""


@dataclass(frozen=True)
class Doctor:
    """Say what was found here: versions, OpenGL, encoders, and what to install."""

    json: bool = False
    """Print JSON."""


@dataclass(frozen=True)
class Model:
    """List models, show what was understood of one, or write an edited copy."""

    action: Annotated[Literal["list", "show", "edit"], tyro.conf.Positional]
    """list: what there is. show: one model. edit: write a copy with --set to -o."""
    name: Annotated[str, tyro.conf.Positional] = "cartpole"
    """A shipped model's name or an MJCF file."""
    set: tuple[str, ...] = ()
    """Edits, such as pole.length=1.5 or joint:hinge.damping=0.1."""
    own_timestep: bool = False
    """Let a control step be one physics step of the model's file, instead of 0.02 s."""
    output: Annotated[Path | None, tyro.conf.arg(aliases=["-o"])] = None
    """The file that edit writes."""


@dataclass(frozen=True)
class Transfer:
    """Play policies on models they were not trained on; or see how far a number can move."""

    sources: Annotated[
        tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="RUN-OR-POLICY …")
    ] = tyro.MISSING
    """Run folders or policy files; many --seeds in one folder count as one."""
    models: tuple[str, ...] = ()
    """Names or files of models, and gym for gymnasium's own; all there are if left out."""
    set: tuple[str, ...] = ()
    """Edits of every model, such as pole.length=1.5 or joint:hinge.damping=0.1; gym has none."""
    sweep: str | None = None
    """An edit over a range, such as pole.length=0.5:3:0.25, on one model."""
    integrator: Integrator = "gym"
    """gym: explicit Euler, as CartPole-v1; mujoco: the integrator that the model's file names."""
    own_timestep: bool = False
    """Let a control step be one physics step of a model's file, instead of 0.02 s."""
    episodes: int = EPISODES
    """Greedy episodes of each policy on each model."""
    seed: int = SEED
    """Seeds the starting states."""
    workers: int | None = None
    """How many evaluations at once; as many as there are cores if left out."""
    allow_assets: tuple[Path, ...] = ()
    """Folders in which the meshes and textures of a run's model may lie, besides the run's own."""
    output: Annotated[Path | None, tyro.conf.arg(aliases=["-o"])] = None
    """Folder for the table, the JSON and the picture; in transfer/, they get a number where such
    are there already."""
    overwrite: bool = False
    """Replace what is there."""


@dataclass(frozen=True)
class Watch:
    """On every save of a model's file: check it, prove it, train on it, film it."""

    file: Annotated[Path, tyro.conf.Positional]
    """An MJCF file."""
    preset: str = "tuned"
    """How to train."""
    episodes: int | None = None
    """Episodes to train; the preset's if left out."""
    integrator: Integrator = "gym"
    """gym: explicit Euler, as CartPole-v1; mujoco: the integrator that the file names."""
    own_timestep: bool = False
    """Let a control step be one physics step of the file, instead of 0.02 s."""
    seed: int = 0
    """Seeds the training."""
    video: bool = True
    """Film it."""
    once: int | None = None
    """End after this many saves, the first look included."""


Command = Train | Evaluate | Render | Parity | Doctor | Model | Transfer | Watch
