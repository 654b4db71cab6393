"""A run's config and summary, read back as if somebody else had written them."""

import dataclasses
import math
from pathlib import Path
from typing import Any, Final

from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.envs.backend import Backend
from mjcartpole.learning.config import DEFAULT_METHOD, TrainConfig, config_class
from mjcartpole.learning.episodes import ENDINGS
from mjcartpole.learning.stored import Fields, checked, read_document
from mjcartpole.rules import RULES
from mjcartpole.task import CARTPOLE_V1

CONFIG, SUMMARY = "config.json", "summary.json"

_ABOUT: Final[Fields] = {"preset": str, "video": bool}
_ADDED: Final = {
    "task": CARTPOLE_V1.name,
    "method": DEFAULT_METHOD,
    "mirror": False,
    "evaluate_every": None,
    "until": None,
    "tilings": 1,
    **dict.fromkeys(RULES),
    **{
        # JSON has lists in place of tuples.
        field.name: list(field.default) if type(field.default) is tuple else field.default
        for field in dataclasses.fields(Disturbances)
    },
}
"""Fields that configs of version 0.1 lack, and what they stood for."""
_SUMMARY_FIELDS: Final[Fields] = {
    "preset": str,
    "backend": Backend,
    "model": str,
    "seed": int,
    "episodes": int,
    "interrupted": bool,
    "steps": int,
    "mean_return_last_100": float | None,
    "seen?": {"episodes": int, "steps": int},
    "solved?": {"at": float, "episodes": int, "steps": int, "mean": float},
    "stopped?": str,
    "evaluation?": {
        "backend": Backend,
        "seed": int,
        "episodes": int,
        "mean": float,
        "minimum": float,
        "endings": dict.fromkeys(ENDINGS, int),
        "disturbances?": str,
    },
    "video?": str,
}
"""What `conclude` writes (see studies/finish_training.py)."""


def read_config(folder: Path) -> tuple[str, bool, TrainConfig]:
    """Return preset, whether there is a video, and config.

    Raises:
        RunError: It is not there or damaged.
    """

    def made(values: dict[str, Any]) -> tuple[str, bool, TrainConfig]:
        about = {name: values[name] for name in _ABOUT if name in values}
        others = {name: values[name] for name in values if name not in _ABOUT}
        checked(about, _ABOUT)
        return about["preset"], about["video"], read_values(others)

    otherwise = "is not the config of a run, or is damaged"
    return read_document(folder / CONFIG, None, made, otherwise)


def read_values(values: dict[str, Any]) -> TrainConfig:
    """Return the config of values that somebody else may have written.

    Raises:
        ValueError: They are none.
    """
    fields = config_class(str(values.get("method", DEFAULT_METHOD))).fields()
    added = {name: value for name, value in _ADDED.items() if name in fields}
    # JSON has no infinity; see `TrainConfig.stored`.
    endless = {
        name: math.inf for name in RULES if name[-5:] == "limit" and values.get(name) == "inf"
    }
    return TrainConfig(**checked(added | values | endless, fields))


def read_summary(folder: Path) -> dict[str, Any]:
    """A run's summary.

    Raises:
        RunError: It is not there or damaged.
    """
    return read_document(folder / SUMMARY, _SUMMARY_FIELDS, dict, "cannot be read")


def read_figures(folder: Path, config: TrainConfig) -> dict[str, Any]:
    """How well the policy of a complete run plays.

    Raises:
        RunError: The summary is damaged, or not that of a whole training with this config.
    """

    def made(summary: dict[str, Any]) -> dict[str, Any]:
        names = ["backend", "model", "seed"]
        # One that was told to stop at a greedy return may have fewer episodes.
        names += [] if config.until is not None and "stopped" in summary else ["episodes"]
        if other := [name for name in names if summary[name] != getattr(config, name)]:
            raise ValueError(f"{', '.join(other)} of another training than the config's")
        if summary["interrupted"] or "evaluation" not in summary:
            raise ValueError("the training is not over; start again with --overwrite")
        return dict(summary["evaluation"])

    otherwise = "is not the summary of a complete run"
    return read_document(folder / SUMMARY, _SUMMARY_FIELDS, made, otherwise)
