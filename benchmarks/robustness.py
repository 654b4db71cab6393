"""How robust is a table? Every figure of docs/robustness.md comes from here.

    python benchmarks/robustness.py poles --seeds 20
    python benchmarks/robustness.py delay --seeds 20
    python benchmarks/robustness.py noise --seeds 20
    python benchmarks/robustness.py push --seeds 20
    python benchmarks/robustness.py speed

Each learner is trained on --seeds seeds from --first-seed on; the greedy policy of each then plays
100 episodes at every level, from the same starting states. Printed is the mean return over seeds,
with its 95 % bootstrap interval; --plot FILE draws it. `speed` trains in turns with and without
disturbances: the median of steps per second of CPU, compiling and making models apart.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from mjcartpole.disturbances.disturbances import NONE, Disturbances
from mjcartpole.envs.backend import Backend
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.controllers import controller
from mjcartpole.learning.evaluation import Player, evaluate
from mjcartpole.learning.training import Training, train
from mjcartpole.media.plots import plot_style, write_plot
from mjcartpole.physics.load import load_model
from mjcartpole.studies.statistics import bootstrap_interval

LENGTHS = "pole.length=0.25:4:log"
LQR = "lqr, no training"


@dataclass(frozen=True)
class Question:
    """What is asked.

    Attributes:
        levels: Along the axis.
        axis: What it is called.
        learners: Changes of `tuned`, by name; from a level where training depends on it.
        added: What is added where a policy is played.
        edits: How the model is changed there.
        backend: Who does the physics.
    """

    levels: tuple[float, ...]
    axis: str
    learners: dict[str, Callable[[float], dict[str, Any]]]
    added: Callable[[float], Disturbances] = lambda level: NONE
    edits: Callable[[float], dict[str, float]] = field(default=lambda level: {})
    backend: str = "gym"


def always(**changes: Any) -> Callable[[float], dict[str, Any]]:  # noqa: ANN401
    """Return the same changes for every level."""
    return lambda level: changes


QUESTIONS = {
    "poles": Question(
        (0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0),
        "pole.length, m",
        {
            "tuned, 1 m": always(),
            f"varied, {LENGTHS}": always(vary=(LENGTHS,)),
            "varied, 5,000 episodes": always(vary=(LENGTHS,), episodes=5_000),
            "varied, widening over 500 episodes": always(vary=(LENGTHS,), widen=500),
        },
        edits=lambda level: {"pole.length": level},
        backend="mujoco",
    ),
    "delay": Question(
        (0, 1, 2, 3, 4, 5, 6),
        "delay, control steps of 0.02 s",
        {
            "tuned, without delay": always(),
            "trained with the delay": lambda level: {"delay": int(level)},
            "and with the last action seen": lambda level: {
                "delay": int(level),
                "observe_actions": min(1, int(level)),
            },
            "and with all on their way seen": lambda level: {
                "delay": int(level),
                "observe_actions": int(level),
            },
        },
        added=lambda level: Disturbances(delay=int(level)),
    ),
    "noise": Question(
        (0.0, 0.01, 0.02, 0.03, 0.05, 0.1, 0.2),
        "noise of all that is seen, m, m/s, rad, rad/s",
        {
            "tuned, without noise": always(),
            "trained with noise 0.03": always(noise=0.03),
            "trained with the noise": lambda level: {"noise": level},
        },
        added=lambda level: Disturbances(noise=level),
    ),
    "push": Question(
        (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0),
        "shove of the cart at random, once in 2 s, N s",
        {
            "tuned, without shoves": always(),
            "trained with 0.3 N s": always(push="0.3@~2s"),
            "trained with the shoves": lambda level: {"push": f"{level}@~2s"} if level else {},
        },
        added=lambda level: Disturbances(push=f"{level}@~2s") if level else NONE,
    ),
}


def main() -> None:
    """Ask, print, and draw."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("question", choices=[*QUESTIONS, "speed"])
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first-seed", type=int, default=5_000)
    parser.add_argument("--plot", type=Path)
    arguments = parser.parse_args()
    if arguments.question == "speed":
        print_speed()
        return
    question = QUESTIONS[arguments.question]
    seeds = range(arguments.first_seed, arguments.first_seed + arguments.seeds)
    found = {name: returns_of(question, make, seeds) for name, make in question.learners.items()}
    engineer = [play(question, level, regulator(question, level)) for level in question.levels]
    found[LQR] = np.array([engineer])
    print_table(question, found)
    if arguments.plot:
        write_plot(plot(question, found), arguments.plot)


