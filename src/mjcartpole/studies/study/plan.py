"""The plan of a study: every training that it needs, each with a key that is the same anywhere."""

import dataclasses
import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Final, Self

from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.envs.backend import check_backend
from mjcartpole.errors import ConfigError, ModelError
from mjcartpole.learning.checkpoints import checksum
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.engine import Engine
from mjcartpole.learning.run_model import check_storable
from mjcartpole.learning.training_grid import training_grid
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.studies.multi_seed import SeedJob, chosen_for
from mjcartpole.studies.study.design import Point, points_of
from mjcartpole.studies.study.measures import is_disturbed, plays_after, with_evaluations
from mjcartpole.studies.study.settings import PRESET, as_text, config_of, is_edit
from mjcartpole.studies.study.study_file import Study, raise_all

MOST_RUNS: Final = 1_000_000
_KEY_DIGITS: Final = 16
"""Of a million runs, two have the same key with a chance of 3e-8."""


@dataclass(frozen=True)
class PlannedRun:
    """One training of a study.

    Attributes:
        key: A hash of config and model.
        point: Number of its point, from 1 on.
        factors: The point.
        job: What is to be trained.
        cartpole: Its model.
        tested: Under which disturbances it is played besides, if any.
    """

    key: str
    point: int
    factors: Point
    job: SeedJob
    cartpole: CartPole = field(repr=False)
    tested: Disturbances | None = None


@dataclass(frozen=True, eq=False)
class Plan:
    """All that a study needs.

    Attributes:
        study: What is asked.
        points: How many there are.
        runs: Point by point, in each seed by seed.
    """

    study: Study
    points: int
    runs: tuple[PlannedRun, ...]


def plan(study: Study, engine: Engine = "compiled") -> Plan:
    """Return every training that a study needs; all models are loaded and checked.

    Raises:
        ConfigError: A point makes no sense, or there are too many; a line for each mistake.
    """
    points = points_of(study.factors, study.design, study.samples, study.design_seed)
    if len(points) * len(study.seeds) > MOST_RUNS:
        raise ConfigError(
            f"{len(points):,} points with {len(study.seeds):,} seeds each are more than "
            f"{MOST_RUNS:,} runs; give fewer"
        )
    mistakes, runs, models = dict[str, list[Point]](), list[PlannedRun](), dict[Any, _Model]()
    for number, point in enumerate(points, start=1):
        try:
            runs += _runs(study, point, number, engine, models)
        except (ConfigError, ModelError) as error:
            mistakes.setdefault(str(error), []).append(point)
    raise_all([_told(error, where) for error, where in mistakes.items()])
    raise_all(list(_in_vain(study, runs)))
    return Plan(study, len(points), tuple(runs))


def in_words(point: Point) -> str:
    """Return a point as a person reads it.

    >>> in_words({"alpha": 0.1, "bins": (1, 3)})
    'alpha=0.1 bins=1,3'
    """
    return " ".join(f"{name}={as_text(value)}" for name, value in point.items())


def _told(error: str, points: list[Point]) -> str:
    more = len(points) - 1
    others = f" (and {more:,} more point{'s' if more > 1 else ''})" if more else ""
    return f"{in_words(points[0])}{others}: {error}"


@dataclass(frozen=True)
class _Model:
    """A model, and a digest of all that it was compiled from."""

    cartpole: CartPole
    digest: str

    @classmethod
    def of(cls, config: TrainConfig) -> Self:
        cartpole = config.load_model()
        check_storable(cartpole)
        # Files are named by what is in them there.
        return cls(cartpole, checksum(cartpole.stored[0]))


def _runs(
    study: Study, point: Point, number: int, engine: Engine, models: dict[Any, _Model]
) -> Iterator[PlannedRun]:
    """Yield the runs of a point, seed by seed."""
    config = config_of(study.base, point, study.seeds[0])
    config = dataclasses.replace(config, **with_evaluations(config, study.measure))
    if config.evaluation_period is not None and config.solved_at is None:
        raise ConfigError(f"nobody agreed what solves {config.task}; give until in [base]")
    where = config.model, config.set, config.own_timestep
    if where not in models:
        models[where] = _Model.of(config)
    cartpole, digest = models[where].cartpole, models[where].digest
    training_grid(config, cartpole)
    by, evaluated = chosen_for(config, cartpole, engine), plays_after(study.measure)
    job = SeedJob(config, *by, evaluated=evaluated)
    tested = study.robustness if is_disturbed(study.measure) else None
    if tested:
        check_backend(config.backend, config.model, config.integrator, tested.vary)
    for seed in study.seeds:
        one = job.of(seed)
        key = _key(one.config, digest if job.document else "", tested)
        yield PlannedRun(key, number, point, one, cartpole, tested)


def _key(config: TrainConfig, digest: str, tested: Disturbances | None) -> str:
    """Return a hash of all that decides figures, whatever the model is called here."""
    values = config.stored() | ({"model": digest, "set": ()} if digest else {})
    text = json.dumps(values | ({"tested": tested.given} if tested else {}), sort_keys=True)
    return checksum(text)[:_KEY_DIGITS]


def _in_vain(study: Study, runs: list[PlannedRun]) -> Iterator[str]:
    """Yield the settings of all that no training has."""
    had = set[str]().union(*({*run.job.config.fields()} for run in runs))
    methods = ", ".join(dict.fromkeys(run.job.config.method for run in runs))
    for name in study.base:
        if name != PRESET and not is_edit(name) and name not in had:
            yield f"[base] {name}: no method of this study has it ({methods})"
