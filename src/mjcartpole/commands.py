"""What `evaluate` does and prints, and how a policy and its stage are found."""

import json
from dataclasses import dataclass
from pathlib import Path

from mjcartpole.envs.backend import Backend, check_backend
from mjcartpole.files import is_file
from mjcartpole.integrator import Integrator
from mjcartpole.learning import runs
from mjcartpole.learning.policy import Policy
from mjcartpole.physics.model import ModelLike, load_model
from mjcartpole.physics.simulation import silence_mujoco
from mjcartpole.studies import evaluation
from mjcartpole.studies.evaluation import Evaluation, check_count, evaluate
from mjcartpole.studies.film import Stage

RUNS = Path("runs")
VIDEOS = Path("videos")


@dataclass(frozen=True)
class Choice:
    """Where to play a policy; None means: where it was trained."""

    backend: Backend | None = None
    model: str | None = None
    integrator: Integrator | None = None
    seed: int | None = None
    set: tuple[str, ...] = ()
    own_timestep: bool = False


def run_evaluate(source: Path, choice: Choice, *, episodes: int, as_json: bool) -> int:
    """Play greedy episodes and print the figures. Returns the exit code."""
    stage = set_stage(source, choice)
    result = _evaluate(stage, episodes)
    if as_json:
        model = stage.model if isinstance(stage.model, str) else stage.cartpole.name
        print(json.dumps({"policy": str(source), "model": model, **result.summary()}))
    else:
        print_evaluation(result)
    return 0


def set_stage(source: Path, choice: Choice) -> Stage:
    """Find a policy, and where to play it: as it was trained, unless the user chose otherwise."""
    silence_mujoco()
    seed = evaluation.SEED if choice.seed is None else choice.seed
    check_count(1, seed)
    backend: Backend
    integrator: Integrator
    if is_file(source):
        # Every run's own is called policy.json: its folder tells them apart.
        name = source.resolve().parent.name if source.name == runs.POLICY else source.stem
        policy = Policy.load(source)
        backend, integrator, model, own_timestep = "mujoco", "gym", "cartpole", False
    else:
        run = runs.load_run(source)
        name, policy = run.folder.resolve().name, run.policy
        backend, integrator = run.config.backend, run.config.integrator
        model, own_timestep = str(run.model), run.config.own_timestep
    backend = choice.backend or backend
    if backend == "gym":
        # Gymnasium's cart-pole has neither; only what the user asks for is held against that.
        integrator, model, own_timestep = "gym", "cartpole", False
    model, integrator = choice.model or model, choice.integrator or integrator
    check_backend(backend, model, integrator, choice.set, own_timestep=choice.own_timestep)
    own_timestep = own_timestep or choice.own_timestep
    played_on: ModelLike = model
    if choice.set or own_timestep:
        played_on = load_model(model, choice.set, own_timestep=own_timestep)
    return Stage(name, policy, backend, played_on, integrator, seed)


def _evaluate(stage: Stage, episodes: int) -> Evaluation:
    return evaluate(
        stage.policy,
        backend=stage.backend,
        model=stage.model,
        integrator=stage.integrator,
        episodes=episodes,
        seed=stage.seed,
    )


def print_evaluation(result: Evaluation) -> None:
    """Mean, minimum, and how the episodes ended."""
    returns = result.returns
    print(
        f"\ngreedy evaluation on {result.backend}: {len(returns)} episodes, seed {result.seed}\n"
        f"  mean return {returns.mean():.2f}, minimum {returns.min():.0f}"
    )
    for ending, count in result.endings.items():
        print(f"  {ending:13s} {count:5d}")
