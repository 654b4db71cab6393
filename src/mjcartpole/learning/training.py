"""From a `TrainConfig` to a `TrainResult`."""

import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium.utils import seeding

from mjcartpole.disturbances.contexts import Chance
from mjcartpole.envs.backend import make_env
from mjcartpole.errors import ConfigError, SimulationError
from mjcartpole.learning.config import TrainConfig
from mjcartpole.learning.dream import Dream
from mjcartpole.learning.dynamics import dynamics_of
from mjcartpole.learning.engine import Engine, check_engine, choose_engine
from mjcartpole.learning.episodes import Columns, EpisodeLog
from mjcartpole.learning.evaluation import evaluate_where_trained, world_of
from mjcartpole.learning.greedy_curve import CURVE_SEED, GreedyPoint, first_reached
from mjcartpole.learning.learner import Learner
from mjcartpole.learning.loop import learn_episodes, lend
from mjcartpole.learning.policy import Policy
from mjcartpole.learning.training_grid import training_grid
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.task import CONTROL_STEP, N_ACTIONS


@dataclass(frozen=True, eq=False, repr=False)
class TrainResult:
    """What a training, or the part of it that was done, has come to.

    Attributes:
        config: What was asked for.
        policy: The greedy policy of the final table.
        episodes: One record per episode that was finished.
        seconds: Time it took, without that for compiling the loop and for greedy episodes.
        evaluations: The greedy evaluations in its midst, where the config asks for them.
        seen: How many episodes and steps of the world a model was fitted to, in which all episodes
            above were played; None where they were played in the world itself.
        visits: How often each action was taken in each state, shape (*bins, 2): of several tilings
            in that which is not moved, of nodes in the nearest. None where it went on from a
            checkpoint of a version that did not count.
    """

    config: TrainConfig
    policy: Policy
    episodes: EpisodeLog
    seconds: float
    evaluations: tuple[GreedyPoint, ...] = ()
    seen: tuple[int, int] | None = None
    visits: npt.NDArray[np.int64] | None = None

    @property
    def q_table(self) -> npt.NDArray[np.float64]:
        """Action values, shape (*bins, 2)."""
        return self.policy.q_table

    @property
    def returns(self) -> npt.NDArray[np.float64]:
        """Undiscounted return of each episode, shape (episodes,)."""
        return self.episodes.columns.totals

    @property
    def steps(self) -> int:
        """Steps of all episodes."""
        return int(self.episodes.columns.steps.sum())

    @property
    def solved(self) -> GreedyPoint | None:
        """The first evaluation whose mean reached `until`, or else the task's reward threshold."""
        return first_reached(self.evaluations, self.config.solved_at)

    def __repr__(self) -> str:
        return f"TrainResult({self.config!r}, {self.episodes!r}, {self.policy!r})"

    def _repr_html_(self) -> str:
        from mjcartpole.media.curve_plot import curve_of  # noqa: PLC0415 - notebooks only
        from mjcartpole.media.notebook import with_picture, with_plot  # noqa: PLC0415

        if not len(self.returns):
            return with_picture(repr(self), None)
        greedy, rules = (
            [(point.episodes, point.mean) for point in self.evaluations],
            self.config.rules,
        )
        return with_plot(
            repr(self),
            lambda: curve_of(
                self.config.method, self.returns, greedy, rules.return_span, rules.reward_threshold
            ),
        )


@dataclass(frozen=True, eq=False)
class Snapshot:
    """All that a training needs to go on, between two episodes.

    Attributes:
        memory: All that the learner has learned: flat arrays by name.
        env_rng: State of the generator that draws starting states.
        learner_rng: State of the learner's generator.
        columns: The episodes so far, see `EpisodeLog`.
        seconds: Time they took.
        evaluations: The greedy evaluations so far.
        visits: See `TrainResult`; flat.
        chance_rng: State of the generator that draws disturbances, where there are some.
    """

    memory: dict[str, npt.NDArray[Any]] = field(repr=False)
    env_rng: dict[str, Any] = field(repr=False)
    learner_rng: dict[str, Any] = field(repr=False)
    columns: Columns = field(repr=False)
    seconds: float
    evaluations: tuple[GreedyPoint, ...] = field(default=(), repr=False)
    visits: npt.NDArray[np.int64] | None = field(default=None, repr=False)
    chance_rng: dict[str, Any] | None = field(default=None, repr=False)


