"""How commands find a policy, and where to play it."""

import sys
from collections.abc import Iterable
from pathlib import Path

from mjcartpole.commands.printing import counted
from mjcartpole.errors import RunError
from mjcartpole.learning import runs
from mjcartpole.learning.documents import read_summary
from mjcartpole.physics.simulation import silence_mujoco
from mjcartpole.studies import multi_seed_runs
from mjcartpole.studies.eval_target import EvalTarget
from mjcartpole.studies.policy_setup import PolicySetup, controller_setup, find_setup


def set_up(source: Path, target: EvalTarget) -> PolicySetup:
    """Find a policy, and where to play it; see `set_up_all`.

    Raises:
        MjCartPoleError: Something cannot be used.
    """
    return set_up_all([source], target)[0]


def set_up_all(sources: Iterable[Path], target: EvalTarget) -> list[PolicySetup]:
    """Find policies, and where to play each; see `find_setup`. MuJoCo's own warnings are silenced.

    What gymnasium's cart-pole leaves out of a training is told.

    Raises:
        MjCartPoleError: Something cannot be used.
    """
    silence_mujoco()
    setups = [find_setup(source, target) for source in sources]
    for ranges in dict.fromkeys(setup.left_out for setup in setups if setup.left_out):
        told = f"gymnasium's cart-pole does not vary: --vary {' '.join(ranges)} is left out"
        print(f"mjcartpole: {told}", file=sys.stderr)
    return setups


def set_up_controller(name: str, target: EvalTarget) -> PolicySetup:
    """Make a controller for where it is played; see `controller_setup`, and `set_up`.

    Raises:
        MjCartPoleError: Something cannot be used.
    """
    silence_mujoco()
    return controller_setup(name, target)


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
