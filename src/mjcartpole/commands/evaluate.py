"""What `evaluate` does and prints, and how a policy and its stage are found."""

import json
import sys
from dataclasses import dataclass
from pathlib import Path

from mjcartpole.envs.backend import Backend, check_backend
from mjcartpole.errors import ConfigError, RunError
from mjcartpole.files import is_file
from mjcartpole.integrator import Integrator
from mjcartpole.learning import runs
from mjcartpole.learning.documents import read_summary
from mjcartpole.learning.policy import Policy
from mjcartpole.physics.load import ModelLike, load_model
from mjcartpole.physics.simulation import silence_mujoco
from mjcartpole.studies import evaluation, multi_seed_runs
from mjcartpole.studies.evaluation import Evaluation, check_count, evaluate
from mjcartpole.studies.film import PolicySetup
from mjcartpole.studies.multi_seed import ManyResult, SeedResult
from mjcartpole.studies.statistics import CONFIDENCE
from mjcartpole.task import CARTPOLE_V1, task_named

RUNS = Path("runs")
VIDEOS = Path("videos")


@dataclass(frozen=True)
class EvalTarget:
    """Where to play a policy; None means: where it was trained."""

    backend: Backend | None = None
    model: str | None = None
    integrator: Integrator | None = None
    seed: int | None = None
    set: tuple[str, ...] = ()
    own_timestep: bool = False
    allow_assets: tuple[Path, ...] = ()
    task: str | None = None


def run_evaluate(source: Path, choice: EvalTarget, *, episodes: int, as_json: bool) -> int:
    """Play greedy episodes and print the figures; of many seeds, of each. Returns the exit code."""
    if multi_seed_runs.is_seeds(source):
        return _evaluate_seeds(source, choice, episodes, as_json)
    setup = set_up(source, choice)
    result = _evaluate(setup, episodes)
    if as_json:
        print(json.dumps({"policy": str(source), "model": _model_name(setup), **result.summary()}))
    else:
        print_evaluation(result, _chosen_model(setup, choice))
    return 0


def _evaluate_seeds(source: Path, choice: EvalTarget, episodes: int, as_json: bool) -> int:
    learned = learned_seeds(source)
    setups = {seed: set_up(run, choice) for seed, run in learned.items()}
    found = [SeedResult(seed, _evaluate(setup, episodes)) for seed, setup in setups.items()]
    first = next(iter(setups.values()))
    many = ManyResult(runs.load_run(next(iter(learned.values()))).config, tuple(found))
    aggregate = many.aggregate()
    if as_json:
        each = [
            {"train_seed": one.seed, **one.evaluation.summary()} for one in found if one.evaluation
        ]
        figures = aggregate.summary() if aggregate else None
        head = {"policy": str(source), "model": _model_name(first)}
        print(json.dumps({**head, "seeds": each, "greedy_return": figures}))
        return 0
    print(
        f"\ngreedy evaluation on {first.backend}{_chosen_model(first, choice)}: "
        f"{counted(len(found), 'seed')}, {counted(episodes, 'episode')} each, seed {first.seed}\n"
    )
    print_seeds(many)
    return 0


def learned_seeds(folder: Path) -> dict[int, Path]:
    """The runs of a folder of many seeds that have a policy; says on stderr which have none.

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
    """The run in the middle of many seeds by mean greedy return, the lower of two, and how many.

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


def _model_name(setup: PolicySetup) -> str:
    return setup.model if isinstance(setup.model, str) else setup.cartpole.name


def _chosen_model(setup: PolicySetup, choice: EvalTarget) -> str:
    """What a headline says of a model that is not the policy's own."""
    return f", {_model_name(setup)}" if choice.model or choice.set else ""


