"""How good is a policy? Greedy episodes, counted."""

import contextlib
import html
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt
from gymnasium.utils import seeding

from mjcartpole.disturbances.contexts import Chance
from mjcartpole.disturbances.disturbances import NONE, Disturbances
from mjcartpole.envs.backend import GYM_ID, Backend, World, check_backend, make_env
from mjcartpole.errors import ConfigError
from mjcartpole.integrator import Integrator
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.controllers import Controller
from mjcartpole.learning.engine import Engine, choose_engine
from mjcartpole.learning.episodes import ENDINGS, Episode, EpisodeLog
from mjcartpole.learning.loop import lend, play_episode
from mjcartpole.learning.naming import added_flags
from mjcartpole.learning.policy import Policy
from mjcartpole.task import CARTPOLE_V1, Task, resolve

if TYPE_CHECKING:
    from mjcartpole.physics.cartpole import CartPole
    from mjcartpole.physics.load import ModelLike

EPISODES: Final = 100
SEED: Final = 1_000_000
"""Default seed of evaluations, far from the small ones that people train with."""

PolicyLike = Callable[[npt.NDArray[np.float32]], int]
Player = Policy | Controller
"""What is played by name or from a file."""


@dataclass(frozen=True, repr=False)
class Evaluation:
    """Greedy episodes of one policy.

    Attributes:
        backend: Who did the physics.
        seed: Seed of the first episode's starting state.
        episodes: What each came to.
        disturbances: What was added.
    """

    backend: Backend
    seed: int
    episodes: tuple[Episode, ...]
    disturbances: Disturbances = NONE

    @property
    def returns(self) -> npt.NDArray[np.float64]:
        """Return of each episode, shape (episodes,)."""
        return np.array([episode.total for episode in self.episodes])

    @property
    def mean(self) -> float:
        """Mean return."""
        return float(self.returns.mean())

    @property
    def minimum(self) -> float:
        """The least return."""
        return float(self.returns.min())

    @property
    def endings(self) -> dict[str, int]:
        """How many episodes ended in each way."""
        counts = Counter(episode.ending for episode in self.episodes)
        return {ending: counts[ending] for ending in ENDINGS}

    def summary(self) -> dict[str, Any]:
        """The figures as plain values, for JSON."""
        return {
            "backend": self.backend,
            "seed": self.seed,
            "episodes": len(self.episodes),
            "mean": self.mean,
            "minimum": self.minimum,
            "endings": self.endings,
            **({"disturbances": added} if (added := added_flags(self.disturbances)) else {}),
        }

    def _repr_html_(self) -> str:
        n = max(1, len(self.episodes))
        rows = "".join(
            f'<tr><td>{ending}</td><td>{count}</td><td><progress max="{n}" value="{count}">'
            "</progress></td></tr>"
            for ending, count in self.endings.items()
        )
        return f"<pre>{html.escape(repr(self))}</pre><table>{rows}</table>"

    def __repr__(self) -> str:
        added = f" with {flags}" if (flags := added_flags(self.disturbances)) else ""
        played = f"{len(self.episodes)} episodes on {self.backend}{added}, seed {self.seed}"
        figures = (
            f": mean return {self.mean:.2f}, minimum {self.minimum:g}" if self.episodes else ""
        )
        return f"Evaluation({played}{figures})"


def evaluate(
    policy: PolicyLike,
    *,
    backend: Backend = "mujoco",
    model: "ModelLike" = "cartpole",
    integrator: Integrator = "gym",
    task: Task | str = CARTPOLE_V1,
    disturbances: Disturbances = NONE,
    episodes: int = EPISODES,
    seed: int = SEED,
    engine: Engine = "compiled",
) -> Evaluation:
    """Play episodes from fresh starting states, without learning.

    Args:
        policy: From an observation to an action.
        backend: Who does the physics.
        model: See `load_model`; for backend mujoco.
        integrator: See `Simulation`.
        task: The rules, or their name.
        disturbances: What is added. A table sees as many actions before as it looks at.
        episodes: How many to play, at least 1.
        seed: Seeds the starting states.
        engine: Who runs the loop; the compiled one needs a `Policy`, and any other function is
            played in Python. The results are the same.

    Raises:
        ConfigError: A setting makes no sense.
        ModelError: The model cannot be used.
        SimulationError: The physics diverged; names episode and step.
    """
    check_backend(backend, model, integrator, disturbances.vary)
    world = World(backend, model, integrator, resolve(task), disturbances)
    return evaluate_in(world, policy, episodes, seed, engine)


