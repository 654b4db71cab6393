"""How reliable is a learner? Every figure of docs/learning.md comes from here.

    python benchmarks/learners.py presets --seeds 20 --backends mujoco gym
    python benchmarks/learners.py variants --seeds 20
    python benchmarks/learners.py bins --seeds 40 --backends mujoco gym
    python benchmarks/learners.py identify --seeds 400 --backends mujoco gym
    python benchmarks/learners.py endless --names planned --seeds 1 --starts 10000

Each seed is trained alone, then its greedy policy plays 100 episodes from fresh starting states.
`last 2000` is the mean return over the last 2,000 training episodes (all, if there are fewer).
`upright` counts the starts after which all poles stand through the last 100 steps.
`endless` lets the greedy policy play on for --steps from each of --starts fresh starting states.
Seeds start at --first-seed, so that settings chosen on some seeds can be confirmed on others.
"""

import argparse
import json
import math
import multiprocessing
import time
from multiprocessing.pool import Pool
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from mjcartpole.cores import available_cores
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.episodes import ENDINGS
from mjcartpole.learning.evaluation import SEED, evaluate, evaluate_where_trained
from mjcartpole.learning.policy import Policy
from mjcartpole.learning.presets import PRESETS
from mjcartpole.learning.training import train
from mjcartpole.studies.film import play
from mjcartpole.studies.policy_setup import where_trained
from mjcartpole.task import CARTPOLE_V1

# What was tried around `tuned`: each entry changes its defaults.
ONE_STEP = {
    "td_lambda": None,
    "episodes": 2_000,
    "alpha": 0.3,
    "low": (-2.4, -1.0, -0.2095, -1.5),
    "high": (2.4, 1.0, 0.2095, 1.5),
}
VARIANTS: dict[str, dict[str, Any]] = {
    "tuned": {},
    "750 episodes": {"episodes": 750},
    "3,000 episodes": {"episodes": 3_000},
    "lambda 0.7": {"td_lambda": 0.7},
    "lambda 0.9": {"td_lambda": 0.9},
    "lambda 0.97": {"td_lambda": 0.97},
    "random ties": {"ties": "random"},
    "constant alpha 0.1": {"alpha_final": 0.1},
    "alpha from 0.3": {"alpha": 0.3},
    "epsilon 0.1 from the start": {"epsilon": 0.1},
    "epsilon down to 0.05": {"epsilon_final": 0.05},
    "gamma 0.95": {"gamma": 0.95},
    "bins 1,3,4,8": {"bins": (1, 3, 4, 8)},
    "bins 1,1,6,12": {"bins": (1, 1, 6, 12)},
    "bins 3,3,6,8": {"bins": (3, 3, 6, 8)},
    "last step not learned": {"learn_last_step": False},
    "one step, 2,000 episodes": ONE_STEP,
    "one step, constant alpha 0.1": {**ONE_STEP, "alpha": 0.1, "alpha_final": 0.1},
    "one step, bins 1,1,6,12": {**ONE_STEP, "bins": (1, 1, 6, 12)},
    "one step, bins 3,3,6,8": {**ONE_STEP, "bins": (3, 3, 6, 8)},
}

# The article's discretization analysis: bins of angle and of angular velocity.
BINS: dict[str, dict[str, Any]] = {
    f"{preset}, {bins} bins": {**PRESETS[preset], "bins": (1, 1, bins, bins)}
    for preset in ("article", "article-terminal")
    for bins in (10, 25, 50, 100)
}

# What was tried around `endless`.
AROUND_ENDLESS: dict[str, dict[str, Any]] = {
    "x not seen": {"bins": (1, 4, 6, 4)},
    "x_dot not seen": {"bins": (4, 1, 6, 4)},
    "one grid of 8,8,12,8": {"bins": (8, 8, 12, 8), "tilings": 1, "alpha": 0.1},
    "no mirror": {"mirror": False},
    "1,000 episodes": {"episodes": 1_000},
    "1,000 episodes of 5,000 steps": {"episodes": 1_000, "max_episode_steps": 5_000},
    "lambda 0.95": {"td_lambda": 0.95},
    "gamma 0.98": {"gamma": 0.98, "q_init_low": 25.0, "q_init_high": 25.0},
    "16 grids": {"tilings": 16},
    "bins 6,4,6,4": {"bins": (6, 4, 6, 4)},
}
AROUND_ENDLESS = {name: PRESETS["endless"] | AROUND_ENDLESS[name] for name in AROUND_ENDLESS}

