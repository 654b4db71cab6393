"""What do deep learners take to balance the pole? Every figure of docs/deep.md comes from here.

    python benchmarks/deep.py
    python benchmarks/deep.py --learners PPO tuned --seeds 5
    python benchmarks/deep.py table docs/deep.jsonl

Without a word it trains each learner on each backend and seed, one after the other, in one thread,
and keeps a line of JSON for each in file as it comes: a run that was killed goes on where it was.
It needs Stable-Baselines3 and PyTorch (on the processor: pip install 'mjcartpole[deep]') and about
a minute for each seed of a deep learner on a backend, two hours in all; tables take seconds.
`table` prints what such a file says, as Markdown, and needs neither.

The greedy policy plays 20 episodes each time that the steps have grown by 10 %; at a mean of 475
the training ends. Then it plays 100 from other starts, on the backend that it was trained on and on
the other one. Evaluations cost no steps and no time. deep.toml has each learner's settings.
"""

import argparse
import functools
import importlib
import json
import sys
import time
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from mjcartpole.envs.backend import Backend, make_env
from mjcartpole.files import write_whole
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.evaluation import evaluate
from mjcartpole.learning.training import Training, train
from mjcartpole.rules import Changes
from mjcartpole.studies.statistics import Statistic, bootstrap_interval, iqm
from mjcartpole.task import TASKS, Task
from mjcartpole.versions import version_of

GOAL: Final = 475.0
GROWTH: Final = 1.1
"""Evaluated at step counts each so many times the one before: as fine for quick as for slow."""
FIRST: Final = 100
WATCH_SEED, FINAL_SEED = 2_000_000, 1_000_000
CONFIDENCE: Final = 0.99
"""Twice the variance of a figure's own lies between two of it, so that another run's figure falls
into its 95 % interval in 83 cases of 100 only; into this one in 93."""

Player = Callable[..., float]
"""From backend, task, episodes, seed and goal to the mean return of greedy episodes."""


@dataclass(frozen=True)
class Learner:
    """What deep.toml says of a learner.

    Attributes:
        preset: Of ours; empty for those of Stable-Baselines3.
        steps: After so many it is given up.
        envs: So many environments give it experience at once.
        task: What it plays, by name.
        reward: What it learns from, by name; the task's if empty.
        noise: Standard deviation of what is added to its pushes.
        settings: Arguments of its class.
    """

    preset: str = ""
    steps: int = 0
    envs: int = 1
    task: str = "CartPole-v1"
    reward: str = ""
    noise: float = 0.0
    settings: dict[str, Any] = field(default_factory=dict)


def learner(said: dict[str, Any]) -> Learner:
    """Return a learner by its table in deep.toml."""
    own = {one.name for one in fields(Learner)}
    settings = {key: setting(value) for key, value in said.items() if key not in own}
    return Learner(**{key: said[key] for key in said if key in own}, settings=settings)


def setting(value: Any) -> Any:  # noqa: ANN401 - of an optional package
    """Return what is meant: a number that falls with what is left of a training, or the value."""
    if not (isinstance(value, dict) and "falling" in value):
        return value
    return lambda left: value["falling"] * left


LEARNERS: Final = {
    name: learner(said)
    for name, said in tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8")).items()
}
BACKENDS: Final[tuple[Backend, Backend]] = ("gym", "mujoco")


def main() -> None:
    """Train what is not there yet, or print what is."""
    options = read_options()
    if options.what == "table":
        print("\n".join(table(read(options.file))))
        return
    records = read(options.file)
    done = {(one["learner"], one["backend"], one["seed"]) for one in records}
    for name, backend, seed in jobs(options):
        if (name, backend, seed) not in done:
            records.append(measure(name, backend, seed))
            write_whole(options.file, "".join(f"{json.dumps(one)}\n" for one in records))
            print(json.dumps(records[-1]), flush=True)