def set_up(source: Path, choice: EvalTarget) -> PolicySetup:
    """Find a policy, and where to play it: as it was trained, unless the user chose otherwise."""
    silence_mujoco()
    seed = evaluation.SEED if choice.seed is None else choice.seed
    check_count(1, seed)
    backend: Backend
    integrator: Integrator
    run: runs.Run | None = None
    if is_file(source):
        # Every run's own is called policy.json: its folder tells them apart.
        name = _run_name(source.parent) if source.name == runs.POLICY else source.stem
        policy = Policy.load(source)
        backend, integrator, model, own_timestep = "mujoco", "gym", "cartpole", False
        task = CARTPOLE_V1.name
        if choice.allow_assets:
            raise ConfigError("--allow-assets is for the model of a run; a policy's file has none")
    else:
        run = runs.load_run(source)
        name, policy = _run_name(run.folder), run.policy
        backend, integrator = run.config.backend, run.config.integrator
        model, own_timestep, task = str(run.model), run.config.own_timestep, run.config.task
    backend = choice.backend or backend
    if backend == "gym":
        # Gymnasium's cart-pole has neither; only what the user asks for is held against that.
        integrator, model, own_timestep = "gym", "cartpole", False
    model, integrator = choice.model or model, choice.integrator or integrator
    check_backend(backend, model, integrator, choice.set, own_timestep=choice.own_timestep)
    own_timestep = own_timestep or choice.own_timestep
    played_on: ModelLike = model
    if run is not None and model == str(run.model):
        played_on = run.cartpole(choice.allow_assets, own_timestep=own_timestep)
    if choice.set or (own_timestep and played_on == model):
        played_on = load_model(played_on, choice.set, own_timestep=own_timestep)
    rules = task_named(choice.task or task)
    return PolicySetup(name, policy, backend, played_on, integrator, seed, rules)


def _run_name(folder: Path) -> str:
    """A run's name; a seed's among many begins with theirs."""
    path = folder.resolve()
    return f"{path.parent.name}-{path.name}" if multi_seed_runs.is_seeds(path.parent) else path.name


def _evaluate(setup: PolicySetup, episodes: int) -> Evaluation:
    return evaluate(
        setup.policy,
        backend=setup.backend,
        model=setup.model,
        integrator=setup.integrator,
        task=setup.task,
        episodes=episodes,
        seed=setup.seed,
    )


def plain(value: float) -> str:
    """Return a return in words: whole where it is, with two digits elsewhere."""
    return f"{value:.0f}" if value.is_integer() else f"{value:.2f}"


def counted(count: int, what: str) -> str:
    """A number of things in words: 1 episode, 2 episodes."""
    return f"{count:,} {what}" if count == 1 else f"{count:,} {what}s"


def print_evaluation(result: Evaluation, where: str = "") -> None:
    """Print mean, minimum, and how the episodes ended.

    Args:
        result: What was played.
        where: What else is to be said of where.
    """
    print(
        f"\ngreedy evaluation on {result.backend}{where}: "
        f"{counted(len(result.episodes), 'episode')}, seed {result.seed}\n"
        f"  mean return {result.mean:.2f}, minimum {plain(result.minimum)}"
    )
    for ending, count in result.endings.items():
        print(f"  {ending:13s} {count:5d}")


def print_seeds(many: ManyResult) -> None:
    """A line per seed, and the statistics over them."""
    print("   seed   greedy mean   minimum")
    for found in many.seeds:
        if found.evaluation is not None:
            mean, minimum = found.evaluation.mean, found.evaluation.minimum
            print(f"{found.seed:7d} {mean:13.2f} {plain(minimum):>9s}")
        else:
            print(f"{found.seed:7d} {'failed' if found.error else 'stopped':>13s}")
    aggregate = many.aggregate()
    if aggregate is None:
        return
    low, high = aggregate.interval
    print(
        f"\nmean {aggregate.mean:.2f}, minimum {aggregate.minimum:.2f}\n"
        f"interquartile mean {aggregate.iqm:.2f} "
        f"({CONFIDENCE:.0%} interval {low:.2f} to {high:.2f})"
    )
    if aggregate.solved_at is not None:
        print(f"solved (at least {aggregate.solved_at:g}): {aggregate.solved:.0%}")
