"""From a training in progress to its results: written, evaluated, summarised."""

import contextlib
from pathlib import Path
from typing import Any

from mjcartpole.errors import RunError
from mjcartpole.learning import runs, tensorboard
from mjcartpole.learning.documents import read_summary
from mjcartpole.learning.evaluation import Evaluation, evaluate_where_trained
from mjcartpole.learning.session import Session
from mjcartpole.learning.training import TrainResult
from mjcartpole.physics.cartpole import CartPole


def finish_training(
    session: Session, folder: Path, cartpole: CartPole, *, preset: str, events: bool = False
) -> tuple[TrainResult, dict[str, Any], Evaluation | None]:
    """Write what a training has come to and, if it is over, how well its policy plays.

    The run folder stores the model; TensorBoard events are written as well if asked for. Returns
    the result, the summary as it was written, and the evaluation, None if it is not over.

    Raises:
        FileError: The folder cannot be written.
        SimulationError: The physics diverged.
    """
    result = session.training.result()
    summary = _summary(result, preset=preset, interrupted=not session.is_over)
    film = _film_of(folder)
    runs.write_results(folder, result, {**summary, **film})
    if events:
        tensorboard.write_events(folder, result)
    if not session.is_over:
        return result, summary, None
    engine = session.training.engine
    evaluation = evaluate_where_trained(result.policy, result.config, cartpole, engine)
    summary |= {"evaluation": evaluation.summary(), **film}
    runs.write_summary(folder, summary)
    return result, summary, evaluation


def _film_of(folder: Path) -> dict[str, Any]:
    """The film that this training had begun when it was stopped: it keeps its name."""
    with contextlib.suppress(RunError):
        summary = read_summary(folder)
        return {"video": summary["video"]} if "video" in summary else {}
    return {}


def _summary(result: TrainResult, *, preset: str, interrupted: bool) -> dict[str, Any]:
    returns, solved, config = result.returns, result.solved, result.config
    summary = {
        "preset": preset,
        "backend": config.backend,
        "model": config.model,
        "seed": config.seed,
        "episodes": len(returns),
        "interrupted": interrupted,
        "steps": result.steps,
        "mean_return_last_100": float(returns[-100:].mean()) if len(returns) else None,
    }
    if result.seen is not None:
        summary["seen"] = dict(zip(("episodes", "steps"), result.seen, strict=True))
    if solved is not None:
        episodes, steps, _, mean, _ = solved
        summary["solved"] = {
            "at": config.solved_at,
            "episodes": episodes,
            "steps": steps,
            "mean": mean,
        }
        if config.until is not None and not interrupted:
            summary["stopped"] = f"the mean greedy return, {mean:.2f}, reached {config.until:g}"
    return summary