def read_options() -> argparse.Namespace:
    """Return what is asked."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", nargs="?", choices=["train", "table"], default="train")
    parser.add_argument("file", nargs="?", type=Path, default=Path("runs/deep.jsonl"))
    parser.add_argument("--learners", nargs="+", choices=list(LEARNERS), default=list(LEARNERS))
    parser.add_argument("--backends", nargs="+", choices=BACKENDS, default=list(BACKENDS))
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first-seed", type=int, default=0)
    return parser.parse_args()


def jobs(options: argparse.Namespace) -> Iterator[tuple[str, Backend, int]]:
    """Yield learner, backend and seed of each training, all of one seed before the next one's."""
    for seed in range(options.first_seed, options.first_seed + options.seeds):
        for name in options.learners:
            for backend in options.backends:
                yield name, backend, seed


def read(file: Path) -> list[dict[str, Any]]:
    """Return the records of a file; none where there is no file."""
    if not file.exists():
        return []
    return [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]


class Watch:
    """Looks at a training every now and then, until the greedy policy is good.

    Attributes:
        episodes: Of the training so far.
        seconds: Of the processor, that looking took.
        solved: Whether the goal was reached.
    """

    def __init__(self, backend: Backend, task: Task) -> None:
        self.episodes, self.seconds, self.solved = 0, 0.0, False
        self._backend: Backend = backend
        self._task, self._next = task, float(FIRST)

    def look(self, steps: int, player: Player) -> bool:
        """Return whether the goal is reached, playing where it is time."""
        if steps >= self._next and not self.solved:
            started = time.process_time()
            self._next = max(self._next, steps) * GROWTH
            self.solved = player(self._backend, self._task, 20, WATCH_SEED, GOAL) >= GOAL
            self.seconds += time.process_time() - started
        return self.solved

    def __call__(self, inside: dict[str, Any], _: dict[str, Any]) -> bool:
        """Return whether Stable-Baselines3 is to go on, after a step of its environments."""
        model = inside["self"]
        self.episodes += int(sum(inside["dones"]))
        return not self.look(model.num_timesteps, functools.partial(play, model))


def measure(name: str, backend: Backend, seed: int) -> dict[str, Any]:
    """Train once, and return what came of it."""
    task = TASKS[LEARNERS[name].task]
    watch = Watch(backend, task)
    way = train_ours if LEARNERS[name].preset else train_deep
    player, episodes, steps, seconds = way(name, backend, seed, watch)
    other: Backend = "mujoco" if backend == "gym" else "gym"
    return {
        "learner": name,
        "backend": backend,
        "seed": seed,
        "solved": watch.solved,
        "episodes": episodes,
        "steps": steps,
        "seconds": round(seconds, 5),
        "greedy": player(backend, task, 100, FINAL_SEED),
        "carried": player(other, task, 100, FINAL_SEED),
        "versions": {one: version_of(one) for one in ("stable-baselines3", "torch", "mujoco")},
    }


def train_deep(
    name: str, backend: Backend, seed: int, watch: Watch
) -> tuple[Player, int, int, float]:
    """Train a learner of Stable-Baselines3: what plays, episodes, steps, seconds."""
    deep, sb3 = LEARNERS[name], needed()
    changed: Changes = {"reward": deep.reward} if deep.reward else {}
    world = importlib.import_module("stable_baselines3.common.vec_env").DummyVecEnv(
        [lambda: make_env(backend, task=deep.task, **changed)] * deep.envs
    )
    settings = dict(deep.settings)
    if deep.noise:
        noises = importlib.import_module("stable_baselines3.common.noise")
        settings["action_noise"] = noises.NormalActionNoise(np.zeros(1), np.full(1, deep.noise))
    model = getattr(sb3, name)("MlpPolicy", world, seed=seed, device="cpu", **settings)
    started = time.process_time()
    model.learn(deep.steps, callback=watch)
    seconds = time.process_time() - started - watch.seconds
    return functools.partial(play, model), watch.episodes, model.num_timesteps, seconds


def needed() -> Any:  # noqa: ANN401 - of an optional package
    """Return Stable-Baselines3, on one thread, or say how to get it."""
    try:
        importlib.import_module("torch").set_num_threads(1)
        return importlib.import_module("stable_baselines3")
    except ImportError as error:
        print(f"error: {error.name} is missing: pip install 'mjcartpole[deep]'", file=sys.stderr)
        raise SystemExit(2) from error


