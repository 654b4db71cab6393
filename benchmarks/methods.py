"""How do the methods compare? The table and the figure of docs/methods.md come from here.

    python benchmarks/methods.py --seeds 20 --backends mujoco gym --plot docs/images/methods.png

Each method learns with its own defaults on the grid of `tuned`, one training per seed, then its
greedy policy plays 100 episodes from fresh starting states. The figure has the running mean of the
returns while learning, on the first backend, and its 95 % bootstrap interval over the seeds.
"""

import argparse
from pathlib import Path

import numpy as np
import numpy.typing as npt

from mjcartpole.cores import available_cores
from mjcartpole.envs.backend import Backend
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.methods import METHODS
from mjcartpole.media.plots import plot_style, write_plot
from mjcartpole.studies.multi_seed import train_many
from mjcartpole.studies.seeds import ManyResult

WINDOW = 25
"""Episodes of the running mean."""

RESAMPLES = 1_000

LEARNERS = [
    name
    for name, method in METHODS.items()
    if not (hasattr(method, "plan") or hasattr(method, "imagine"))
]
"""Those that learn from episodes of the world."""


def measure(method: str, backend: Backend, options: argparse.Namespace) -> ManyResult:
    """Train and evaluate all seeds of a method."""
    config = TrainConfig(method=method, backend=backend, seed=options.first_seed)
    return train_many(config, options.seeds, workers=options.workers)


def print_row(method: str, backend: str, many: ManyResult) -> None:
    """One line of the table."""
    scores = np.array(many.scores)
    results = [found.result for found in many.seeds if found.result is not None]
    nanoseconds = np.median([1e9 * result.seconds / result.steps for result in results])
    print(
        f"{method:22s} {backend:7s} {scores.mean():7.1f} {scores.min():7.1f} "
        f"{(scores >= 475).sum():4d} of {len(scores)} "
        f"{np.median([result.steps for result in results]):10,.0f} {nanoseconds:8.0f}",
        flush=True,
    )


def running_means(many: ManyResult) -> npt.NDArray[np.float64]:
    """Return the running mean of each seed's returns, shape (seeds, episodes - WINDOW + 1)."""
    returns = np.array([found.result.returns for found in many.seeds if found.result is not None])
    sums = np.cumsum(np.pad(returns, ((0, 0), (1, 0))), axis=1)
    means: npt.NDArray[np.float64] = (sums[:, WINDOW:] - sums[:, :-WINDOW]) / WINDOW
    return means


@plot_style()
def plot(curves: dict[str, npt.NDArray[np.float64]], path: Path, title: str) -> None:
    """Draw all methods on one pair of axes."""
    from matplotlib.figure import Figure  # noqa: PLC0415 - an optional package

    figure = Figure(figsize=(8.6, 5.4), layout="constrained")
    axes = figure.add_subplot()
    rng = np.random.default_rng(0)
    for number, (name, means) in enumerate(curves.items()):
        seeds, points = means.shape
        drawn = means[rng.integers(0, seeds, (RESAMPLES, seeds))].mean(axis=1)
        low, high = np.percentile(drawn, [2.5, 97.5], axis=0)
        places = np.arange(WINDOW, WINDOW + points)
        dashes = ("-", "--", ":", "-.")[number // 4]
        axes.fill_between(places, low, high, alpha=0.2, linewidth=0)
        axes.plot(places, means.mean(axis=0), dashes, label=name)
    axes.set(xlabel=f"episode, running mean over {WINDOW}", title=title, ylim=(0, 510))
    axes.margins(x=0)
    figure.legend(loc="outside right upper")
    write_plot(figure, path)


def main() -> None:
    """Measure, print and plot."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--methods", nargs="*", default=LEARNERS, choices=list(METHODS))
    parser.add_argument("--backends", nargs="*", default=["mujoco"], choices=["mujoco", "gym"])
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first-seed", type=int, default=100)
    parser.add_argument("--workers", type=int, default=available_cores())
    parser.add_argument("--plot", type=Path, help="draw the learning curves into this file")
    options = parser.parse_args()
    print(f"{'':22s} {'backend':7s} {'greedy':>7s} {'worst':>7s} {'>=475':>10s} "
          f"{'steps':>10s} {'ns/step':>8s}")  # fmt: skip
    curves = {}
    for method in options.methods:
        for backend in options.backends:
            many = measure(method, backend, options)
            print_row(method, backend, many)
            if backend == options.backends[0]:
                curves[method] = running_means(many)
    if options.plot:
        title = f"return while learning on {options.backends[0]}, {options.seeds} seeds"
        plot(curves, options.plot, title)


if __name__ == "__main__":
    main()