# A model that is fitted to so many steps (left out: 3 for a rod, else one episode), and noise.
IDENTIFY: dict[str, dict[str, Any]] = {
    f"{fit}, {steps or 'few'} steps, noise {noise:g}": {
        "method": "identify",
        "fit": fit,
        "fit_steps": steps,
        "noise": noise,
    }
    for fit, counts in {"rod": (None, 20, 200), "linear": (None, 200)}.items()
    for steps in counts
    for noise in (0.0, 0.001, 0.003, 0.01, 0.03, 0.1)
}

TABLES = {
    "presets": PRESETS,
    "variants": VARIANTS,
    "bins": BINS,
    "upright": PRESETS,
    "identify": IDENTIFY,
    "endless": PRESETS | AROUND_ENDLESS,
}

LEAN = 2 * CARTPOLE_V1.theta_limit
"""A pole that leans less stands, rad."""

PART = 50  # starts that are played with one seed

Job = tuple[str, TrainConfig]


def measure(job: Job) -> dict[str, Any]:
    """Train and evaluate one seed."""
    name, config = job
    started = time.process_time()
    result = train(config)
    seconds = time.process_time() - started
    evaluation = evaluate_where_trained(result.policy, config, config.load_model(), "compiled")
    return {
        "name": name,
        "backend": config.backend,
        "seed": config.seed,
        "last_2000": float(result.returns[-2_000:].mean()),
        "greedy_mean": float(evaluation.returns.mean()),
        "greedy_min": float(evaluation.returns.min()),
        "endings": evaluation.endings,
        "steps": result.steps,
        "cpu_seconds": seconds,
    }