def train_ours(
    name: str, backend: Backend, seed: int, watch: Watch
) -> tuple[Player, int, int, float]:
    """Train a table, watched after each episode: what plays, episodes, steps, seconds.

    The time is that of a training that plays no greedy episode before it ends there: the least of
    several, since it is too short for the processor's clock.
    """
    preset = LEARNERS[name].preset
    training = Training(TrainConfig.preset(preset, backend=backend, seed=seed, evaluate_every=1))
    player = functools.partial(play_table, training)
    for _ in training.run():
        if watch.look(training.evaluations[-1].steps, player):
            break
    episodes, steps = training.evaluations[-1][:2]
    again = replace(training.config, evaluate_every=episodes, until=0)
    seconds = min(train(again).evaluations[-1].seconds for _ in range(5))
    return player, episodes, steps, seconds


def play_table(
    training: Training, backend: Backend, task: Task, episodes: int, seed: int, _: float = 0.0
) -> float:
    """Return the mean return of greedy episodes of a table, as `play` does."""
    policy = training.result().policy
    return evaluate(policy, backend=backend, task=task, episodes=episodes, seed=seed).mean


@functools.cache
def worlds(backend: Backend, task: Task, count: int) -> list[Any]:
    """Return environments to play in."""
    return [make_env(backend, task=task) for _ in range(count)]


def play(
    model: Any,  # noqa: ANN401 - of an optional package
    backend: Backend,
    task: Task,
    episodes: int,
    seed: int,
    goal: float = 0.0,
) -> float:
    """Return the mean return of greedy episodes, side by side; less, once the goal is lost."""
    envs, total = worlds(backend, task, episodes), 0.0
    going = [(env, env.reset(seed=seed + i)[0]) for i, env in enumerate(envs)]
    for left in reversed(range(task.time_limit)):
        actions, _ = model.predict(np.array([seen for _, seen in going]), deterministic=True)
        steps = [env.step(action) for (env, _), action in zip(going, actions, strict=True)]
        total += sum(float(step[1]) for step in steps)
        going = [(e, s[0]) for (e, _), s in zip(going, steps, strict=True) if not (s[2] or s[3])]
        if not going or total + left * len(going) < goal * episodes:
            break
    return total / episodes


def table(records: list[dict[str, Any]]) -> list[str]:
    """Return lines of Markdown: a row for each learner and backend."""
    groups: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for one in records:
        groups.setdefault((one["learner"], one["backend"]), []).append(one)
    order = sorted(groups, key=lambda key: ([*LEARNERS].index(key[0]), key[1]))
    base = {key[1]: median(groups[key], "seconds") for key in order if key[0] == "tuned"}
    return [
        "| learner | trained on | solved | episodes | steps | time / `tuned` | greedy mean "
        "| on the other |",
        "|---|---|---|---|---|---|---|---|",
        *(row(*key, groups[key], base.get(key[1])) for key in order),
    ]


def row(name: str, backend: str, group: list[dict[str, Any]], base: float | None) -> str:
    """Return a row of the table."""
    cells = [
        f"`{name}`" if LEARNERS[name].preset else name,
        backend,
        f"{sum(one['solved'] for one in group)} of {len(group)}",
        told(group, "episodes", np.median),
        told(group, "steps", np.median),
        times(median(group, "seconds") / base) if base else "",
        told(group, "greedy", iqm),
        told(group, "carried", iqm),
    ]
    return f"| {' | '.join(cells)} |"


def median(group: list[dict[str, Any]], figure: str) -> float:
    """Return the median of a figure over seeds."""
    return float(np.median([one[figure] for one in group]))


def times(ratio: float) -> str:
    """Return a ratio by its first digit: more of it is the machine's."""
    return f"{float(f'{ratio:.1g}'):,g}"


def told(group: list[dict[str, Any]], figure: str, statistic: Statistic) -> str:
    """Return a figure of several seeds with its interval."""
    values = np.array([one[figure] for one in group], float)
    low, high = bootstrap_interval(values, statistic, confidence=CONFIDENCE)
    spread = f" ({low:,.0f} to {high:,.0f})" if round(low) != round(high) else ""
    return f"{statistic(values):,.0f}{spread}"


if __name__ == "__main__":
    main()
