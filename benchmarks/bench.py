"""How fast is it? Every figure is a ratio within this run: `make bench`.

    python -m benchmarks.bench [--quick] [--json FILE] [--only SECTION …]

Medians over repeats, with the lowest and the highest. Sections: step, vector, threads, training,
methods, seeds, start, memory. What the figures mean, and where each microsecond goes:
docs/performance.md.
"""

import argparse
import functools
import itertools
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, get_args

import gymnasium
import numpy as np
from benchmarks.article import train_like_the_article
from benchmarks.methods import LEARNERS
from benchmarks.others import GymnasiumMujoco, raw_steps
from benchmarks.ratios import Ratio, compare, seconds
from mujoco.batch import Batch

import mjcartpole
from mjcartpole.cores import available_cores
from mjcartpole.envs.backend import Backend
from mjcartpole.files import write_whole
from mjcartpole.learning import runs
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.training import Training, train
from mjcartpole.physics.load import load_model
from mjcartpole.studies.multi_seed import train_many

Section = Callable[[bool], Iterator[Ratio]]


def _play(env: gymnasium.Env[Any, Any], steps: int) -> Callable[[], None]:
    """Random actions, and a reset whenever the episode is over."""
    actions = np.random.default_rng(0).integers(2, size=steps).tolist()
    env.reset(seed=0)

    def run() -> None:
        step = env.step
        for action in actions:
            _, _, terminated, truncated, _ = step(action)
            if terminated or truncated:
                env.reset()

    return run


def _play_dm(steps: int) -> Callable[[], None]:
    # It does not come along on every Python.
    from benchmarks.suite import dm_control_environment  # noqa: PLC0415

    env = dm_control_environment()
    signs = np.random.default_rng(0).choice([-1.0, 1.0], size=steps).tolist()
    actions = [np.array([sign]) for sign in signs]
    env.reset()

    def run() -> None:
        step = env.step
        for action in actions:
            # After the last step of an episode, dm_control's next one starts the new.
            step(action)

    return run


def step(quick: bool) -> Iterator[Ratio]:
    """One `env.step` in Python."""
    n, repeats = (3_000, 5) if quick else (20_000, 21)
    ours, gyms = (gymnasium.make(name) for name in (mjcartpole.ENV_ID, "CartPole-v1"))
    bare = _play(ours.unwrapped, n)
    cases = [
        ("env.step against CartPole-v1, bare", bare, _play(gyms.unwrapped, n), 1.8),
        ("env.step against CartPole-v1, as made by make", _play(ours, n), _play(gyms, n), 1.5),
        ("env.step, bare, against gymnasium's MujocoEnv", bare, _play(GymnasiumMujoco(), n), None),
    ]
    try:
        cases.append(("env.step, bare, against dm_control's Environment", bare, _play_dm(n), None))
    except ImportError as error:
        print(f"  without dm_control: {error}")
    for name, mine, other, wanted in cases:
        yield compare("step", name, mine, other, repeats=repeats, wanted=wanted)


def vector(quick: bool) -> Iterator[Ratio]:
    """Many environments at once."""
    n, blocks, repeats = 1_024, 20, 9 if quick else 101
    envs = gymnasium.make_vec(mjcartpole.ENV_ID, num_envs=n)
    batch = Batch(load_model().model, n)
    batch.bind("ctrl")[:] = 1.0

    def alone() -> None:
        for _ in range(blocks):
            batch.step()

    name = f"{n} environments on all cores against mujoco.batch alone"
    yield compare(
        "vector",
        name,
        _play_vector(envs, blocks),
        alone,
        repeats=repeats,
        wanted=0.88,
    )
    envs, sync = (
        gymnasium.make_vec(mjcartpole.ENV_ID, num_envs=64, vectorization_mode=mode)
        for mode in (None, "sync")
    )
    name = "64 environments against gymnasium's SyncVectorEnv of ours"
    works = (_play_vector(made, 5 * blocks) for made in (envs, sync))
    yield compare("vector", name, *works, repeats=5 if quick else 15)


def threads(quick: bool) -> Iterator[Ratio]:
    """The vector's own choice of threads against one, and against all cores.

    Blocks are short, so that most of them run without another program in between.
    """
    repeats, block = (41, 0.002) if quick else (301, 0.004)
    for substeps in (1, 10, 100):
        for n in (1, 2, 4, 16, 64, 128, 256, 512, 1_024, 4_096):
            edits = {"option.timestep": 0.02 / substeps}
            envs = [
                gymnasium.make_vec(mjcartpole.ENV_ID, n, threads=count, edits=edits)
                for count in (None, 1, available_cores())
            ]
            # The first steps hold the first trial.
            length = [seconds(_play_vector(each, 20)) / 20 for each in envs][1]
            own, *others = (_play_vector(each, max(1, round(block / length))) for each in envs)
            for words, other in zip(("one thread", "all"), others, strict=True):
                name = f"{n} environments of {substeps} physics steps against {words}"
                yield compare("threads", name, own, other, repeats=repeats, wanted=0.95)


