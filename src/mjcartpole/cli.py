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
from collections.abc import Callable, Sequence
from typing import Annotated, Any, NoReturn

import tyro

from mjcartpole import __version__
from mjcartpole.errors import ConfigError, MjCartPoleError
from mjcartpole.flags import (
    Command,
    Doctor,
    Evaluate,
    Model,
    Parity,
    Played,
    Render,
    Train,
    Transfer,
    Watch,
)
from mjcartpole.learning.config import TrainConfig
from mjcartpole.signals import Interrupted, StopSignals

INTERRUPTED = 130
COMMANDS = ("train", "evaluate", "render", "parity", "doctor", "model", "transfer", "watch")


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
    except MemoryError:
        print("mjcartpole: error: this takes more memory than there is", file=sys.stderr)
        code = 2
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
    _import_mujoco()
    calls: dict[type, Callable[[Any], int]] = {
        Train: _train,
        Evaluate: _evaluate,
        Render: _render,
        Parity: _parity,
        Doctor: _examine,
        Model: _model,
        Transfer: _transfer,
        Watch: _watch,
    }
    return calls[type(command)](command)


def _import_mujoco() -> None:
    """Import what each command needs; MuJoCo's modules lose an interrupt that comes meanwhile.

    Raises:
        Interrupted: One came.
    """
    signals = StopSignals()
    with signals.caught(), signals.deferred():
        from mjcartpole import commands  # noqa: F401, PLC0415
    if signals.stop():
        raise Interrupted(number=signals.number)


# Each imports what else it needs: MuJoCo, SciPy and Numba are not for `--help`.


def _evaluate(command: Evaluate) -> int:
    from mjcartpole import commands  # noqa: PLC0415

    choice = commands.Choice(**_choice(command))
    return commands.run_evaluate(
        command.source, choice, episodes=command.episodes, as_json=command.json
    )


def _parity(command: Parity) -> int:
    from mjcartpole import parity_command  # noqa: PLC0415

    return parity_command.run_parity(
        command.model,
        command.set,
        against=command.against,
        rungs=command.rungs,
        quick=command.quick,
        output=command.json,
    )


def _model(command: Model) -> int:
    from mjcartpole import model_command  # noqa: PLC0415

    match command.action:
        case "list":
            return model_command.run_list()
        case "show":
            return model_command.run_show(command.name, command.set, command.own_timestep)
        case "edit":
            return model_command.run_edit(command.name, command.set, command.output)


def _examine(command: Doctor) -> int:
    from mjcartpole.media import doctor  # noqa: PLC0415

    report = doctor.examine()
    print(json.dumps(report.as_dict(), indent=2) if command.json else report.text())
    return 0


def _transfer(command: Transfer) -> int:
    from mjcartpole import transfer_command  # noqa: PLC0415

    return transfer_command.run_transfer(
        command.sources,
        models=command.models,
        edits=command.set,
        swept=command.sweep,
        integrator=command.integrator,
        own_timestep=command.own_timestep,
        episodes=command.episodes,
        seed=command.seed,
        workers=command.workers,
        output=command.output,
    )


def _watch(command: Watch) -> int:
    from mjcartpole import watch_command  # noqa: PLC0415

    return watch_command.run_watch(
        command.file,
        preset=command.preset,
        episodes=command.episodes,
        integrator=command.integrator,
        own_timestep=command.own_timestep,
        seed=command.seed,
        video=command.video,
        once=command.once,
    )


def _train(command: Train) -> int:
    from mjcartpole import train_command  # noqa: PLC0415

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
    from mjcartpole import commands, render_command  # noqa: PLC0415
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


def _choice(command: Played) -> dict[str, Any]:
    names = ("backend", "model", "integrator", "seed", "set", "own_timestep")
    return {name: getattr(command, name) for name in names}


def parse(argv: Sequence[str]) -> Command:
    """The command that a command line means.

    Raises:
        ConfigError: A value makes no sense.
        UsageError: A word of it is not understood.
        SystemExit: With code 0, after `--help`.
    """
    argv = _gather_edits(argv)
    preset = _preset_in(argv)
    train_default = Train(config=TrainConfig.preset(preset), preset=preset)
    grammar = (
        Annotated[Train, tyro.conf.subcommand("train", default=train_default)]
        | Annotated[Evaluate, tyro.conf.subcommand("evaluate")]
        | Annotated[Render, tyro.conf.subcommand("render")]
        | Annotated[Parity, tyro.conf.subcommand("parity")]
        | Annotated[Doctor, tyro.conf.subcommand("doctor")]
        | Annotated[Model, tyro.conf.subcommand("model")]
        | Annotated[Transfer, tyro.conf.subcommand("transfer")]
        | Annotated[Watch, tyro.conf.subcommand("watch")]
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


def _gather_edits(argv: Sequence[str]) -> list[str]:
    """One --set with all edits, wherever and however often they were given."""
    words, edits, follows, first = [], list[str](), False, False
    for word in argv:
        if word == "--set" or word.startswith("--set="):
            edits += [word.removeprefix("--set=")] if "=" in word else []
            follows, first = True, "=" not in word
        elif follows and (first or "=" in word) and not word.startswith("-"):
            # The first one is meant as an edit, even where it is none.
            edits.append(word)
            first = False
        else:
            follows = False
            words.append(word)
    return [*words, "--set", *edits] if edits else words


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
