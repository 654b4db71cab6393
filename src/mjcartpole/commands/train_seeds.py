"""Many seeds side by side, new or continued: trained, evaluated, and told of."""

import sys
from pathlib import Path

from mjcartpole.commands import progress
from mjcartpole.commands.printing import counted, print_seeds
from mjcartpole.commands.train_options import RunLocation, TrainOptions
from mjcartpole.commands.train_shared import about, changes, check, draw_curve, go_on, prepare
from mjcartpole.learning.config import TrainConfig
from mjcartpole.output import FAILED
from mjcartpole.signals import Interrupted, StopSignals
from mjcartpole.studies import multi_seed_runs
from mjcartpole.studies.multi_seed import SeedJob, SeedRunner, chosen_for
from mjcartpole.studies.multi_seed_runs import ManyBegun
from mjcartpole.studies.seeds import ManyResult, check_seeds


def train(config: TrainConfig, how: TrainOptions, where: RunLocation, seeds: int) -> int:
    """Train many seeds, and print statistics over them. Returns the exit code.

    Raises:
        Interrupted: After Ctrl-C, SIGTERM or SIGHUP, when what was learned is kept; says where.
    """
    cartpole = prepare(config, how)
    folder = where.folder(config, seeds)
    begun = ManyBegun(where.preset, config, check_seeds(config, seeds), cartpole)
    runner, signals = _runner(begun, folder, how), StopSignals()
    with signals.caught(), multi_seed_runs.claimed_seeds(folder, overwrite=where.overwrite):
        multi_seed_runs.begin_seeds(folder, config, runner.seeds, cartpole, preset=where.preset)
        _print_head(runner, begun, about(where, folder, config, seeds))
        return _finish(runner, folder, signals, how)


def resume(folder: Path, how: TrainOptions) -> int:
    """Continue many seeds as if they had not been interrupted. Returns the exit code.

    Raises:
        Interrupted: Again; see `train`.
    """
    check(how)
    signals = StopSignals()
    with signals.caught(), multi_seed_runs.resumed_seeds(folder, how.allow_assets) as begun:
        runner = _runner(begun, folder, how)
        _print_head(runner, begun, changes(begun.preset, begun.config))
        return _finish(runner, folder, signals, how)


def _runner(begun: ManyBegun, folder: Path, how: TrainOptions) -> SeedRunner:
    job = SeedJob(
        begun.config,
        *chosen_for(begun.config, begun.cartpole, how.engine),
        folder,
        begun.preset,
        how.checkpoint_every,
        how.tensorboard,
        how.allow_assets,
    )
    return SeedRunner(job, begun.seeds, how.workers)


def _print_head(runner: SeedRunner, begun: ManyBegun, more: str) -> None:
    print(
        f"{begun.preset} on {begun.config.backend}: {counted(len(runner.seeds), 'seed')} from "
        f"{runner.seeds[0]}, {counted(begun.config.episodes, begun.config.episode)} each, "
        f"{runner.workers} at once{more}\n",
        flush=True,
    )


def _finish(runner: SeedRunner, folder: Path, signals: StopSignals, how: TrainOptions) -> int:
    """Train all seeds or to a signal; write and print."""
    with signals.deferred():
        progress.train_seeds(runner, signals)
    many = runner.result()
    multi_seed_runs.write_seeds(folder, many)
    print_seeds(many)
    _print_solving(many)
    print(f"\nruns   {folder}", flush=True)
    if signals.stop():
        raise Interrupted(
            f"interrupted with {len(many.scores)} of {len(runner.seeds)} seeds done; what was "
            f"learned is kept in {folder}; go on with: {go_on(folder)}",
            signals.number,
        )
    if many.scores:
        draw_curve(folder, how)
    for found in many.failed:
        print(f"mjcartpole: error: seed {found.seed} failed: {found.error}", file=sys.stderr)
    return FAILED if many.failed else 0


def _print_solving(many: ManyResult) -> None:
    """Print how soon the seeds were solved, where their trainings were evaluated."""
    if (its := many.solving()) is None:
        return
    median, p95 = ("never" if n is None else f"{n:,}" for n in (its.median, its.p95))
    print(
        f"{many.config.episode}s until the mean greedy return was at least {its.at:g}: "
        f"median {median}, 95 % of seeds {p95} ({its.solved} of {its.seeds} reached it)"
    )
