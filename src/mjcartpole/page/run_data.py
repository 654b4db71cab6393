"""What a page needs of a run, as plain values for JSON."""

import base64
import dataclasses
import gzip
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from mjcartpole.disturbances.disturbances import NONE
from mjcartpole.errors import ConfigError
from mjcartpole.files import read_bytes
from mjcartpole.learning.naming import added_flags
from mjcartpole.page.told import Told
from mjcartpole.physics.bodies import starting_state
from mjcartpole.studies.policy_setup import PolicySetup
from mjcartpole.task import CARTPOLE_V1, CONTROL_STEP

_MOST_BYTES: Final = 2**26
"""Of a film, or of a file that a model names."""


_PARTS: Final = ("slider", "hinges", "controls", "substeps", "upright")
_RULES: Final = ("name", "x_limit", "theta_limit", "start_low", "start_high", "time_limit")
_GRID: Final = ("bins", "low", "high", "tilings", "mirror", "interpolated")


def run_data(setup: PolicySetup, told: Told, backend: str) -> dict[str, Any]:
    """Return all that the page needs of a policy that is played on MuJoCo, and of its training.

    Its first episode where it is played is recorded, undisturbed.

    Raises:
        ConfigError: The policy is one for another number of poles, or looks at actions before.
        FileError: A file of the model cannot be read.
        SimulationError: The physics diverged.
    """
    from mjcartpole.studies.film import play  # noqa: PLC0415 - a report's page needs no Pillow

    check_shown(setup)
    cartpole, (rollout,) = setup.cartpole, play(_recorded(setup))
    document, files = cartpole.stored
    return {
        "name": setup.name,
        "document": document,
        "assets": {name: in_base64(_content(source)) for name, source in files.items()},
        "backend": backend,
        "disturbances": added_flags(setup.disturbances),
        "integrator": setup.integrator,
        "own_timestep": not math.isclose(cartpole.control_step, CONTROL_STEP),
        "parts": _some(cartpole, _PARTS),
        "task": {
            **_some(setup.task, _RULES),
            "start": starting_state(cartpole, setup.task).tolist(),
        },
        "grid": {**_some(setup.table.discretizer, _GRID), "turns": setup.task.turns},
        "table": packed(setup.table.q_table),
        "episode": {
            "states": packed(rollout.states),
            "ending": rollout.episode.ending,
            "total": rollout.episode.total,
        },
        "facts": _lines(told.facts),
        "config": _lines(told.config),
        "versions": _lines(told.versions),
        "pictures": [
            {"title": each.title, "alt": each.alt, "svg": _zipped(each.svg.encode())}
            for each in told.pictures
        ],
        "film": told.film and _film(told.film),
    }


def check_shown(setup: PolicySetup) -> None:
    """Refuse a table that a page cannot play.

    Raises:
        ConfigError: It looks at actions before, or the policy is a controller.
    """
    if setup.table.actions:
        raise ConfigError(
            f"{setup.name} looks at actions before, which a page does not show; film it instead: "
            "mjcartpole render"
        )


def _recorded(setup: PolicySetup) -> PolicySetup:
    """Return where an episode is played that the page is to play again: no longer than most are."""
    most = min(setup.task.time_limit, CARTPOLE_V1.time_limit)
    task = setup.task.with_changes(max_episode_steps=most)
    return dataclasses.replace(setup, task=task, disturbances=NONE)


def packed(numbers: npt.NDArray[np.float64]) -> str:
    """Return numbers as text: float64, little endian, gzipped, in base64."""
    return _zipped(numbers.astype("<f8").tobytes())


def _zipped(content: bytes) -> str:
    return in_base64(gzip.compress(content, mtime=0))


def in_base64(content: bytes) -> str:
    """Return bytes as text."""
    return base64.b64encode(content).decode("ascii")


def _film(path: Path) -> str:
    kind = "image/gif" if path.suffix == ".gif" else "video/mp4"
    return f"data:{kind};base64,{in_base64(read_bytes(path, _MOST_BYTES))}"


def _content(source: Path | str) -> bytes:
    return source.encode() if isinstance(source, str) else read_bytes(source, _MOST_BYTES)


def _some(of: object, names: Sequence[str]) -> dict[str, Any]:
    """Return some attributes by name; JSON has no infinity, so that one is None."""
    values = {name: getattr(of, name) for name in names}
    return {name: None if value == math.inf else value for name, value in values.items()}


def _lines(values: Mapping[str, object]) -> list[list[str]]:
    return [[name, _in_words(value)] for name, value in values.items()]


def _in_words(value: object) -> str:
    if isinstance(value, list | tuple):
        return ", ".join(map(_in_words, value)) or "none"
    if value is None or isinstance(value, bool):
        return {None: "none", True: "yes", False: "no"}[value]
    if isinstance(value, int):
        return f"{value:,}"
    return f"{value:.12g}" if isinstance(value, float) else str(value)
