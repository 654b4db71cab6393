"""What the commands do and print."""

import json
from collections import deque
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeRemainingColumn,
    track,
)

from mjcartpole.envs.backend import Backend, make_env
from mjcartpole.files import check_writable, make_folder
from mjcartpole.integrator import Integrator
from mjcartpole.learning import runs
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.loop import play_episode
from mjcartpole.learning.policy import Policy
from mjcartpole.learning.training import Training, TrainResult
from mjcartpole.media.renderer import open_renderer
from mjcartpole.media.video import write_video
from mjcartpole.physics.model import load_model
from mjcartpole.physics.simulation import silence_mujoco
from mjcartpole.studies import evaluation
from mjcartpole.studies.evaluation import Evaluation, check_count, evaluate

RUNS = Path("runs")
VIDEOS = Path("videos")
RUNNING_MEAN = 100
"""Episodes in the progress bar's mean."""


@dataclass(frozen=True)
class Choice:
    """Where to play a policy; None means: where it was trained."""

    backend: Backend | None = None
    model: str | None = None
    integrator: Integrator | None = None
    seed: int | None = None


@dataclass(frozen=True)
class Stage:
    """A policy and where it is played, all questions answered."""

    name: str
    policy: Policy
    backend: Backend
    model: str
    integrator: Integrator
    seed: int


def run_train(
    config: TrainConfig, *, preset: str, run_dir: Path | None, video: bool, overwrite: bool
) -> int:
    """Train, evaluate, film; print what came out. Returns the exit code.

    Raises:
        KeyboardInterrupt: After Ctrl-C, when what was learned is kept; the message says where.
    """
    silence_mujoco()
    training = Training(config)
    cartpole = load_model(config.model)
    runs.check_storable(cartpole)
    folder = run_dir or runs.free_folder(RUNS, f"{preset}-{config.backend}-seed{config.seed}")
    if video:
        check_writable(make_folder(VIDEOS))
    with runs.claimed_folder(folder, overwrite=overwrite):
        print(f"{preset} on {config.backend}: {config.episodes:,} episodes, seed {config.seed}")
        interrupted = _train_with_progress(training)
        result = training.result()
        runs.write_run(folder, result, cartpole, preset=preset)
    summary = _summary(result, preset=preset, interrupted=interrupted)
    runs.write_summary(folder, summary)
    _print_learning(result)
    try:
        if interrupted:
            raise KeyboardInterrupt
        _show_result(result, folder, summary, video=video)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(
            f"interrupted after {len(result.episodes):,} of {config.episodes:,} episodes; "
            f"what was learned is kept in {folder}"
        ) from None
    return 0


def run_evaluate(source: Path, choice: Choice, *, episodes: int, as_json: bool) -> int:
    """Play greedy episodes and print the figures. Returns the exit code."""
    stage = _set_stage(source, choice)
    result = _evaluate(stage, episodes)
    if as_json:
        print(json.dumps({"policy": str(source), "model": stage.model, **result.summary()}))
    else:
        _print_evaluation(result)
    return 0


def run_render(
    source: Path, choice: Choice, *, output: Path | None, camera: str, width: int, height: int
) -> int:
    """Film one greedy episode. Returns the exit code."""
    stage = _set_stage(source, choice)
    path = output or VIDEOS / f"{stage.name}.mp4"
    _film(stage, path, camera=camera, width=width, height=height)
    return 0


