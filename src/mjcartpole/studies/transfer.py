"""How far does a policy carry? Every policy on every model, from the same starting states."""

import concurrent.futures
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from mjcartpole.cores import worker_count
from mjcartpole.disturbances.disturbances import NONE, Disturbances
from mjcartpole.envs.backend import Backend, World
from mjcartpole.errors import ConfigError, MjCartPoleError
from mjcartpole.integrator import Integrator
from mjcartpole.learning.evaluation import (
    EPISODES,
    SEED,
    Evaluation,
    Player,
    check_count,
    evaluate_in,
)
from mjcartpole.learning.naming import added_flags
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.edit.edits import edits_of
from mjcartpole.physics.load import Edits, ModelLike, load_model
from mjcartpole.physics.variants import contexts_of, effects_on
from mjcartpole.studies.statistics import Interval, bootstrap_interval
from mjcartpole.task import CARTPOLE_V1, Task, resolve

GYM: Final = "gym"
"""The place that is gymnasium's own CartPole-v1, instead of a model."""


@dataclass(frozen=True)
class Place:
    """Where policies are played.

    Attributes:
        name: What a person calls it.
        cartpole: What moves; None for gymnasium's CartPole-v1.
        integrator: See `Simulation`.
        disturbances: What is added.
    """

    name: str
    cartpole: CartPole | None
    integrator: Integrator = "gym"
    disturbances: Disturbances = NONE

    @property
    def backend(self) -> Backend:
        """Who does the physics."""
        return "gym" if self.cartpole is None else "mujoco"

    @property
    def poles(self) -> int:
        """How many there are."""
        return 1 if self.cartpole is None else self.cartpole.poles

    def world(self, task: Task) -> World:
        """Return the same as what plays there by a task's rules takes it."""
        model = self.cartpole or "cartpole"
        return World(self.backend, model, self.integrator, task, self.disturbances)

    def check_disturbances(self, task: Task) -> None:
        """Refuse disturbances that make no sense here by these rules (ConfigError)."""
        effects_on(self.cartpole, self.disturbances, task)
        if self.cartpole and self.disturbances.vary:
            contexts_of(self.cartpole, self.disturbances)


@dataclass(frozen=True, eq=False)
class Cell:
    """One policy at one place, or the policies of several seeds.

    Attributes:
        policy: The policy's name.
        place: The place's name.
        evaluation: The episodes, seed by seed; None if they could not be played.
        interval: 95 % bootstrap interval of the mean return: over episodes with one policy, else
            over the seeds' means.
        error: Why they could not be played; empty if they could.
    """

    policy: str
    place: str
    evaluation: Evaluation | None = None
    interval: Interval | None = None
    error: str = ""

    @property
    def mean(self) -> float:
        """Mean return; NaN if the episodes could not be played."""
        return float("nan") if self.evaluation is None else self.evaluation.mean

    def summary(self) -> dict[str, Any]:
        """The figures as plain values, for JSON and CSV; None where there are none."""
        evaluation, interval = self.evaluation, self.interval
        known = evaluation is not None and interval is not None
        return {
            "policy": self.policy,
            "model": self.place,
            "mean": self.mean if known else None,
            "low": interval.low if interval else None,
            "high": interval.high if interval else None,
            "minimum": evaluation.minimum if evaluation else None,
            "episodes": len(evaluation.episodes) if evaluation else 0,
            **(evaluation.endings if evaluation else {}),
            "error": self.error,
        }


@dataclass(frozen=True, eq=False, repr=False)
class TransferResult:
    """Every policy on every model.

    Attributes:
        policies: Names, one per row.
        places: Names, one per column.
        cells: Row by row.
        seed: Of the starting states, which are the same in every cell.
        task: By whose rules they were played.
        disturbances: What was added everywhere; gymnasium's own model does not vary.
    """

    policies: tuple[str, ...]
    places: tuple[str, ...]
    cells: tuple[Cell, ...]
    seed: int
    task: Task = CARTPOLE_V1
    disturbances: Disturbances = NONE

    def __repr__(self) -> str:
        counts = f"policies: {len(self.policies)}, models: {len(self.places)}"
        return f"TransferResult({counts}, seed {self.seed})"

    @property
    def rows(self) -> list[tuple[Cell, ...]]:
        """The cells of each policy."""
        width = len(self.places)
        return [self.cells[start : start + width] for start in range(0, len(self.cells), width)]

    @property
    def means(self) -> npt.NDArray[np.float64]:
        """Mean returns, shape (policies, places); NaN where there is none."""
        return np.array([[cell.mean for cell in row] for row in self.rows])

    @property
    def failed(self) -> list[Cell]:
        """The cells whose episodes could not be played."""
        return [cell for cell in self.cells if cell.error]

    @property
    def common(self) -> dict[str, Any]:
        """What all cells have in common, as plain values."""
        added = added_flags(self.disturbances)
        return {"seed": self.seed, **({"disturbances": added} if added else {})}

    def summary(self) -> dict[str, Any]:
        """Everything as plain values, for JSON."""
        return {
            "policies": list(self.policies),
            "models": list(self.places),
            **self.common,
            "cells": [cell.summary() for cell in self.cells],
        }


