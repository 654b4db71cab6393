"""The compiled engine: episodes in chunks, so that whoever waits can look, stop and save."""

import logging
from collections.abc import Callable, Iterator
from typing import Final, NamedTuple, Self

import numpy as np
import numpy.typing as npt
from numba.core import config, event

from mjcartpole.envs.backend import Backend
from mjcartpole.errors import SimulationError
from mjcartpole.integrator import Integrator
from mjcartpole.learning import kernels
from mjcartpole.learning.compiling import compiling
from mjcartpole.learning.discretizer import Discretizer, Grid
from mjcartpole.learning.episodes import EpisodeLog
from mjcartpole.learning.fitted import Fitted
from mjcartpole.learning.learner import Learner
from mjcartpole.learning.loop import in_episode
from mjcartpole.learning.policy import Policy
from mjcartpole.learning.stepping import GymPhysics, MujocoPhysics, Physics, Rules, link
from mjcartpole.physics.bodies import starting_state
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.cartpole_v1 import FORCE
from mjcartpole.physics.library import libmujoco
from mjcartpole.physics.load import ModelLike, load_model
from mjcartpole.physics.simulation import Simulation, check_sane
from mjcartpole.task import CARTPOLE_V1, Task, state_names

CHUNK_STEPS: Final = 50_000
"""Physics steps between two looks at what else is to be done: a twentieth of a second in MuJoCo."""

LEAST_MEMORY: Final = 2**20
"""Bytes. Where MuJoCo runs out of its memory it ends the process, unless Python has called it."""

_log = logging.getLogger("mjcartpole")


def unavailable(
    backend: Backend, cartpole: CartPole | None = None, task: Task = CARTPOLE_V1
) -> str:
    """Return why the compiled engine cannot run here; nothing if it can."""
    if config.DISABLE_JIT:  # type: ignore[attr-defined]
        return "NUMBA_DISABLE_JIT is set"
    if cartpole is not None and cartpole.model.narena < LEAST_MEMORY:
        return f"{cartpole.name} gives MuJoCo so little memory that it may run out of it"
    if why_not := kernels.why_not_compilable(task.reward):
        return f"the reward of {task.name} {why_not}"
    return link(libmujoco()) if backend == "mujoco" else ""


class CompiledLoop:
    """Plays episodes of one backend, with or without learning."""

    def __init__(
        self,
        backend: Backend,
        model: ModelLike,
        integrator: Integrator,
        task: Task = CARTPOLE_V1,
        fitted: Fitted | None = None,
    ) -> None:
        """Load the model.

        Args:
            backend: Who does the physics. It must not be `unavailable`.
            model: See `load_model`; for backend mujoco.
            integrator: See `Simulation`; for backend mujoco.
            task: The rules.
            fitted: Plays in this model of the world instead of in the world.

        Raises:
            ModelError: The model cannot be used.
        """
        self._simulation = (
            Simulation(load_model(model), integrator) if backend == "mujoco" else None
        )
        self._memory = _Memory.of(self._simulation, task)
        self._physics = _physics(self._simulation, self._memory, task, fitted)
        self._task, self._rules = task, _rules(task)
        size = self._simulation.size if self._simulation else len(state_names())
        self._chunk = _control_steps(self._simulation)
        limit = task.time_limit
        self._scratch = kernels.Scratch(
            states=np.zeros(limit + 1, np.int64),
            actions=np.zeros(limit, np.int64),
            rewards=np.zeros(limit, np.float64),
            failure=np.full(1 + size, -1.0),
            finished=np.zeros(1, np.int64),
        )

    def learn(
        self,
        learner: Learner,
        discretizer: Discretizer,
        env_rng: np.random.Generator,
        log: EpisodeLog,
        numbers: range,
    ) -> Iterator[int]:
        """Do what `learn_episodes` does, chunk by chunk.

        Args:
            learner: Learns; its table and generator are changed in place.
            discretizer: From observations to the learner's states.
            env_rng: Draws the starting states.
            log: Takes the episodes; it holds those before `numbers`.
            numbers: Which episodes, counted from 0: they decide what the schedules give.

        Yields:
            The number of episodes in the log.

        Raises:
            SimulationError: The physics diverged; names episode and step.
        """
        number = numbers.start
        while number < numbers.stop:
            self._scratch.finished[0] = number
            try:
                self._learn(learner, discretizer, env_rng, log, number, numbers.stop)
            finally:
                # A signal that came meanwhile is raised before `_run` can return anything.
                number = int(self._scratch.finished[0])
                log.extend_to(number)
            self._check(number)
            yield number

    def compile(
        self,
        learner: Learner,
        discretizer: Discretizer,
        env_rng: np.random.Generator,
        log: EpisodeLog,
    ) -> None:
        """Compile what `learn` runs, or load it from the cache; nothing is learned."""
        self._learn(learner, discretizer, env_rng, log, 0, 0)

    def _learn(
        self,
        learner: Learner,
        discretizer: Discretizer,
        env_rng: np.random.Generator,
        log: EpisodeLog,
        start: int,
        stop: int,
    ) -> None:
        _run(
            kernels.learn_chunk(learner.method, self._task.reward),
            self._physics,
            self._rules,
            _arrays(discretizer.grid),
            learner.p,
            learner.memory,
            (env_rng, learner.rng),
            (start, stop, learner.episodes),
            self._chunk,
            log.storage,
            learner.visits,
            self._scratch,
        )

    def play(
        self, policy: Policy, starts: np.random.Generator | npt.NDArray[np.float64], episodes: int
    ) -> EpisodeLog:
        """Play greedy episodes, as `play_episode` does.

        Args:
            policy: Acts.
            starts: Draws the starting states, or has them as rows.
            episodes: How many.

        Raises:
            SimulationError: The physics diverged; names episode and step.
        """
        log = EpisodeLog(episodes)
        grid = _arrays(policy.discretizer.grid)
        common = (self._physics, self._rules, grid, policy.tiles, policy.choices, starts)
        while len(log) < episodes:
            number = _run(
                kernels.play_chunk(self._task.reward),
                *common,
                (len(log), episodes),
                self._chunk,
                log.storage,
                self._scratch.failure,
            )
            log.extend_to(number)
            self._check(number)
        return log

    def _check(self, number: int) -> None:
        """Raise what a diverging simulation has left behind."""
        steps, *state = self._scratch.failure.tolist()
        if steps < 0:
            return
        self._scratch.failure[0] = -1.0
        assert self._simulation is not None
        try:
            check_sane(tuple(state), self._simulation.cartpole.name)
        except SimulationError as error:
            raise in_episode(error, number, int(steps)) from error