def _train_with_progress(training: Training) -> bool:
    """Train to the end or to Ctrl-C; returns whether it was interrupted."""
    recent: deque[float] = deque(maxlen=RUNNING_MEAN)
    columns = (
        TextColumn("training"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("episodes, mean return {task.fields[mean]:5.1f}"),
        TimeRemainingColumn(),
    )
    console = Console(stderr=True)
    quiet = not console.is_terminal
    with Progress(*columns, console=console, transient=True, disable=quiet) as progress:
        bar = progress.add_task("", total=training.config.episodes, mean=0.0)
        try:
            for episode in training.run():
                recent.append(episode.total)
                progress.update(bar, advance=1, mean=sum(recent) / len(recent))
        except KeyboardInterrupt:
            return True
    return False


def _show_result(
    result: TrainResult, folder: Path, summary: dict[str, Any], *, video: bool
) -> None:
    """Evaluate and film what was trained, and keep the run's summary up to date."""
    config = result.config
    stage = Stage(
        folder.resolve().name,
        result.policy,
        config.backend,
        config.model,
        config.integrator,
        evaluation.SEED,
    )
    greedy = _evaluate(stage, evaluation.EPISODES)
    summary["evaluation"] = greedy.summary()
    runs.write_summary(folder, summary)
    _print_evaluation(greedy)
    print(f"\nrun    {folder}", flush=True)
    if video:
        path = VIDEOS / f"{stage.name}.mp4"
        _film(stage, path, camera="side", width=640, height=480)
        summary["video"] = str(path)
        runs.write_summary(folder, summary)


def _set_stage(source: Path, choice: Choice) -> Stage:
    """Find a policy, and where to play it: as it was trained, unless the user chose otherwise."""
    silence_mujoco()
    seed = evaluation.SEED if choice.seed is None else choice.seed
    check_count(1, seed)
    backend: Backend
    integrator: Integrator
    if source.is_file():
        name, policy = source.stem, Policy.load(source)
        backend, integrator, model = "mujoco", "gym", "cartpole"
    else:
        run = runs.load_run(source)
        name, policy = run.folder.resolve().name, run.policy
        backend, integrator = run.config.backend, run.config.integrator
        model = str(run.model)
    backend = choice.backend or backend
    if backend == "gym":
        # Gymnasium's cart-pole has neither; only what the user asks for is held against that.
        integrator, model = "gym", "cartpole"
    return Stage(
        name, policy, backend, choice.model or model, choice.integrator or integrator, seed
    )


def _evaluate(stage: Stage, episodes: int) -> Evaluation:
    return evaluate(
        stage.policy,
        backend=stage.backend,
        model=stage.model,
        integrator=stage.integrator,
        episodes=episodes,
        seed=stage.seed,
    )


def _film(stage: Stage, path: Path, *, camera: str, width: int, height: int) -> None:
    """Play the stage's first episode and write it as a video."""
    env = make_env(stage.backend, stage.model, stage.integrator)
    episode, states = play_episode(env, stage.policy, seed=stage.seed)
    env.close()
    cartpole = load_model(stage.model)
    with open_renderer(cartpole, width=width, height=height, camera=camera) as renderer:
        console = Console(stderr=True)
        shown = track(
            states, "filming", console=console, transient=True, disable=not console.is_terminal
        )
        write_video(path, (renderer.render(state) for state in shown))
        print(
            f"video  {path}  ({episode.steps} steps, {episode.ending}; "
            f"{width}x{height}, drawn by {renderer.kind})"
        )


def _summary(result: TrainResult, *, preset: str, interrupted: bool) -> dict[str, Any]:
    returns = result.returns
    return {
        "preset": preset,
        "backend": result.config.backend,
        "model": result.config.model,
        "seed": result.config.seed,
        "episodes": len(returns),
        "interrupted": interrupted,
        "steps": result.steps,
        "seconds": round(result.seconds, 3),
        "mean_return_last_100": float(returns[-100:].mean()) if len(returns) else None,
    }


def _print_learning(result: TrainResult) -> None:
    """The article's table: mean return of each `log_every` episodes."""
    returns, every = result.returns, result.config.log_every
    print("\n episode   mean return")
    for start in range(0, len(returns), every):
        block = returns[start : start + every]
        print(f"{start + len(block):8,} {block.mean():13.1f}")
    rate = result.steps / result.seconds if result.seconds else 0.0
    print(f"\n{result.steps:,} steps in {result.seconds:.1f} s ({rate:,.0f} per second)")


def _print_evaluation(result: Evaluation) -> None:
    returns = result.returns
    print(
        f"\ngreedy evaluation on {result.backend}: {len(returns)} episodes, seed {result.seed}\n"
        f"  mean return {returns.mean():.2f}, minimum {returns.min():.0f}"
    )
    for ending, count in result.endings.items():
        print(f"  {ending:13s} {count:5d}")