def find_place(
    model: ModelLike,
    edits: Edits = None,
    integrator: Integrator = "gym",
    *,
    own_timestep: bool = False,
    disturbances: Disturbances = NONE,
) -> Place:
    """A model as a place, with some things in it changed; `"gym"` is gymnasium's CartPole-v1.

    For the model and its changes see `load_model`, for the integrator `Simulation`: gymnasium's
    keeps its own, takes no edits, and does not vary.

    Raises:
        ModelError: The model cannot be used; the message names it.
        ConfigError: An edit names nothing that is there, or a value is outside physics.
    """
    if model == GYM:
        if disturbances.vary:
            raise ConfigError(
                "gymnasium's CartPole-v1 does not vary; leave out gym among the models, or vary"
            )
        return Place(GYM, None, disturbances=disturbances)
    disturbances.check_apart(edits_of(edits or ()))
    cartpole = load_model(model, edits, own_timestep=own_timestep)
    return Place(cartpole.name, cartpole, integrator, disturbances)


def transfer(
    policies: Mapping[str, Player | Sequence[Player]],
    places: Sequence[Place | ModelLike],
    *,
    task: Task | str = CARTPOLE_V1,
    disturbances: Disturbances = NONE,
    episodes: int = EPISODES,
    seed: int = SEED,
    workers: int | None = None,
) -> TransferResult:
    """Play every policy at every place.

    All cells see the same starting states, so that their differences are those of policies and
    models. The same seed gives the same result, whatever the number of workers: as many cells at
    once as there are cores if left out.

    Several policies under one name are one learner's, from several seeds. A place may be what
    `find_place` takes, and then has the disturbances.

    Raises:
        ConfigError: There is no policy or place, a number or a disturbance makes no sense, or a
            policy is one for another number of poles.
        ModelError: A model cannot be used; nothing has been played then.
    """
    check_count(episodes, seed)
    if not policies or not places:
        raise ConfigError("a transfer needs one policy and one model at least")
    found = [
        place if isinstance(place, Place) else find_place(place, disturbances=disturbances)
        for place in places
    ]
    groups = {
        name: tuple(group) if isinstance(group, Sequence) else (group,)
        for name, group in policies.items()
    }
    pairs = [(name, place) for name in groups for place in found]
    for name, place in pairs:
        for policy in groups[name]:
            policy.check_fits(place.poles, place.name)
    rules, count = resolve(task), worker_count(workers, len(pairs))
    for place in found:
        place.check_disturbances(rules)
    jobs = [(name, groups[name], place, rules, episodes, seed) for name, place in pairs]
    names = tuple(place.name for place in found)
    return TransferResult(tuple(policies), names, _at_once(jobs, count), seed, rules, disturbances)


def _at_once(jobs: Sequence[Any], count: int) -> tuple[Cell, ...]:
    """Return what `_play` makes of its arguments, so many at once."""
    # Threads: the compiled engine leaves Python's lock alone.
    with concurrent.futures.ThreadPoolExecutor(count) as pool:
        futures = [pool.submit(_play, *job) for job in jobs]
        try:
            return tuple(future.result() for future in futures)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _play(
    name: str, policies: Sequence[Player], place: Place, rules: Task, episodes: int, seed: int
) -> Cell:
    try:
        played = [evaluate_in(place.world(rules), policy, episodes, seed) for policy in policies]
    except MjCartPoleError as error:
        # One model that diverges is no reason to lose the others.
        return Cell(name, place.name, error=str(error))
    episodes_of_all = tuple(episode for one in played for episode in one.episodes)
    evaluation = Evaluation(place.backend, seed, episodes_of_all, played[0].disturbances)
    means = np.array([one.mean for one in played])
    return Cell(
        name,
        place.name,
        evaluation,
        _interval(evaluation.returns if len(played) == 1 else means, seed),
    )


def _interval(returns: npt.NDArray[np.float64], seed: int) -> Interval:
    if (returns == returns[0]).all():
        return Interval(float(returns[0]), float(returns[0]))
    return bootstrap_interval(returns, np.mean, seed=seed)
