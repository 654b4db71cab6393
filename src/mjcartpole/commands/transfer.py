"""`mjcartpole transfer`."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mjcartpole.commands.options import Command, OutputPath, Policies
from mjcartpole.disturbances.changes import DisturbanceChanges
from mjcartpole.disturbances.disturbances import NONE
from mjcartpole.errors import ConfigError
from mjcartpole.integrator import Integrator
from mjcartpole.learning.evaluation import EPISODES, SEED, Player
from mjcartpole.rule_changes import RuleChanges
from mjcartpole.studies.eval_target import EvalTarget
from mjcartpole.task import CARTPOLE_V1

if TYPE_CHECKING:
    from mjcartpole.physics.load import ModelLike
    from mjcartpole.studies.policy_setup import PolicySetup
    from mjcartpole.task import Task

PolicyGroups = Mapping[str, Sequence[Player]]


@dataclass(frozen=True)
class Transfer(RuleChanges, DisturbanceChanges, Command):
    """Play policies on models they were not trained on; or see how far a number can move."""

    sources: Policies = ()
    """Run folders or policy files; many --seeds in one folder count as one."""
    policy: tuple[str, ...] = ()
    """Controllers, made for the reference model: lqr, energy, random, constant."""
    models: tuple[str, ...] = ()
    """Names or files of models, and gym for gymnasium's own; all there are if left out."""
    set: tuple[str, ...] = ()
    """Edits of every model, such as pole.length=1.5 or joint:hinge.damping=0.1; gym has none."""
    sweep: str | None = None
    """An edit over a range, such as pole.length=0.5:3:0.25, on one model; or a disturbance, such as
    delay=0:10:1, noise=0:0.1:0.01 or push@2s=0:5:0.5."""
    integrator: Integrator = "gym"
    """gym: explicit Euler, as CartPole-v1; mujoco: the integrator that the model's file names."""
    own_timestep: bool = False
    """Let a control step be one physics step of a model's file, instead of 0.02 s."""
    episodes: int = EPISODES
    """Greedy episodes of each policy on each model."""
    seed: int = SEED
    """Seeds the starting states."""
    workers: int | None = None
    """How many evaluations at once; as many as there are cores if left out."""
    allow_assets: tuple[Path, ...] = ()
    """Folders in which the meshes and textures of a run's model may lie, besides the run's own."""
    output: OutputPath = None
    """Folder for the table, the JSON and the picture; in transfer/, they get a number where such
    are there already."""
    overwrite: bool = False
    """Replace what is there."""

    def run(self) -> int:
        """Play, print and write; all is checked before anything is played."""
        from mjcartpole.physics.simulation import silence_mujoco

        silence_mujoco()
        policies = self._find_policies()
        return self._play_matrix(policies) if self.sweep is None else self._play_sweep(policies)

    def _play_matrix(self, policies: PolicyGroups) -> int:
        from mjcartpole.commands import tables
        from mjcartpole.studies.plots import heat_map
        from mjcartpole.studies.transfer import GYM, find_place, transfer

        fitting = [name for name in _fitting(policies) if name != GYM or not self.vary]
        chosen = dict.fromkeys(self.models or fitting)
        others = self.set or self.own_timestep or self.vary or self.integrator != "gym"
        if set(chosen) == {GYM} and others:
            raise ConfigError(
                "gym is gymnasium's own cart-pole: --set, --own-timestep, --integrator and --vary "
                "change nothing there"
            )
        physics = {**self._physics, "disturbances": self.added_to(NONE)}
        places = [find_place(model, self.set, **physics) for model in chosen]
        target = tables.free_table(self.output, "transfer", self.overwrite)
        matrix = transfer(policies, places, **self._play)
        tables.print_matrix(matrix)
        _say_seeds(policies)
        rows = [cell.summary() for cell in matrix.cells]
        tables.write_tables(target, rows, matrix.summary(), lambda: heat_map(matrix))
        return tables.tell_failed(matrix)

    def _play_sweep(self, policies: PolicyGroups) -> int:
        from mjcartpole.commands import tables
        from mjcartpole.studies.plots import curves
        from mjcartpole.studies.sweep import parse_sweep, sweep

        key, values = parse_sweep(self.sweep or "")
        if len(self.models) > 1:
            raise ConfigError(
                f"a sweep edits one model, not {len(self.models)}; give one, or no --sweep"
            )
        name = "sweep-" + re.sub(r"[^\w.-]+", "-", key)
        target = tables.free_table(self.output, name, self.overwrite)
        settings = {"edits": self.set, **self._physics, **self._play}
        curve = sweep(policies, self._edited_model(), key, values, **settings)
        tables.print_sweep(curve)
        _say_seeds(policies)
        summary = curve.summary()
        tables.write_tables(target, summary["points"], summary, lambda: curves(curve))
        return tables.tell_failed(curve.played)

    def _edited_model(self) -> "ModelLike":
        """Return the model of a sweep: the one asked for, the first policy's, or the reference."""
        if self.models:
            return self.models[0]
        return self._set_up(self.sources[0]).model if self.sources else "cartpole"

    @property
    def _physics(self) -> dict[str, Any]:
        return {"integrator": self.integrator, "own_timestep": self.own_timestep}

    @property
    def _play(self) -> dict[str, Any]:
        settings = {"episodes": self.episodes, "seed": self.seed, "workers": self.workers}
        return {"task": self._task(), "disturbances": self.added_to(NONE), **settings}

    def _task(self) -> "Task":
        """Return by whose rules is played: those asked for, or all that the policies know."""
        known = dict.fromkeys(self._set_up(source).task for source in self.sources)
        known = known or {self.applied_to(CARTPOLE_V1): None}
        if len(known) > 1:
            names = " and ".join(task.summary for task in known)
            raise ConfigError(
                f"the policies were trained by the rules of {names}; say by --task, "
                "--max-episode-steps and the like which are played, so that their returns can be "
                "compared"
            )
        return next(iter(known))

    def _set_up(self, source: Path) -> "PolicySetup":
        """Return where a policy was trained; of many seeds the first."""
        from mjcartpole.commands.policies import set_up
        from mjcartpole.studies.multi_seed_runs import is_seeds, learned_seeds

        if is_seeds(source):
            source = next(iter(learned_seeds(source)[0].values()))
        return set_up(
            source, EvalTarget(allow_assets=self.allow_assets, task=self.task, **self.changes)
        )

    def _find_policies(self) -> PolicyGroups:
        """Return policies by name, of many seeds all under one; those of one name by paths."""
        from mjcartpole.studies.policy_setup import controller_setup

        if not (self.sources or self.policy):
            raise ConfigError("transfer needs a RUN-OR-POLICY, or several, or --policy")
        controllers = {name: (controller_setup(name).policy,) for name in self.policy}
        found = {source: self._members(source) for source in self.sources}
        count = Counter(name for name, _ in found.values())
        return controllers | {
            name if count[name] == 1 else str(source): policies
            for source, (name, policies) in found.items()
        }

    def _members(self, source: Path) -> tuple[str, tuple[Player, ...]]:
        from mjcartpole.commands.policies import learned_seeds
        from mjcartpole.learning.runs import load_run
        from mjcartpole.studies.multi_seed_runs import is_seeds

        if is_seeds(source):
            learned = learned_seeds(source).values()
            return source.resolve().name, tuple(load_run(run).policy for run in learned)
        setup = self._set_up(source)
        return setup.name, (setup.table,)


def _fitting(policies: PolicyGroups) -> list[str]:
    """Return all models that there are, and gym, but for those that no policy is for."""
    from mjcartpole.physics.load import model_names
    from mjcartpole.studies.transfer import GYM, find_place

    poles = {policy.poles for group in policies.values() for policy in group}
    return [name for name in (GYM, *model_names()) if poles & {find_place(name).poles, None}]


def _say_seeds(policies: PolicyGroups) -> None:
    for name, group in policies.items():
        if len(group) > 1:
            print(f"{name}: the mean over {len(group)} seeds, and its interval over seeds")