class Training:
    """A training that can be watched, left after any chunk of episodes, and gone on with.

    Iterating `run()` does the work; `result()` says what has been learned so far.

    Attributes:
        config: What is trained.
        engine: Who runs the loop.
        discretizer: From observations to the learner's states.
        learner: Learns.
        log: The episodes that are finished.
        evaluations: The greedy evaluations so far.
    """

    engine: Engine

    def __init__(
        self,
        config: TrainConfig,
        env: gymnasium.Env[Any, Any] | None = None,
        *,
        engine: Engine = "compiled",
        cartpole: CartPole | None = None,
    ) -> None:
        """Make the environment and the learner.

        An environment of one's own takes the place of the config's, with the Python engine; that
        runs as well where the compiled one cannot. The config's model is given if it is loaded.

        Raises:
            ConfigError: There is no such engine, the config's grid is for another number of
                poles, what is to be mirrored is not symmetric, or greedy episodes or a plan are
                asked for in an environment of one's own.
            ModelError: The model cannot be used.
        """
        check_engine(engine)
        self.config = config
        if config.backend == "gym":
            cartpole = None
        elif cartpole is None and env is None:
            cartpole = config.load_model()
        self.discretizer = training_grid(config, cartpole, env)
        self.learner = Learner(config, self.discretizer)
        self.log = EpisodeLog(config.episodes)
        self.evaluations: tuple[GreedyPoint, ...] = ()
        self._all_counted = True
        self._cartpole = cartpole
        self._env_rng, _ = seeding.np_random(config.seed)
        self._chance = Chance.of(self._env_rng) if config.disturbances.are_some else None
        self._seconds = 0.0
        if env is None:
            self._open(engine)
        else:
            self._take(env)

    def _take(self, env: gymnasium.Env[Any, Any]) -> None:
        """Train in an environment of one's own, which not everything can be done in."""
        if self.config.evaluation_period is not None:
            raise ConfigError("evaluate_every and until are for the config's own environment")
        if self.learner.plans:
            raise ConfigError(
                f"method {self.config.method!r} needs equations, which an environment of one's own "
                "does not show; take the config's own"
            )
        self.engine, self._env = "python", env

    def _open(self, engine: Engine) -> None:
        """Make what episodes are played in: a compiled loop, or an environment."""
        config = self.config
        self._world = world_of(config, self._cartpole, config.disturbances)
        self.engine = choose_engine(engine, config.backend, self._cartpole, config.rules)
        if self.engine == "compiled":
            from mjcartpole.learning.compiled import CompiledLoop  # noqa: PLC0415 - it is heavy

            self._loop = CompiledLoop(self._world)
        else:
            self._env = make_env(*self._world)

    def run(self) -> Iterator[int]:
        """Train to the end; the clock runs neither while the loop is compiled nor in evaluations.

        Yields:
            The number of finished episodes, after each or after some thousands of steps.

        Raises:
            SimulationError: The physics diverged; names episode and step.
        """
        run = self._run_compiled if self.engine == "compiled" else self._run_python
        self._imagine()
        if self.engine == "compiled":
            self._loop.compile(self.learner, self._env_rng, self.log, self._chance)
        self._plan()
        self._evaluate_if_due()
        started = time.perf_counter() - self._seconds
        while not self.is_over:
            for finished in run(range(len(self.log), self._next_evaluation())):
                self._seconds = time.perf_counter() - started
                if self._evaluate_if_due():
                    started = time.perf_counter() - self._seconds
                yield finished
        if self.engine == "python":
            self._env.close()

    def _imagine(self) -> None:
        """Let a method that does so fit a model to the world; its episodes are played in there."""
        if not self.learner.dreams:
            return
        started = time.perf_counter()
        world = self._env if self.engine == "python" else make_env(*self._world)
        lend(world, self._env_rng, self._chance)
        cartpole, rules = self._cartpole, self.config.rules
        fitted = self.learner.imagine(world, cartpole.control_step if cartpole else CONTROL_STEP)
        world.close()
        if self.engine == "compiled":
            self._loop = type(self._loop)(self._world, fitted)
        else:
            self._env = Dream(fitted, rules)
        self._seconds += time.perf_counter() - started

    def _plan(self) -> None:
        """Let a method that does so learn from the equations, before the first episode."""
        if self.learner.plans and not len(self.log):
            started = time.perf_counter()
            self.learner.plan(
                dynamics_of(self._cartpole, self.config.integrator, self.config.rules)
            )
            self._seconds = time.perf_counter() - started

    @property
    def is_over(self) -> bool:
        """Whether nothing is left to train: all episodes are done, or `until` is reached."""
        until = self.config.until
        return len(self.log) == self.config.episodes or (
            until is not None and first_reached(self.evaluations, until) is not None
        )

    def _next_evaluation(self) -> int:
        """Return after how many episodes the next evaluation is due, or the training over."""
        period = self.config.evaluation_period or self.config.episodes
        return min((len(self.log) // period + 1) * period, self.config.episodes)

    def _evaluate_if_due(self) -> bool:
        """Play greedy episodes where it is time; the training's own generators draw nothing."""
        done, period = len(self.log), self.config.evaluation_period
        if period is None or done % period or done == len(self.evaluations) * period:
            return False
        try:
            played = evaluate_where_trained(
                self._policy(), self.config, self._cartpole, self.engine, CURVE_SEED
            )
        except SimulationError as error:
            raise SimulationError(f"evaluation after {done:,} episodes: {error}") from error
        steps = int(self.log.columns.steps.sum())
        point = GreedyPoint(done, steps, self._seconds, played.mean, played.minimum)
        self.evaluations = (*self.evaluations, point)
        return True

    def _run_compiled(self, numbers: range) -> Iterator[int]:
        return self._loop.learn(self.learner, self._env_rng, self.log, numbers, self._chance)

    def _run_python(self, numbers: range) -> Iterator[int]:
        lend(self._env, self._env_rng, self._chance, numbers.start)
        for episode in learn_episodes(self._env, self.learner, numbers):
            self.log.append(episode)
            yield len(self.log)

    def result(self) -> TrainResult:
        """What has been learned so far; later episodes do not change it."""
        visits = self._visits()
        return TrainResult(
            config=self.config,
            policy=self._policy(),
            episodes=self.log.copy(),
            seconds=self._seconds,
            evaluations=self.evaluations,
            seen=self.learner.seen,
            visits=None if visits is None else visits.reshape(*self.discretizer.bins, N_ACTIONS),
        )

    def _policy(self) -> Policy:
        return Policy.learned(self.discretizer, self.learner.greedy_values)

    def snapshot(self) -> Snapshot:
        """All that is needed to go on from here; later episodes do not change it."""
        return Snapshot(
            memory={name: a.copy() for name, a in self.learner.memory._asdict().items()},
            env_rng=dict(self._env_rng.bit_generator.state),
            learner_rng=dict(self.learner.rng.bit_generator.state),
            columns=self.log.copy().columns,
            seconds=self._seconds,
            evaluations=self.evaluations,
            visits=self._visits(),
            chance_rng=dict(self._chance.rng.bit_generator.state) if self._chance else None,
        )

    def _visits(self) -> npt.NDArray[np.int64] | None:
        return self.learner.visits.copy() if self._all_counted else None

    def restore(self, snapshot: Snapshot) -> None:
        """Go on from a snapshot of a training with the same config."""
        for name, array in snapshot.memory.items():
            getattr(self.learner.memory, name)[:] = array
        self._env_rng.bit_generator.state = snapshot.env_rng
        self.learner.rng.bit_generator.state = snapshot.learner_rng
        if self._chance and snapshot.chance_rng:
            self._chance.rng.bit_generator.state = snapshot.chance_rng
        self.log = EpisodeLog.of(snapshot.columns, self.config.episodes)
        self._seconds = snapshot.seconds
        self.evaluations = snapshot.evaluations
        self._all_counted = snapshot.visits is not None
        if snapshot.visits is not None:
            self.learner.visits[:] = snapshot.visits


def train(config: TrainConfig | None = None, *, engine: Engine = "compiled") -> TrainResult:
    """Train a Q-table; nothing is written.

    >>> result = train(TrainConfig.preset("tuned", backend="gym", seed=3, episodes=5))
    >>> result.q_table.shape
    (1, 3, 6, 8, 2)
    >>> len(result.returns)
    5

    Args:
        config: What to train; the preset `tuned` if left out.
        engine: Who runs the loop, `compiled` or `python`: the results are the same, bit for bit.

    Raises:
        ConfigError: There is no such engine.
        ModelError: The model cannot be used.
        SimulationError: The physics diverged.
    """
    training = Training(config or TrainConfig(), engine=engine)
    for _ in training.run():
        pass
    return training.result()
