"""A policy and where it is played: as it was trained, unless something else is asked for."""

import dataclasses
import functools
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from mjcartpole.disturbances.disturbances import NONE, Disturbances
from mjcartpole.envs.backend import Backend, World, check_backend
from mjcartpole.errors import ConfigError
from mjcartpole.files import is_file
from mjcartpole.integrator import Integrator
from mjcartpole.learning import evaluation, runs
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.controllers import Controller, controller
from mjcartpole.learning.evaluation import SEED, Evaluation, Player
from mjcartpole.learning.naming import added_flags
from mjcartpole.learning.policy import Policy
from mjcartpole.media.plots import short
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.edit.edits import edits_of
from mjcartpole.physics.load import ModelLike, load_model
from mjcartpole.studies import multi_seed_runs
from mjcartpole.studies.eval_target import EvalTarget
from mjcartpole.task import CARTPOLE_V1, Task

WHERE_TRAINED: Final = EvalTarget()


@dataclass(frozen=True)
class PolicySetup:
    """A policy and where it is played.

    Attributes:
        name: What a person calls it.
        policy: A table's, or a controller.
        backend: Who does the physics.
        model: What moves, for backend mujoco; gymnasium's cart-pole is drawn as the reference.
        integrator: See `Simulation`.
        seed: Seeds the first episode's starting state.
        task: The rules.
        disturbances: What is added.
        left_out: What varied in training and does not here, since gymnasium's cart-pole cannot.
    """

    name: str
    policy: Player
    backend: Backend = "mujoco"
    model: ModelLike = "cartpole"
    integrator: Integrator = "gym"
    seed: int = SEED
    task: Task = CARTPOLE_V1
    disturbances: Disturbances = NONE
    left_out: tuple[str, ...] = ()

    @functools.cached_property
    def cartpole(self) -> CartPole:
        """What is drawn."""
        return load_model(self.model)

    @property
    def world(self) -> World:
        """Where it is played."""
        model = self.cartpole if self.backend == "mujoco" else self.model
        return World(self.backend, model, self.integrator, self.task, self.disturbances)

    @property
    def notes(self) -> list[str]:
        """What a plot says of disturbances; nothing where there are none."""
        flags = added_flags(self.disturbances)
        return [f"with {short(flags, 80)}"] if flags else []

    def evaluate(self, episodes: int) -> Evaluation:
        """Play greedy episodes; see `mjcartpole.evaluate`."""
        return evaluation.evaluate_in(self.world, self.policy, episodes, self.seed)

    @property
    def table(self) -> Policy:
        """The policy, of a table.

        Raises:
            ConfigError: It is a controller.
        """
        if isinstance(self.policy, Controller):
            raise ConfigError(f"{self.name} is a controller, which has no table")
        return self.policy


def find_setup(source: Path, target: EvalTarget = WHERE_TRAINED) -> PolicySetup:
    """Find a policy, and where to play it: as it was trained, unless the target says otherwise.

    Raises:
        MjCartPoleError: Something cannot be used.
    """
    name, policy, config, run = _read(source, target)
    return _placed(name, policy, config, run, target)


def controller_setup(name: str, target: EvalTarget = WHERE_TRAINED) -> PolicySetup:
    """Make a controller for where it is played, on the reference model unless the target says so.

    Raises:
        MjCartPoleError: Something cannot be used, or no controller has that name.
    """
    if target.allow_assets:
        raise ConfigError("--allow-assets is for the model of a run; a controller has none")
    anybody = controller("constant")
    setup = _placed(name, anybody, TrainConfig(), None, target)
    made = controller(name, setup.cartpole, setup.integrator)
    return dataclasses.replace(setup, policy=made)


def where_trained(
    name: str, policy: Policy, config: TrainConfig, cartpole: CartPole
) -> PolicySetup:
    """Return a policy where it was trained, on the model that the config names."""
    added = config.disturbances_after.seen_by(policy.actions)
    return PolicySetup(name, policy, **evaluation.world_of(config, cartpole, added)._asdict())


def _placed(
    name: str, policy: Player, config: TrainConfig, run: runs.Run | None, target: EvalTarget
) -> PolicySetup:
    seed = evaluation.SEED if target.seed is None else target.seed
    evaluation.check_count(1, seed)
    backend = target.backend or config.backend
    own = NONE if target.undisturbed else config.disturbances_after
    left_out = own.vary if backend == "gym" and not target.vary else ()
    disturbances = target.added_to(own.fixed if backend == "gym" else own).seen_by(policy.actions)
    disturbances.check_apart(edits_of(target.set))
    own_model = str(run.model) if run else config.model
    if backend == "gym":
        # Gymnasium's cart-pole has neither; only what the user asks for is held against that.
        own_model = "cartpole"
        config = TrainConfig(backend="gym", task=config.rules)
    model = own_model if target.model is None else target.model
    integrator = target.integrator or config.integrator
    asked = *target.set, *disturbances.vary
    check_backend(backend, model, integrator, asked, own_timestep=target.own_timestep)
    own_timestep = config.own_timestep or target.own_timestep
    played_on: ModelLike = model
    if run is not None and model == str(run.model):
        played_on = run.cartpole(target.allow_assets, own_timestep=own_timestep)
    if target.set or (own_timestep and played_on == model):
        played_on = load_model(played_on, target.set, own_timestep=own_timestep)
    world = backend, played_on, integrator, seed, target.applied_to(config.rules)
    return PolicySetup(name, policy, *world, disturbances, left_out)


def _read(source: Path, target: EvalTarget) -> tuple[str, Policy, TrainConfig, runs.Run | None]:
    """Return a policy, its name, how it was trained, as far as that is known, and its run."""
    if not is_file(source):
        run = runs.load_run(source)
        return _run_name(run.folder), run.policy, run.config, run
    # Every run's own is called policy.json: its folder tells them apart.
    name = _run_name(source.parent) if source.name == runs.POLICY else source.stem
    policy = Policy.load(source)
    if target.allow_assets:
        raise ConfigError("--allow-assets is for the model of a run; a policy's file has none")
    return name, policy, TrainConfig(), None


def _run_name(folder: Path) -> str:
    """Return a run's name; a seed's among many begins with theirs."""
    path = folder.resolve()
    return f"{path.parent.name}-{path.name}" if multi_seed_runs.is_seeds(path.parent) else path.name
