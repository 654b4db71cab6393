"""What several commands print: counts in words, evaluations, tables of seeds."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mjcartpole.disturbances.disturbances import Disturbances
    from mjcartpole.learning.evaluation import Evaluation
    from mjcartpole.studies.seeds import ManyResult


def plain(value: float) -> str:
    """Return a return in words: whole where it is, with two digits elsewhere."""
    return f"{value:.0f}" if value.is_integer() else f"{value:.2f}"


def counted(count: int, what: str) -> str:
    """Return a number of things in words: 1 episode, 2 episodes."""
    return f"{count:,} {what}" if count == 1 else f"{count:,} {what}s"


def with_added(disturbances: "Disturbances") -> str:
    """Return what a headline says of disturbances; nothing where there are none."""
    from mjcartpole.learning.naming import added_flags

    flags = added_flags(disturbances)
    return f", with {flags}" if flags else ""


def print_evaluation(result: "Evaluation", where: str = "") -> None:
    """Print mean, minimum, how the episodes ended, and what else is to be said of where."""
    print(
        f"\ngreedy evaluation on {result.backend}{where}{with_added(result.disturbances)}: "
        f"{counted(len(result.episodes), 'episode')}, seed {result.seed}\n"
        f"  mean return {result.mean:.2f}, minimum {plain(result.minimum)}"
    )
    for ending, count in result.endings.items():
        print(f"  {ending:13s} {count:5d}")


def print_seeds(many: "ManyResult") -> None:
    """Print a line per seed, and the statistics over them."""
    from mjcartpole.studies.statistics import CONFIDENCE

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
