"""The command line: parse, call, print.

Results go to stdout, progress and errors to stderr. Exit codes: 0, 2 for a user's mistake or for
results that could not be printed, 130 after Ctrl-C. Heavy modules are imported by the command that
needs them, so `--help` is quick.
"""

import contextlib
import dataclasses
import io
import json
import logging
import os
import re
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
from mjcartpole.output import has_left, patient_output, stdout_problem
from mjcartpole.signals import Interrupted, StopSignals

FAILED = 2
INTERRUPTED = 130
_DASHED_FILE = re.compile(r"-(?!-|o=).+\.(mp4|gif|webp|png|xml|json)")
"""A file whose name begins with a dash: no flag with a single one looks like this."""
_LISTS = ("--bins", "--low", "--high", "--rungs", "--models")
COMMANDS = ("train", "evaluate", "render", "parity", "doctor", "model", "transfer", "watch")


class UsageError(MjCartPoleError):
    """The command line cannot be understood."""


def main(argv: Sequence[str] | None = None) -> NoReturn:
    """Run a command and exit with its code."""
    with patient_output():
        code = _exit_code(list(sys.argv[1:] if argv is None else argv))
        problem = stdout_problem()
        if problem is not None and not has_left(problem):
            reason = problem.strerror or problem
            _complain(f"error: stdout could not be written ({reason}); all else went on without it")
            code = code or FAILED
    sys.exit(code)


def _exit_code(argv: list[str]) -> int:
    try:
        return _run(argv)
    except SystemExit as stop:  # After --help.
        return int(stop.code or 0)
    except MjCartPoleError as error:
        _complain(f"error: {error}")
        return FAILED
    except KeyboardInterrupt as interrupt:
        _complain(str(interrupt) or "interrupted")
        return int(getattr(interrupt, "exit_code", INTERRUPTED))


def _complain(message: str) -> None:
    print(f"mjcartpole: {message}", file=sys.stderr)


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
        from mjcartpole.commands import evaluate as commands  # noqa: F401, PLC0415
    if signals.stop():
        raise Interrupted(number=signals.number)


# Each imports what else it needs: MuJoCo, SciPy and Numba are not for `--help`.


def _evaluate(command: Evaluate) -> int:
    from mjcartpole.commands import evaluate as commands  # noqa: PLC0415

    choice = commands.EvalTarget(**_choice(command))
    return commands.run_evaluate(
        command.source, choice, episodes=command.episodes, as_json=command.json
    )


def _parity(command: Parity) -> int:
    from mjcartpole.commands import parity as parity_command  # noqa: PLC0415

    return parity_command.run_parity(
        command.model,
        command.set,
        against=command.against,
        rungs=command.rungs,
        quick=command.quick,
        strict=command.strict,
        output=command.json,
    )


def _model(command: Model) -> int:
    from mjcartpole.commands import model as model_command  # noqa: PLC0415

    if command.action == "edit":
        return model_command.run_edit(command.name, command.set, command.output)
    if command.output is not None:
        raise UsageError(f"-o is for `model edit`: `model {command.action}` writes no file")
    if command.action == "show":
        return model_command.run_show(command.name, command.set, command.own_timestep)
    if command.set or command.name != "cartpole":
        raise UsageError("`model list` lists all models; `model show` takes a name and edits")
    return model_command.run_list()


def _examine(command: Doctor) -> int:
    from mjcartpole.media import doctor  # noqa: PLC0415

    report = doctor.examine()
    print(json.dumps(report.as_dict(), indent=2) if command.json else report.text())
    return 0


def _transfer(command: Transfer) -> int:
    from mjcartpole.commands import transfer as transfer_command  # noqa: PLC0415

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
        overwrite=command.overwrite,
        allow_assets=command.allow_assets,
    )


def _watch(command: Watch) -> int:
    from mjcartpole.commands import watch as watch_command  # noqa: PLC0415

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
    from mjcartpole.commands import train as train_command  # noqa: PLC0415

    how = train_command.TrainOptions(
        engine=command.engine,
        checkpoint_every=command.checkpoint_every,
        workers=command.workers,
        video=command.video,
        tensorboard=command.tensorboard,
        allow_assets=command.allow_assets,
    )
    if command.allow_assets and command.resume is None:
        raise ConfigError("--allow-assets is for --resume; a new run's model may name any file")
    if command.resume is not None:
        _check_only_resumed(command)
        return train_command.run_resume(command.resume, how)
    where = train_command.RunLocation(command.preset, command.run_dir, command.overwrite)
    if command.seeds != 1:
        return train_command.run_seeds(command.config, how, where, seeds=command.seeds)
    if command.workers is not None:
        raise ConfigError("--workers is for several --seeds")
    return train_command.run_train(command.config, how, where)


