"""The command line: parse, call, print.

Results go to stdout, progress and errors to stderr. Exit codes: 0, 2 for a user's mistake, 130
after Ctrl-C. Heavy modules are imported by the command that needs them, so `--help` is quick.
"""

import contextlib
import dataclasses
import io
import json
import logging
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, NoReturn

import tyro

from mjcartpole import __version__
from mjcartpole.envs.backend import Backend
from mjcartpole.errors import ConfigError, MjCartPoleError
from mjcartpole.integrator import Integrator
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.engine import Engine
from mjcartpole.studies.evaluation import EPISODES

INTERRUPTED = 130
COMMANDS = ("train", "evaluate", "render", "parity", "doctor")


Against = Literal["cartpole-v1", "itself"]
Quality = Literal["draft", "normal", "high"]


@dataclass(frozen=True)
class Train:
    """Train a Q-table, evaluate it, and film it."""

    config: Annotated[TrainConfig, tyro.conf.arg(name=""), tyro.conf.OmitArgPrefixes]
    preset: str = "tuned"
    """Where the defaults below come from: tuned, article or article-terminal."""
    run_dir: Path | None = None
    """Folder for the run; runs/<preset>-<backend>-seed<seed> if left out."""
    video: bool = True
    """Film the first evaluation episode into videos/<run's name>.mp4."""
    overwrite: bool = False
    """Replace the run that --run-dir holds."""
    resume: Path | None = None
    """Continue the training of this run folder, or from a checkpoint in it, as it began."""
    engine: Engine = "compiled"
    """Who runs the loop; both give the same bits."""
    seeds: int = 1
    """Train this many seeds from --seed on, side by side, and print statistics over them."""
    workers: int | None = None
    """How many seeds at once; as many as there are cores if left out."""
    checkpoint_every: float = 30.0
    """Seconds between two checkpoints."""
    tensorboard: bool = False
    """Write the learning curve as TensorBoard events into the run folder."""


@dataclass(frozen=True)
class _Played:
    """What evaluating and filming have in common: where a policy is played."""

    backend: Backend | None = None
    """Who does the physics; the run's own if left out."""
    model: str | None = None
    """Model to play on; the run's own if left out."""
    integrator: Integrator | None = None
    """The run's own if left out."""
    seed: int | None = None
    """Seeds the starting states; the same as after training if left out."""


@dataclass(frozen=True)
class Evaluate(_Played):
    """Play greedy episodes from fresh starting states, and count."""

    source: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN-OR-POLICY")] = (
        tyro.MISSING
    )
    """A run folder or a policy file."""
    episodes: int = EPISODES
    """How many."""
    json: bool = False
    """Print JSON."""


@dataclass(frozen=True)
class Render(_Played):
    """Film greedy episodes, the first that an evaluation with the same seed plays."""

    sources: Annotated[
        tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="RUN-OR-POLICY …")
    ] = tyro.MISSING
    """Run folders or policy files; several are shown side by side, from the same start."""
    output: Annotated[Path | None, tyro.conf.arg(aliases=["-o"])] = None
    """An .mp4, .gif or .webp, or a folder for pictures; videos/<name>.mp4 if left out."""
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
    against: Against = "cartpole-v1"
    """cartpole-v1: is this model CartPole-v1? itself: does MuJoCo move it as its equations do?"""
    rungs: tuple[int, ...] = tuple(range(1, 11))
    """Which rungs of the ladder."""
    quick: bool = False
    """Fewer samples."""
    json: Path | None = None
    """Write every figure to this file."""


@dataclass(frozen=True)
class Doctor:
    """Say what was found here: versions, OpenGL, encoders, and what to install."""

    json: bool = False
    """Print JSON."""


Command = Train | Evaluate | Render | Parity | Doctor


class UsageError(MjCartPoleError):
    """The command line cannot be understood."""


def main(argv: Sequence[str] | None = None) -> NoReturn:
    """Run a command and exit with its code."""
    try:
        code = _run(list(sys.argv[1:] if argv is None else argv))
    except MjCartPoleError as error:
        print(f"mjcartpole: error: {error}", file=sys.stderr)
        code = 2
    except KeyboardInterrupt as interrupt:
        print(f"mjcartpole: {str(interrupt) or 'interrupted'}", file=sys.stderr)
        code = getattr(interrupt, "exit_code", INTERRUPTED)
    except BrokenPipeError:
        # The reader of stdout has gone (`mjcartpole … | head`): nothing is left to say.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 0
    sys.exit(code)


def _run(argv: list[str]) -> int:
    if argv in (["--version"], ["-V"]):
        print(f"mjcartpole {__version__}")
        return 0
    command = parse(argv or ["--help"])
    _report_to_stderr()
    match command:
        case Train():
            return _train(command)
        case Doctor():
            return _examine(command)
    from mjcartpole import commands  # noqa: PLC0415 - it imports MuJoCo

    match command:
        case Evaluate():
            return commands.run_evaluate(
                command.source,
                commands.Choice(**_choice(command)),
                episodes=command.episodes,
                as_json=command.json,
            )
        case Render():
            return _render(command)
        case Parity():
            from mjcartpole import parity_command  # noqa: PLC0415 - it imports SciPy

            return parity_command.run_parity(
                command.model,
                against=command.against,
                rungs=command.rungs,
                quick=command.quick,
                output=command.json,
            )


def _examine(command: Doctor) -> int:
    from mjcartpole.media import doctor  # noqa: PLC0415 - it imports MuJoCo

    report = doctor.examine()
    print(json.dumps(report.as_dict(), indent=2) if command.json else report.text())
    return 0


