"""What one `env.step` costs, as ratios within this run.

    python benchmarks/step.py

Ours against gymnasium's CartPole-v1, bare and as `gymnasium.make` makes them, and against MuJoCo's
`mj_step` alone on the same model. Medians over repeats, with the lowest and the highest.
"""

import statistics
import time
from collections.abc import Callable
from typing import Any

import gymnasium
import mujoco

import mjcartpole
from mjcartpole.physics.model import load_model

STEPS = 20_000
REPEATS = 15


def play(env: gymnasium.Env[Any, Any]) -> None:
    """Push left and right in turn, and start again whenever the pole has fallen."""
    env.reset(seed=0)
    step, action = env.step, 0
    for _ in range(STEPS):
        action = 1 - action
        if step(action)[2]:
            env.reset()


def raw_steps() -> Callable[[], None]:
    """As many `mj_step` calls from Python, and nothing else."""
    model = load_model().model
    data = mujoco.MjData(model)

    def run() -> None:
        mj_step = mujoco.mj_step
        for _ in range(STEPS):
            mj_step(model, data)

    return run


def seconds(work: Callable[[], None]) -> float:
    """Time of one call."""
    started = time.perf_counter()
    work()
    return time.perf_counter() - started


def main() -> None:
    """Measure and print."""
    made = {name: gymnasium.make(name) for name in (mjcartpole.ENV_ID, "CartPole-v1")}
    ours, gyms = made[mjcartpole.ENV_ID], made["CartPole-v1"]
    raw = raw_steps()
    rates: dict[str, list[float]] = {
        "ours against CartPole-v1, bare": [],
        "ours against CartPole-v1, as made by make": [],
        "ours, bare, against mj_step alone": [],
    }
    for _ in range(REPEATS):
        bare = seconds(lambda: play(ours.unwrapped))
        figures = (
            seconds(lambda: play(gyms.unwrapped)) / bare,
            seconds(lambda: play(gyms)) / seconds(lambda: play(ours)),
            seconds(raw) / bare,
        )
        for values, figure in zip(rates.values(), figures, strict=True):
            values.append(figure)
    for name, values in rates.items():
        print(
            f"{name:44s} {statistics.median(values):5.2f} x the rate "
            f"({min(values):.2f} to {max(values):.2f})"
        )


if __name__ == "__main__":
    main()
