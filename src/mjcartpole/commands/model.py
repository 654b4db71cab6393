"""What `model` does and prints: the models that are there, what one is, and edited files."""

import re
from collections.abc import Sequence
from pathlib import Path

from mjcartpole.errors import ConfigError
from mjcartpole.files import write_whole
from mjcartpole.physics.describe import describe
from mjcartpole.physics.edit.edits import EDIT_NAMES, describe_edits
from mjcartpole.physics.load import find_model, load_model, model_names, models_folder
from mjcartpole.physics.playable import why_unplayable
from mjcartpole.physics.simulation import silence_mujoco
from mjcartpole.physics.unmodelled_effects import differs_from, idle_numbers

_COMMENT = re.compile(r"<!--(.*?)-->", re.DOTALL)


def run_list() -> int:
    """Print the models that come with the package, and what can be edited by meaning."""
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
    return 0


def run_show(name: str, edits: Sequence[str], own_timestep: bool = False) -> int:
    """Print what was understood of a model, and how it differs from CartPole-v1."""
    silence_mujoco()
    cartpole = load_model(name, edits, own_timestep=own_timestep)
    print(cartpole.name)
    for line in describe(cartpole).text():
        print(f"  {line}")
    different = differs_from(cartpole)
    idle = [] if cartpole.poles > 1 else idle_numbers(cartpole)
    print("\ndiffers from CartPole-v1:" if different else "\nmoves as CartPole-v1 does")
    for phrase in different:
        print(f"  {phrase}")
    if idle:
        print("what no episode feels:")
    for phrase in idle:
        print(f"  {phrase}")
    why = why_unplayable(cartpole)
    if why:
        print(f"\n{why}")
    return 0


def run_edit(base: str, edits: Sequence[str], output: Path | None) -> int:
    """Write an edited copy of a model's file: only what was edited differs."""
    silence_mujoco()
    if not edits:
        raise ConfigError("nothing to edit; give --set NAME=VALUE, such as pole.length=1.5")
    if output is None:
        raise ConfigError("no file to write; give -o FILE.xml")
    # Both before the file is written; of a model with an odd timestep too.
    before, after = (load_model(base, each, own_timestep=True) for each in ((), edits))
    write_whole(output, _mark_of(base) + after.xml)
    print(f"{output}: {base} with")
    for line in describe_edits(before.xml, after.xml):
        print(f"  {line}")
    return 0


def _mark_of(base: str) -> str:
    """The byte order mark that some editors put before a file; it stays where it was."""
    mark = "\ufeff"
    return mark if find_model(base).read_bytes().startswith(mark.encode()) else ""


def _headline(path: Path) -> str:
    """The first sentence of a file's first comment, without the file's name."""
    comment = _COMMENT.search(path.read_text(encoding="utf-8"))
    if comment is None:
        return ""
    first = comment[1].strip().split("\n\n")[0].split("\n")[0]
    return first.removeprefix(f"{path.name}: ").strip()