def _render(command: Render) -> int:
    from mjcartpole.commands import evaluate as commands  # noqa: PLC0415
    from mjcartpole.commands import render as render_command  # noqa: PLC0415
    from mjcartpole.studies.film import VideoOptions  # noqa: PLC0415

    if not command.sources:
        raise UsageError("render needs a RUN-OR-POLICY, or several; see mjcartpole render --help")
    width, height = _parse_size(command.size)
    look = VideoOptions(
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
        commands.EvalTarget(**_choice(command)),
        look,
        episodes=command.episodes,
        output=command.output,
        sheet=command.sheet,
        overwrite=command.overwrite,
    )


def _parse_size(text: str) -> tuple[int, int]:
    width, _, height = text.lower().partition("x")
    if not (width.isdecimal() and height.isdecimal()):
        raise UsageError(f"--size is a width and a height in pixels, such as 640x480, not '{text}'")
    return int(width), int(height)


def _check_only_resumed(command: Train) -> None:
    """A resumed training keeps its config: refuse flags that would be ignored."""
    method = command.config.method
    default = Train(config=TrainConfig.preset(command.preset, method=method))
    asked, usual = command.config.values(), default.config.values()
    given = [name for name in asked if asked[name] != usual[name]]
    others = ("preset", "run_dir", "overwrite", "seeds")
    given += [name for name in others if getattr(command, name) != getattr(default, name)]
    if given:
        flags = ", ".join(f"--{name.replace('_', '-')}" for name in given)
        raise ConfigError(f"--resume continues a run as it began: leave out {flags}")


class _ToStderr(logging.Handler):
    """One line per record on what is stderr at that time: a progress bar may have taken it over."""

    def emit(self, record: logging.LogRecord) -> None:
        _complain(record.getMessage())


def _report_to_stderr() -> None:
    log = logging.getLogger("mjcartpole")
    if not any(isinstance(handler, _ToStderr) for handler in log.handlers):
        log.addHandler(_ToStderr())
        log.setLevel(logging.INFO)
        log.propagate = False


def _choice(command: Played) -> dict[str, Any]:
    return {each.name: getattr(command, each.name) for each in dataclasses.fields(Played)}


def parse(argv: Sequence[str]) -> Command:
    """The command that a command line means.

    Raises:
        ConfigError: A value makes no sense.
        UsageError: A word of it is not understood.
        SystemExit: With code 0, after `--help`.
    """
    argv = [f"./{word}" if _DASHED_FILE.fullmatch(word) else word for word in argv]
    argv = _split_lists(_gather_edits(argv))
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
                description="CartPole-v1 as real physics: train a Q-table, evaluate it, film it. "
                "mjcartpole --version prints the version.",
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
            edits += _split_edits(word.removeprefix("--set=")) if "=" in word else []
            follows, first = True, "=" not in word
        elif follows and (first or "=" in word) and not word.startswith("-"):
            # The first one is meant as an edit, even where it is none.
            edits += _split_edits(word)
            first = False
        else:
            follows = False
            words.append(word)
    return [*words, "--set", *edits] if edits else words


def _split_edits(word: str) -> list[str]:
    """The edits of a word, which may have commas between them: a.b=1,c.d=2."""
    return re.split(r",(?=[\w.:]+=)", word)


def _split_lists(argv: Sequence[str]) -> list[str]:
    """Take the values of a flag that has several with commas too: 1,3,6,8 as 1 3 6 8."""
    words, follows = list[str](), False
    for word in argv:
        flag, _, value = word.partition("=")
        if flag in _LISTS:
            follows = True
            words += [flag, *_split_values(value)]
        else:
            follows = follows and not re.match(r"--|-[A-Za-z]$", word)
            words += _split_values(word) if follows else [word]
    return words


def _split_values(word: str) -> list[str]:
    if os.path.exists(word):  # noqa: PTH110 - a Path raises where a name is too long
        return [word]
    if word.startswith("[") and word.endswith("]"):
        word = word[1:-1]
    if re.search(r",\s*,", word):
        raise UsageError(f"'{word}' has nothing between two commas; give values as 1,3,6,8")
    return [value for value in re.split(r"[,\s]+", word) if value]


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
