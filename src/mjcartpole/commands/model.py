"""`mjcartpole model`: the models that are there, what one is, and edited files."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from mjcartpole.commands.options import Command, OutputPath, UsageError
from mjcartpole.errors import ConfigError
from mjcartpole.files import write_whole

_COMMENT = re.compile(r"<!--(.*?)-->", re.DOTALL)


@dataclass(frozen=True)
class Model(Command):
    """List models, show what was understood of one, or write an edited copy."""

    action: Annotated[Literal["list", "show", "edit"], tyro.conf.Positional]
    """list: what there is. show: one model. edit: write a copy with --set to -o."""
    name: Annotated[str, tyro.conf.Positional] = "cartpole"
    """A shipped model's name or an MJCF file."""
    set: tuple[str, ...] = ()
    """Edits, such as pole.length=1.5 or joint:hinge.damping=0.1."""
    own_timestep: bool = False
    """Let a control step be one physics step of the model's file, instead of 0.02 s."""
    output: OutputPath = None
    """The file that edit writes."""

    def run(self) -> int:
        """List, show or edit."""
        if self.action == "edit":
            self._edit()
            return 0
        if self.output is not None:
            raise UsageError(f"-o is for `model edit`: `model {self.action}` writes no file")
        if self.action == "show":
            self._show()
            return 0
        if self.set or self.name != "cartpole":
            raise UsageError("`model list` lists all models; `model show` takes a name and edits")
        _list()
        return 0

    def _show(self) -> None:
        """Print what was understood of a model, and how it differs from CartPole-v1."""
        from mjcartpole.physics.describe import describe
        from mjcartpole.physics.load import load_model
        from mjcartpole.physics.playable import why_unplayable
        from mjcartpole.physics.simulation import silence_mujoco
        from mjcartpole.physics.unmodelled_effects import differs_from, idle_numbers

        silence_mujoco()
        cartpole = load_model(self.name, self.set, own_timestep=self.own_timestep)
        _print_block(cartpole.name, describe(cartpole).text())
        different = differs_from(cartpole)
        heading = "differs from CartPole-v1:" if different else "moves as CartPole-v1 does"
        _print_block(f"\n{heading}", different)
        if idle := [] if cartpole.poles > 1 else idle_numbers(cartpole):
            _print_block("what no episode feels:", idle)
        if why := why_unplayable(cartpole):
            print(f"\n{why}")

    def _edit(self) -> None:
        """Write an edited copy of a model's file: only what was edited differs."""
        from mjcartpole.physics.edit.edits import describe_edits
        from mjcartpole.physics.load import load_model
        from mjcartpole.physics.simulation import silence_mujoco

        silence_mujoco()
        if not self.set:
            raise ConfigError("nothing to edit; give --set NAME=VALUE, such as pole.length=1.5")
        if self.output is None:
            raise ConfigError("no file to write; give -o FILE.xml")
        # Both before the file is written; of a model with an odd timestep too.
        before, after = (
            load_model(self.name, edits, own_timestep=True) for edits in ((), self.set)
        )
        write_whole(self.output, _mark_of(self.name) + after.xml)
        _print_block(f"{self.output}: {self.name} with", describe_edits(before.xml, after.xml))


def _list() -> None:
    """Print the models that come with the package, and what can be edited by meaning."""
    from mjcartpole.physics.edit.edits import EDIT_NAMES
    from mjcartpole.physics.load import model_names, models_folder

    print("models:")
    for name in model_names():
        print(f"  {name:10s} {_headline(models_folder() / f'{name}.xml')}")
    print("\nedits by meaning (--set NAME=VALUE):")
    for name, what in EDIT_NAMES.items():
        print(f"  {name:16s} {what}")
    print(
        "\nof several poles, one by its number: --set pole2.length=1.5\n"
        "edits by element, for any attribute of MJCF: --set joint:hinge.damping=0.1\n"
        f"the files are in {models_folder()}"
    )


def _print_block(heading: str, lines: Iterable[str]) -> None:
    print(heading)
    for line in lines:
        print(f"  {line}")


def _mark_of(base: str) -> str:
    """Return the byte order mark that some editors put before a file; it stays where it was."""
    from mjcartpole.physics.load import find_model

    mark = "\ufeff"
    return mark if find_model(base).read_bytes().startswith(mark.encode()) else ""


def _headline(path: Path) -> str:
    """Return the first sentence of a file's first comment, without the file's name."""
    comment = _COMMENT.search(path.read_text(encoding="utf-8"))
    if comment is None:
        return ""
    first = comment[1].strip().split("\n\n")[0].split("\n")[0]
    return first.removeprefix(f"{path.name}: ").strip()