def endless(options: argparse.Namespace, pool: Pool) -> list[dict[str, Any]]:
    """Train every seed, and let its policy play without the task's time limit."""
    rows: list[dict[str, Any]] = []
    for name, config in make_jobs(options):
        policy = train(config).policy
        parts = [(config, policy, options.steps, part) for part in range(options.starts // PART)]
        steps = np.concatenate(list(pool.imap(play_on, parts)))
        lasted = int((steps == options.steps).sum())
        print(
            f"{name:36s} {config.backend:7s} seed {config.seed}: {lasted:,} of {len(steps):,} "
            f"starts last {options.steps:,} steps; shortest {steps.min():,}",
            flush=True,
        )
        row = {"name": name, "backend": config.backend, "seed": config.seed}
        rows.append({**row, "lasted": lasted, "starts": len(steps), "shortest": int(steps.min())})
        group = last_group(rows)
        if len(group) == options.seeds:
            shares = [each["lasted"] / each["starts"] for each in group]
            print(
                f"{name}, {config.backend}: in the median {np.median(shares):.1%} of the starts, "
                f"mean {np.mean(shares):.1%}, worst seed {min(shares):.1%}, all starts of "
                f"{sum(share == 1 for share in shares)} of {len(shares)} seeds",
                flush=True,
            )
    return rows


def last_group(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The figures of one preset on one backend so far: of the latest."""
    name, backend = rows[-1]["name"], rows[-1]["backend"]
    return [row for row in rows if (row["name"], row["backend"]) == (name, backend)]


def play_on(part: tuple[TrainConfig, Policy, int, int]) -> npt.NDArray[np.int64]:
    """Play from some of the starts; returns how many steps each lasts, shape (PART,)."""
    config, policy, steps, number = part
    played = evaluate(
        policy,
        backend=config.backend,
        model=config.load_model() if config.backend == "mujoco" else "cartpole",
        integrator=config.integrator,
        task=config.rules.with_changes(max_episode_steps=steps),
        episodes=PART,
        seed=SEED + number,
    )
    return np.array([episode.steps for episode in played.episodes])


def upright(options: argparse.Namespace, pool: Pool) -> list[dict[str, Any]]:
    """Train every seed, and count the starts after which the poles stand at the end."""
    jobs = [(name, config, options.starts) for name, config in make_jobs(options)]
    rows = []
    for (name, config, _), stood in zip(jobs, pool.imap(stand, jobs), strict=True):
        print(f"{name:36s} {config.backend:7s} seed {config.seed}: {stood} of {options.starts}")
        rows.append({"name": name, "backend": config.backend, "seed": config.seed, "stood": stood})
    print(f"all: {np.mean([row['stood'] for row in rows]) / options.starts:.2%}")
    return rows


def stand(job: tuple[str, TrainConfig, int]) -> int:
    """Train one seed; returns after how many starts the poles lean less than `LEAN` to the end."""
    name, config, starts = job
    policy = train(config).policy
    setup = where_trained(name, policy, config, config.load_model())
    takes = [take for take in play(setup, starts) if take.episode.ending == ENDINGS[0]]
    return sum(bool((np.cos(take.states[-100:, 2::2]) > math.cos(LEAN)).all()) for take in takes)


def make_jobs(options: argparse.Namespace) -> list[Job]:
    """All trainings that were asked for."""
    table = TABLES[options.what]
    names = options.names or list(table)
    seeds = range(options.first_seed, options.first_seed + options.seeds)
    return [
        (name, TrainConfig(**{**table[name], "backend": backend, "seed": seed}))
        for name in names
        for backend in options.backends
        # A preset for a model of its own is nothing for gymnasium's cart-pole.
        if backend == "mujoco" or not {"model", "set"} & table[name].keys()
        for seed in seeds
    ]


def print_group(name: str, backend: str, rows: list[dict[str, Any]]) -> None:
    """One line of the table."""
    last = np.array([row["last_2000"] for row in rows])
    greedy = np.array([row["greedy_mean"] for row in rows])
    seconds = np.array([row["cpu_seconds"] for row in rows])
    steps = np.array([row["steps"] for row in rows])
    print(
        f"{name:36s} {backend:7s} {len(rows):5d} "
        f"{last.mean():7.1f} ±{last.std(ddof=min(1, len(rows) - 1)):6.1f} {np.median(last):7.1f} "
        f"{greedy.mean():7.1f} {greedy.min():7.1f} "
        f"{(greedy >= 475).mean():7.1%} {(greedy >= 490).mean():6.0%} "
        f"{(greedy == 500).mean():6.0%} "
        f"{np.median(seconds):7.1f} {np.median(seconds / steps) * 1e9:7.0f}",
        flush=True,
    )


def reliability(options: argparse.Namespace, pool: Pool) -> list[dict[str, Any]]:
    """Train and evaluate every seed, and print a line for each group."""
    print(
        f"{'':36s} {'backend':7s} {'seeds':>5s} {'last 2000':>16s} {'median':>7s} "
        f"{'greedy':>7s} {'worst':>7s} {'>=475':>7s} {'>=490':>6s} {'=500':>6s} "
        f"{'CPU s':>7s} {'ns/step':>7s}"
    )
    rows: list[dict[str, Any]] = []
    for row in pool.imap(measure, make_jobs(options)):
        rows.append(row)
        group = last_group(rows)
        if len(group) == options.seeds:
            print_group(row["name"], row["backend"], group)
    return rows


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=list(TABLES))
    parser.add_argument("--names", nargs="*", help="only these")
    parser.add_argument("--backends", nargs="*", default=["mujoco"], choices=["mujoco", "gym"])
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first-seed", type=int, default=1_000)
    parser.add_argument("--starts", type=int, default=1_000, help="a multiple of 50")
    parser.add_argument("--steps", type=int, default=100_000)
    parser.add_argument("--workers", type=int, default=available_cores())
    parser.add_argument("--json", type=Path, help="write every seed's figures here")
    options = parser.parse_args()
    measured = {"endless": endless, "upright": upright}.get(options.what, reliability)
    with multiprocessing.Pool(options.workers) as pool:
        rows = measured(options, pool)
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