FIVE = {
    "vary": {
        "pole.length": (0.9, 1.1),
        "pole.mass": (0.09, 0.11),
        "cart.mass": (0.9, 1.1),
        "force": (9, 11),
        "gravity": (9.5, 10),
    },
    "delay": 1,
    "noise": 0.001,
}
ADDED: dict[str, dict[str, Any]] = {
    "nothing": {},
    "delay": {"delay": 1},
    "delay and noise": {"delay": 1, "noise": 0.001},
    "five numbers that vary, delay and noise": FIVE,
}


def print_speed(repeats: int = 9) -> None:
    """Print training speeds as Markdown, and their shares of the speed without disturbances."""
    print("| backend | what is added | M steps/s | share |")
    print("|---|---|---|---|")
    for backend in ("mujoco", "gym"):
        added = {name: ADDED[name] for name in ADDED if backend == "mujoco" or ADDED[name] != FIVE}
        speeds = [[speed(backend, each) for each in added.values()] for _ in range(repeats)]
        medians = np.median(speeds[1:], axis=0)
        for name, median in zip(added, medians, strict=True):
            print(f"| {backend} | {name} | {median:.2f} | {median / medians[0]:.2f} |")


def speed(backend: str, added: dict[str, Any]) -> float:
    """Return millions of steps per second of CPU, of one training."""
    training = Training(TrainConfig(backend=backend, seed=1, **added))
    run = training.run()
    next(run)
    done, started = training.result().steps, time.process_time()
    for _ in run:
        pass
    return (training.result().steps - done) / (time.process_time() - started) / 1e6


def returns_of(
    question: Question, make: Callable[[float], dict[str, Any]], seeds: range
) -> npt.NDArray[np.float64]:
    """Return mean returns, shape (seeds, levels)."""
    policies: dict[tuple[str, int], Player] = {}

    def learned(level: float, seed: int) -> Player:
        config = TrainConfig(backend=question.backend, seed=seed, **make(level))
        key = repr(config), seed
        if key not in policies:
            policies[key] = train(config).policy
        return policies[key]

    return np.array(
        [
            [play(question, level, learned(level, seed)) for level in question.levels]
            for seed in seeds
        ]
    )


def play(question: Question, level: float, policy: Player) -> float:
    """Return the mean return of 100 episodes."""
    is_mujoco = question.backend == "mujoco"
    model = load_model("cartpole", question.edits(level)) if is_mujoco else "cartpole"
    backend: Backend = "mujoco" if is_mujoco else "gym"
    return evaluate(policy, backend=backend, model=model, disturbances=question.added(level)).mean


def regulator(question: Question, level: float) -> Player:
    """Return the regulator of the model that is played on, which knows nothing of disturbances."""
    return controller("lqr", load_model("cartpole", question.edits(level)), "gym")


def print_table(question: Question, found: dict[str, npt.NDArray[np.float64]]) -> None:
    """Print means and intervals as Markdown."""
    print(f"| {question.axis} | {' | '.join(f'{level:g}' for level in question.levels)} |")
    print(f"|---|{'---|' * len(question.levels)}")
    for name, returns in found.items():
        print(f"| {name} | {' | '.join(map(cell, returns.T))} |")


def cell(returns: npt.NDArray[np.float64]) -> str:
    """Return a mean, and its interval where there are several values."""
    if np.ptp(returns) == 0:
        return f"{returns[0]:.0f}"
    low, high = interval(returns)
    return f"{returns.mean():.0f} ({low:.0f} to {high:.0f})"


def interval(returns: npt.NDArray[np.float64]) -> tuple[float, float]:
    """Return the 95 % bootstrap interval of a mean."""
    if np.ptp(returns) == 0:
        return float(returns[0]), float(returns[0])
    low, high = bootstrap_interval(returns, np.mean)
    return low, high


@plot_style()
def plot(question: Question, found: dict[str, npt.NDArray[np.float64]]) -> Any:  # noqa: ANN401
    """Plot the means over the levels, with 95 % bands."""
    from matplotlib.figure import Figure  # noqa: PLC0415 - an optional package

    figure = Figure(figsize=(8.6, 5.6), layout="constrained")
    axes = figure.add_subplot()
    for name, returns in found.items():
        bands = [
            bootstrap_interval(each, np.mean) if np.ptp(each) else (each[0],) * 2
            for each in returns.T
        ]
        axes.fill_between(question.levels, *np.transpose(bands), alpha=0.2, linewidth=0)
        axes.plot(
            question.levels, returns.mean(axis=0), "o-", markersize=5, label=name, clip_on=False
        )
    if question.axis.startswith("pole"):
        axes.set_xscale("log", base=2)
    axes.set(xlabel=question.axis, ylabel="mean greedy return", ylim=(0, 500))
    figure.legend(loc="outside lower left")
    return figure


if __name__ == "__main__":
    main()