def _train(command: Train) -> int:
    from mjcartpole import train_command  # noqa: PLC0415 - it imports MuJoCo

    how = train_command.How(
        engine=command.engine,
        checkpoint_every=command.checkpoint_every,
        workers=command.workers,
        video=command.video,
        tensorboard=command.tensorboard,
    )
    if command.resume is not None:
        _check_only_resumed(command)
        return train_command.run_resume(command.resume, how)
    where = train_command.Where(command.preset, command.run_dir, command.overwrite)
    if command.seeds != 1:
        return train_command.run_seeds(command.config, how, where, seeds=command.seeds)
    if command.workers is not None:
        raise ConfigError("--workers is for several --seeds")
    return train_command.run_train(command.config, how, where)


def _render(command: Render) -> int:
    from mjcartpole import commands, render_command  # noqa: PLC0415 - they import MuJoCo
    from mjcartpole.studies.film import Look  # noqa: PLC0415

    if not command.sources:
        raise UsageError("render needs a RUN-OR-POLICY, or several; see mjcartpole render --help")
    width, height = _parse_size(command.size)
    look = Look(
        width=width,
        height=height,
        camera=command.camera,
        quality=command.quality,
        overlay=command.overlay,
        speed=command.speed,
        fps=command.fps,
        fall=command.fall,
    )
    return render_command.run_render(
        command.sources,
        commands.Choice(**_choice(command)),
        look,
        episodes=command.episodes,
        output=command.output,
        sheet=command.sheet,
    )


def _parse_size(text: str) -> tuple[int, int]:
    width, _, height = text.lower().partition("x")
    if not (width.isdecimal() and height.isdecimal()):
        raise UsageError(f"--size is a width and a height in pixels, such as 640x480, not '{text}'")
    return int(width), int(height)


def _check_only_resumed(command: Train) -> None:
    """A resumed training keeps its config: refuse flags that would be ignored."""
    default = Train(config=TrainConfig.preset(command.preset))
    fields = dataclasses.fields(TrainConfig)
    given = [
        field.name
        for field in fields
        if getattr(command.config, field.name) != getattr(default.config, field.name)
    ]
    others = ("preset", "run_dir", "overwrite", "seeds")
    given += [name for name in others if getattr(command, name) != getattr(default, name)]
    if given:
        flags = ", ".join(f"--{name.replace('_', '-')}" for name in given)
        raise ConfigError(f"--resume continues a run as it began: leave out {flags}")


class _ToStderr(logging.Handler):
    """One line per record on what is stderr at that time: a progress bar may have taken it over."""

    def emit(self, record: logging.LogRecord) -> None:
        print(f"mjcartpole: {record.getMessage()}", file=sys.stderr)


def _report_to_stderr() -> None:
    log = logging.getLogger("mjcartpole")
    if not any(isinstance(handler, _ToStderr) for handler in log.handlers):
        log.addHandler(_ToStderr())
        log.setLevel(logging.INFO)
        log.propagate = False


def _choice(command: _Played) -> dict[str, Any]:
    return {name: getattr(command, name) for name in ("backend", "model", "integrator", "seed")}


def parse(argv: Sequence[str]) -> Command:
    """The command that a command line means.

    Raises:
        ConfigError: A value makes no sense.
        UsageError: A word of it is not understood.
        SystemExit: With code 0, after `--help`.
    """
    preset = _preset_in(argv)
    train_default = Train(config=TrainConfig.preset(preset), preset=preset)
    grammar = (
        Annotated[Train, tyro.conf.subcommand("train", default=train_default)]
        | Annotated[Evaluate, tyro.conf.subcommand("evaluate")]
        | Annotated[Render, tyro.conf.subcommand("render")]
        | Annotated[Parity, tyro.conf.subcommand("parity")]
        | Annotated[Doctor, tyro.conf.subcommand("doctor")]
    )
    complaint = io.StringIO()
    try:
        with contextlib.redirect_stderr(complaint):
            command: Command = tyro.cli(
                grammar,
                args=list(argv),
                prog="mjcartpole",
                description="CartPole-v1 as real physics: train a Q-table, evaluate it, film it.",
            )
    except SystemExit as stop:
        if not stop.code:
            raise
        command_name = f" {argv[0]}" if argv[0] in COMMANDS else ""
        raise UsageError(
            f"{_one_line(complaint.getvalue())}; see mjcartpole{command_name} --help"
        ) from None
    return command


def _preset_in(argv: Sequence[str]) -> str:
    """The preset that a command line names: it decides the other flags' defaults."""
    for word, following in zip(argv, [*argv[1:], ""], strict=True):
        if word == "--preset":
            return following
        if word.startswith("--preset="):
            return word.removeprefix("--preset=")
    return "tuned"


def _one_line(complaint: str) -> str:
    """A tyro error box as one line: its message, and what it thinks was meant.

    The first line is a title; rules of dashes separate the message from what follows.
    """
    lines = [line.strip("│╭╮╰╯ ") for line in complaint.splitlines()[1:]]
    text = "\n".join("" if set(line) <= {"─", "-"} else line for line in lines)
    message, *others = [block.splitlines() for block in text.strip().split("\n\n")]
    for block in others:
        if block[0].startswith("Perhaps you meant") and len(block) > 1:
            return f"{' '.join(message)}; perhaps you meant {block[1]}"
    return " ".join(message).rstrip(".")
