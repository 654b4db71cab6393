"""What a page needs of a run, as plain values for JSON."""

import base64
import gzip
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from mjcartpole.files import read_bytes
from mjcartpole.learning.policy import Policy
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.studies.film import play
from mjcartpole.studies.policy_setup import PolicySetup
from mjcartpole.task import CONTROL_STEP, Task

_MOST_BYTES: Final = 2**26
"""Of a file that a model names."""

Table = dict[str, Any]
"""A row's name and its text."""


@dataclass(frozen=True)
class Picture:
    """A plot of a run.

    Attributes:
        title: What it shows.
        alt: The same for those who do not see it.
        svg: The picture.
    """

    title: str
    alt: str
    svg: bytes


@dataclass(frozen=True)
class Told:
    """What is told of a run beside the scene.

    Attributes:
        facts: What it came to.
        config: How it was trained.
        versions: With what.
        pictures: Its plots.
        film: Its film, an .mp4 or .gif, if there is one.
    """

    facts: Table = field(default_factory=dict)
    config: Table = field(default_factory=dict)
    versions: Table = field(default_factory=dict)
    pictures: tuple[Picture, ...] = ()
    film: Path | None = None


def run_data(setup: PolicySetup, told: Told, backend: str) -> dict[str, Any]:
    """Return all that the page needs of a policy that is played on MuJoCo.

    Args:
        setup: The policy, and where it is played; its first episode is recorded.
        told: What is told of it.
        backend: Where it was trained.

    Raises:
        ConfigError: The policy is one for another number of poles.
        FileError: A file of the model cannot be read.
        SimulationError: The physics diverged.
    """
    cartpole, (rollout,) = setup.cartpole, play(setup)
    document, files = cartpole.stored
    return {
        "name": setup.name,
        "document": document,
        "assets": {name: in_base64(_content(source)) for name, source in files.items()},
        "backend": backend,
        "integrator": setup.integrator,
        "own_timestep": not math.isclose(cartpole.control_step, CONTROL_STEP),
        "parts": _parts(cartpole),
        "task": _rules(setup.task),
        "grid": _grid(setup.policy),
        "table": packed(setup.policy.q_table),
        "episode": {
            "states": packed(rollout.states),
            "ending": rollout.episode.ending,
            "total": rollout.episode.total,
        },
        "facts": _lines(told.facts),
        "config": _lines(told.config),
        "versions": _lines(told.versions),
        "pictures": [
            {"title": each.title, "alt": each.alt, "source": _uri(each.svg, "image/svg+xml")}
            for each in told.pictures
        ],
        "film": told.film and _uri(told.film.read_bytes(), _FILMS[told.film.suffix]),
    }


_FILMS: Final = {".mp4": "video/mp4", ".gif": "image/gif"}


def packed(numbers: npt.NDArray[np.float64]) -> str:
    """Return numbers as text: float64, little endian, gzipped, in base64."""
    return in_base64(gzip.compress(numbers.astype("<f8").tobytes(), mtime=0))


def in_base64(content: bytes) -> str:
    """Return bytes as text."""
    return base64.b64encode(content).decode("ascii")


def _uri(content: bytes, kind: str) -> str:
    return f"data:{kind};base64,{in_base64(content)}"


def _content(source: Path | str) -> bytes:
    return source.encode() if isinstance(source, str) else read_bytes(source, _MOST_BYTES)


def _parts(cartpole: CartPole) -> dict[str, Any]:
    return {
        "slider": cartpole.slider,
        "hinges": list(cartpole.hinges),
        "controls": list(cartpole.controls),
        "substeps": cartpole.substeps,
        "upright": list(cartpole.upright),
    }


def _rules(task: Task) -> dict[str, Any]:
    """Return the rules; JSON has no infinity."""
    limits = {"x_limit": task.x_limit, "theta_limit": task.theta_limit}
    return {
        "name": task.name,
        **{name: limit if math.isfinite(limit) else None for name, limit in limits.items()},
        "start_low": task.start_low,
        "start_high": task.start_high,
        "time_limit": task.time_limit,
    }


def _grid(policy: Policy) -> dict[str, Any]:
    grid = policy.discretizer
    names = ("bins", "low", "high", "tilings", "mirror", "interpolated")
    return {name: getattr(grid, name) for name in names}


def _lines(values: Mapping[str, object]) -> list[list[str]]:
    return [[name, _in_words(value)] for name, value in values.items()]


def _in_words(value: object) -> str:
    if isinstance(value, list | tuple):
        return ", ".join(map(_in_words, value)) or "none"
    if value is None or isinstance(value, bool):
        return {None: "none", True: "yes", False: "no"}[value]
    return f"{value:.12g}" if isinstance(value, float) else str(value)
