"""A run's config and summary, read back as if somebody else had written them."""

from pathlib import Path
from typing import Any, Final

from mjcartpole.envs.backend import Backend
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.episodes import ENDINGS
from mjcartpole.learning.stored import Fields, read_document

CONFIG, SUMMARY = "config.json", "summary.json"

_CONFIG_FIELDS: Final[Fields] = {"preset": str, "video": bool, **TrainConfig.fields()}
_SUMMARY_FIELDS: Final[Fields] = {
    "preset": str,
    "backend": Backend,
    "model": str,
    "seed": int,
    "episodes": int,
    "interrupted": bool,
    "steps": int,
    "mean_return_last_100": float | None,
    "evaluation?": {
        "backend": Backend,
        "seed": int,
        "episodes": int,
        "mean": float,
        "minimum": float,
        "endings": dict.fromkeys(ENDINGS, int),
    },
    "video?": str,
}
"""What `conclude` writes (see studies/finish_training.py)."""


def read_config(folder: Path) -> tuple[str, bool, TrainConfig]:
    """Preset, whether there is a video, and config.

    Raises:
        RunError: It is not there or damaged.
    """

    def made(values: dict[str, Any]) -> tuple[str, bool, TrainConfig]:
        return values.pop("preset"), values.pop("video"), TrainConfig(**values)

    otherwise = "is not the config of a run, or is damaged"
    return read_document(folder / CONFIG, _CONFIG_FIELDS, made, otherwise)


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
        names = ("backend", "model", "seed", "episodes")
        if other := [name for name in names if summary[name] != getattr(config, name)]:
            raise ValueError(f"{', '.join(other)} of another training than the config's")
        if summary["interrupted"] or "evaluation" not in summary:
            raise ValueError("the training is not over; start again with --overwrite")
        return dict(summary["evaluation"])

    otherwise = "is not the summary of a complete run"
    return read_document(folder / SUMMARY, _SUMMARY_FIELDS, made, otherwise)