def _play_vector(envs: gymnasium.vector.VectorEnv[Any, Any, Any], steps: int) -> Callable[[], None]:
    envs.reset(seed=0)
    actions = itertools.cycle([envs.action_space.sample() for _ in range(37)])

    def run() -> None:
        for _ in range(steps):
            envs.step(next(actions))

    return run


def training(quick: bool) -> Iterator[Ratio]:
    """All of `train()`."""
    repeats = 3 if quick else 7
    episodes = 2_000 if quick else 9_000
    config = TrainConfig(episodes=episodes)
    steps = train(config).steps
    yield compare(
        "training",
        f"compiled on mujoco, {steps / 1e6:.1f} M steps, against mj_step(nstep=N)",
        lambda: train(config),
        raw_steps(steps),
        repeats=repeats,
        wanted=0.95,
    )
    for backend in get_args(Backend):
        yield _engines(backend)
    article = TrainConfig.preset("article", backend="gym", episodes=60_000)
    share = train(article).steps / train_like_the_article(400)
    yield compare(
        "training",
        "compiled on gym against the article's own loop on gymnasium",
        lambda: train(article),
        lambda: train_like_the_article(400),
        repeats=repeats,
        wanted=150,
        share=share,
    )


def methods(quick: bool) -> Iterator[Ratio]:
    """All of `train()` by each method that learns from episodes, with its defaults."""
    for method in LEARNERS:
        config = TrainConfig(method=method, episodes=300 if quick else 1_000)
        steps = train(config).steps
        yield compare(
            "methods",
            f"{method} on mujoco, {steps / 1e3:.0f} k steps, against mj_step(nstep=N)",
            functools.partial(train, config),
            raw_steps(steps),
            repeats=5 if quick else 9,
            wanted=None if method in ("model", "prioritized-sweeping") else 0.9,
        )


def _engines(backend: Backend) -> Ratio:
    """The Python engine gets less to do; what they do per second is compared."""
    short = TrainConfig(episodes=300, backend=backend)
    long = TrainConfig(episodes=30_000 if backend == "gym" else 3_000, backend=backend)
    return compare(
        "training",
        f"compiled against the Python engine, {backend}",
        lambda: train(long),
        lambda: train(short, engine="python"),
        repeats=3,
        share=train(long).steps / train(short).steps,
    )


def seeds(quick: bool) -> Iterator[Ratio]:
    """Seeds side by side."""
    config = TrainConfig(episodes=600 if quick else 3_000)
    workers = min(2, available_cores())
    yield compare(
        "seeds",
        f"8 seeds on {workers} workers against 1 worker",
        lambda: train_many(config, 8, workers=workers),
        lambda: train_many(config, 8, workers=1),
        repeats=3 if quick else 5,
        wanted=1.6,
    )


def start(quick: bool) -> Iterator[Ratio]:
    """Start-up: whole processes."""
    repeats = 3 if quick else 11
    numpy = _process("-c", "import numpy")
    for name, arguments in {
        "mjcartpole --help": ("-m", "mjcartpole", "--help"),
        "import mjcartpole": ("-c", "import mjcartpole"),
        "train, default preset, without video": ("-m", "mjcartpole", "train", "--no-video"),
    }.items():
        wanted = 1 / 5 if name.endswith("--help") else None
        yield compare(
            "start",
            f"import numpy against {name}",
            _process(*arguments),
            numpy,
            repeats=repeats,
            wanted=wanted,
        )


def _process(*arguments: str) -> Callable[[], None]:
    def run() -> None:
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(
                [sys.executable, *arguments], cwd=folder, check=True, stdout=subprocess.DEVNULL
            )

    return run


def memory(quick: bool) -> None:
    """Growth of this process over a long training, in MiB; printed, since it is no ratio."""
    statm = Path("/proc/self/statm")
    if not statm.exists():
        print("  memory: this platform has no /proc/self/statm")
        return
    run = Training(TrainConfig(backend="gym", episodes=20_000 if quick else 400_000)).run()
    next(run)

    def resident() -> float:
        return int(statm.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20

    before = resident()
    for _ in run:
        pass
    print(f"  resident memory grew by {resident() - before:.1f} MiB")


SECTIONS: dict[str, Section] = {
    "step": step,
    "vector": vector,
    "threads": threads,
    "training": training,
    "methods": methods,
    "seeds": seeds,
    "start": start,
}


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="fewer and shorter repeats")
    parser.add_argument("--json", type=Path, default=Path("runs/bench.json"), help="result file")
    names = [*SECTIONS, "memory"]
    parser.add_argument("--only", nargs="+", choices=names, default=names, metavar="SECTION")
    arguments = parser.parse_args()
    found: list[Ratio] = []
    print(f"{'how many times faster':68s} {'median':>8s}   lowest to highest")
    for name in arguments.only:
        print(name)
        if name == "memory":
            memory(arguments.quick)
            continue
        for ratio in SECTIONS[name](arguments.quick):
            found.append(ratio)
            print(ratio.row(), flush=True)
    report: dict[str, Any] = {
        "versions": runs.versions(),
        "cores": available_cores(),
        "ratios": [ratio.summary() for ratio in found],
    }
    write_whole(arguments.json, json.dumps(report, indent=2) + "\n")
    print(f"\nfigures in {arguments.json}")


if __name__ == "__main__":
    main()
