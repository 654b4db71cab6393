"""How commands find a policy, and where to play it."""

import sys
from pathlib import Path

from mjcartpole.commands.options import EvalTarget
from mjcartpole.commands.printing import counted
from mjcartpole.envs.backend import check_backend
from mjcartpole.errors import ConfigError, RunError
from mjcartpole.files import is_file
from mjcartpole.learning import evaluation, runs
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.documents import read_summary
from mjcartpole.learning.policy import Policy
from mjcartpole.physics.load import ModelLike, load_model
from mjcartpole.physics.simulation import silence_mujoco
from mjcartpole.studies import multi_seed_runs
from mjcartpole.studies.film import PolicySetup
from mjcartpole.task import task_named


def set_up(source: Path, target: EvalTarget) -> PolicySetup:
    """Find a policy, and where to play it: as it was trained, unless the target says otherwise.

    Raises:
        MjCartPoleError: Something cannot be used.
    """
    silence_mujoco()
    seed = evaluation.SEED if target.seed is None else target.seed
    evaluation.check_count(1, seed)
    name, policy, config, run = _read(source, target)
    backend = target.backend or config.backend
    own_model = str(run.model) if run else config.model
    if backend == "gym":
        # Gymnasium's cart-pole has neither; only what the user asks for is held against that.
        own_model = "cartpole"
        config = TrainConfig(
            backend="gym", task=config.task, max_episode_steps=config.max_episode_steps
        )
    model, integrator = target.model or own_model, target.integrator or config.integrator
    check_backend(backend, model, integrator, target.set, own_timestep=target.own_timestep)
    own_timestep = config.own_timestep or target.own_timestep
    played_on: ModelLike = model
    if run is not None and model == str(run.model):
        played_on = run.cartpole(target.allow_assets, own_timestep=own_timestep)
    if target.set or (own_timestep and played_on == model):
        played_on = load_model(played_on, target.set, own_timestep=own_timestep)
    rules = task_named(target.task) if target.task else config.rules
    rules = rules.with_time_limit(target.max_episode_steps)
    return PolicySetup(name, policy, backend, played_on, integrator, seed, rules)


def _read(source: Path, target: EvalTarget) -> tuple[str, Policy, TrainConfig, runs.Run | None]:
    """Return a policy, its name, how it was trained, as far as that is known, and its run."""
    if not is_file(source):
        run = runs.load_run(source)
        return _run_name(run.folder), run.policy, run.config, run
    # Every run's own is called policy.json: its folder tells them apart.
    name = _run_name(source.parent) if source.name == runs.POLICY else source.stem
    policy = Policy.load(source)
    if target.allow_assets:
        raise ConfigError("--allow-assets is for the model of a run; a policy's file has none")
    return name, policy, TrainConfig(), None


def _run_name(folder: Path) -> str:
    """Return a run's name; a seed's among many begins with theirs."""
    path = folder.resolve()
    return f"{path.parent.name}-{path.name}" if multi_seed_runs.is_seeds(path.parent) else path.name


def learned_seeds(folder: Path) -> dict[int, Path]:
    """Return the runs of many seeds that have a policy; say on stderr which have none.

    Raises:
        RunError: None has one, or the folder is damaged.
    """
    learned, without = multi_seed_runs.learned_seeds(folder)
    if without:
        count, all_seeds = len(without), len(without) + len(learned)
        which = f"{count} of {all_seeds} seeds in {folder} without a policy"
        print(f"mjcartpole: {which}, such as seed {without[0]}: left out", file=sys.stderr)
    return learned


def median_seed(folder: Path) -> tuple[Path, int]:
    """Return the run in the middle of many seeds, the lower of two, by mean return, and how many.

    Raises:
        RunError: None is complete, or the folder is damaged.
    """
    complete = [run for run in learned_seeds(folder).values() if runs.is_complete(run)]
    if not complete:
        raise RunError(
            f"no seed in '{folder}' is complete; go on with `mjcartpole train --resume {folder}`"
        )
    means = {run: float(read_summary(run)["evaluation"]["mean"]) for run in complete}
    ranked = sorted(complete, key=means.__getitem__)
    return ranked[(len(ranked) - 1) // 2], len(ranked)


def shown(source: Path) -> Path:
    """Return what is shown of a source: of many seeds, the one in the middle, which is told."""
    if not multi_seed_runs.is_seeds(source):
        return source
    folder, count = median_seed(source)
    print(f"{folder}  (the median of {counted(count, 'seed')} by mean greedy return)", flush=True)
    return folder