def evaluate_in(
    world: World,
    policy: PolicyLike,
    episodes: int = EPISODES,
    seed: int = SEED,
    engine: Engine = "compiled",
) -> Evaluation:
    """Do what `evaluate` does; see there."""
    check_count(episodes, seed)
    poles, name = 1, GYM_ID
    if world.backend == "mujoco":
        from mjcartpole.physics.load import load_model  # noqa: PLC0415 - it imports MuJoCo

        cartpole = load_model(world.model)
        world, poles, name = world._replace(model=cartpole), cartpole.poles, cartpole.name
    if isinstance(policy, Policy | Controller):
        policy.check_fits(poles, name)
        world = world._replace(disturbances=world.disturbances.seen_by(policy.actions))
    log = play_all(world, policy, episodes, seed, engine)
    return Evaluation(world.backend, seed, tuple(log), world.disturbances)


def play_all(
    world: World,
    policy: PolicyLike,
    starts: int | npt.NDArray[np.float64],
    seed: int,
    engine: Engine = "compiled",
) -> EpisodeLog:
    """Play greedy episodes from so many starts that are drawn, or from given ones, one row each.

    Raises:
        ConfigError: There is no such engine, or the policy is a table and the task takes any push.
        SimulationError: The physics diverged; names episode and step.
    """
    act = player(policy, world.task)
    count, given = (starts, None) if isinstance(starts, int) else (len(starts), starts)
    cartpole: Any = world.model if world.backend == "mujoco" else None
    engine = choose_engine(engine, world.backend, cartpole, world.task)
    rng, _ = seeding.np_random(seed)
    chance = Chance.of(rng) if world.disturbances.are_some else None
    if engine == "compiled" and isinstance(policy, Policy):
        from mjcartpole.learning.compiled import CompiledLoop  # noqa: PLC0415 - it is heavy

        return CompiledLoop(world).play(policy, rng if given is None else given, count, chance)
    log = EpisodeLog(count)
    with contextlib.closing(make_env(*world)) as env:
        lend(env, rng, chance)
        for number in range(count):
            start = None if given is None else given[number].tolist()
            log.append(play_episode(env, act, number=number, start=start)[0])
    return log


def player(policy: PolicyLike, task: Task) -> Callable[[npt.NDArray[np.float32]], Any]:
    """Return what chooses the actions of a task by a policy.

    Raises:
        ConfigError: The policy is a table, and the task takes any push.
    """
    if task.continuous and isinstance(policy, Policy):
        raise ConfigError(f"a table chooses between two actions; {task.name} takes any push")
    return policy.push if task.continuous and isinstance(policy, Controller) else policy


def evaluate_where_trained(
    policy: Policy,
    config: TrainConfig,
    cartpole: "CartPole | None",
    engine: Engine,
    seed: int = SEED,
) -> Evaluation:
    """Play a greedy policy as it was trained: backend, model (for mujoco), integrator, task.

    Raises:
        SimulationError: The physics diverged.
    """
    world = world_of(config, cartpole, config.disturbances_after)
    return evaluate_in(world, policy, seed=seed, engine=engine)


def world_of(config: TrainConfig, cartpole: "CartPole | None", added: Disturbances) -> World:
    """Return where a config is played: its model is only for MuJoCo; with these disturbances."""
    model = cartpole if cartpole is not None and config.backend == "mujoco" else "cartpole"
    return World(config.backend, model, config.integrator, config.rules, added)


def check_count(episodes: int, seed: int) -> None:
    """Refuse numbers of episodes below 1 and seeds below 0 (ConfigError)."""
    if episodes < 1:
        raise ConfigError(f"episodes must be a whole number from 1 up, not {episodes}")
    if seed < 0:
        raise ConfigError(f"seed must be a whole number from 0 up, not {seed}")
