"""How do the methods compare? The table and the figure of docs/methods.md come from here.

    python benchmarks/methods.py --seeds 20 --backends mujoco gym --plot docs/images/methods.png

Each method learns with its own defaults on the grid of `tuned`, one training per seed, then its
greedy policy plays 100 episodes from fresh starting states. The figure has the running mean of the
returns while learning, on the first backend, and its 95 % bootstrap interval over the seeds.
"""

import argparse
from pathlib import Path

import numpy as np

from mjcartpole.cores import available_cores
from mjcartpole.envs.backend import Backend
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.methods import METHODS, method_named
from mjcartpole.media.curve_plot import Curves, Line
from mjcartpole.media.plots import write_plot
from mjcartpole.studies.multi_seed import train_many
from mjcartpole.studies.run_curves import line_of_seeds
from mjcartpole.studies.seeds import ManyResult
from mjcartpole.task import CARTPOLE_V1

WINDOW = 25
"""Episodes of the running mean."""

LEARNERS = [
    name
    for name in METHODS
    if not any(hasattr(method_named(name), other) for other in ("plan", "imagine"))
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


def line_of(method: str, many: ManyResult) -> Line:
    """Return the learning curve of a method: the mean over its seeds, with a band."""
    results = [found.result.returns for found in many.seeds if found.result is not None]
    return line_of_seeds(method, results, WINDOW)


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
    lines = []
    for method in options.methods:
        for backend in options.backends:
            many = measure(method, backend, options)
            print_row(method, backend, many)
            if backend == options.backends[0]:
                lines.append(line_of(method, many))
    if options.plot:
        curves = Curves(lines, WINDOW, CARTPOLE_V1.return_span, CARTPOLE_V1.reward_threshold)
        write_plot(curves.figure(), options.plot)


if __name__ == "__main__":
    main()