class _Memory(NamedTuple):
    """Arrays that compiled code is given the addresses of; see `MujocoPhysics`."""

    joints: npt.NDArray[np.int64]
    seen: npt.NDArray[np.float64]
    moved: npt.NDArray[np.float64]
    start: npt.NDArray[np.float64]

    @classmethod
    def of(cls, simulation: Simulation | None, task: Task) -> Self:
        if simulation is None:
            return cls(np.zeros(0, np.int64), *(np.zeros(0),) * 3)
        joints = np.array(simulation.cartpole.joints, np.int64)
        start = starting_state(simulation.cartpole, task)[0::2].copy()
        return cls(joints, np.zeros(2 * joints.size), np.zeros(joints.size), start)


def _physics(
    simulation: Simulation | None, memory: _Memory, task: Task, fitted: Fitted | None = None
) -> Physics:
    if fitted is not None:
        return fitted._replace(start=float(task.start_angle))
    if simulation is None:
        return GymPhysics(-FORCE, FORCE, float(task.start_angle))
    cartpole, model, data = simulation.cartpole, simulation.model, simulation.data
    left, right = cartpole.controls
    return MujocoPhysics(
        model=model._address,
        data=data._address,
        qpos=data.qpos.ctypes.data,
        qvel=data.qvel.ctypes.data,
        ctrl=data.ctrl.ctypes.data,
        joints=memory.joints.ctypes.data,
        n_joints=len(memory.joints),
        left=left,
        right=right,
        timestep=float(model.opt.timestep),
        substeps=cartpole.substeps,
        explicit=simulation.integrator == "gym",
        seen=memory.seen.ctypes.data,
        moved=memory.moved.ctypes.data,
        start=memory.start.ctypes.data,
    )


def _rules(task: Task) -> Rules:
    return Rules(
        x_limit=float(task.x_limit),
        theta_limit=float(task.theta_limit),
        low=float(task.start_low),
        width=float(task.start_high - task.start_low),
        time_limit=task.time_limit,
        turns=task.turns,
    )


def _control_steps(simulation: Simulation | None) -> int:
    """How many control steps make a chunk."""
    return CHUNK_STEPS if simulation is None else -(-CHUNK_STEPS // simulation.cartpole.substeps)


def _arrays(grid: Grid) -> Grid:
    """The grid as arrays: tuples of each length would be compiled anew."""
    return Grid(
        np.array(grid.dimensions, np.int64),
        np.array(grid.bins, np.int64),
        np.array(grid.low, np.float64),
        np.array(grid.high, np.float64),
        np.array(grid.width, np.float64),
        grid.folding,
    )


class _Announcer(event.Listener):
    """Says once per process that the waiting is for the compiler."""

    said = False

    def __init__(self) -> None:
        self._depth = 0

    def on_start(self, event: event.Event) -> None:
        self._depth += 1
        compiling.add(self)
        if not _Announcer.said:
            _Announcer.said = True
            _log.info(
                "compiling the training loop, which takes a few seconds once; "
                "later runs load it from the cache"
            )

    def on_end(self, event: event.Event) -> None:
        # What the loop calls is compiled in between, each with a start and an end of its own.
        self._depth -= 1
        if self._depth <= 0:
            compiling.discard(self)


def _run(kernel: Callable[..., int], *arguments: object) -> int:
    announcer = _Announcer()
    with event.install_listener("numba:compile", announcer):
        try:
            return kernel(*arguments)
        except Exception:
            # A kernel raises nothing itself. Its cache cannot be read or written (damaged, a full
            # disk; numba lets through OSError, EOFError and what pickle raises): go on without.
            return kernels.uncached(kernel)(*arguments)
        finally:
            compiling.discard(announcer)
