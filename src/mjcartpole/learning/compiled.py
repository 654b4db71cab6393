"""The compiled engine: episodes in chunks, so that whoever waits can look, stop and save."""

import functools
import logging
from collections.abc import Callable, Iterator, Sequence
from typing import Final

import numba
import numpy as np
import numpy.typing as npt
from numba.core import config, event

from mjcartpole.disturbances.contexts import Chance
from mjcartpole.disturbances.disturbances import NONE
from mjcartpole.envs.backend import Backend, World
from mjcartpole.errors import SimulationError
from mjcartpole.learning import kernels
from mjcartpole.learning.compiling import compiling
from mjcartpole.learning.discretizer import Grid
from mjcartpole.learning.episodes import EpisodeLog
from mjcartpole.learning.fitted import Fitted
from mjcartpole.learning.kinds import Rules
from mjcartpole.learning.learner import Learner
from mjcartpole.learning.linking import link
from mjcartpole.learning.loop import in_episode
from mjcartpole.learning.policy import Policy
from mjcartpole.learning.worlds import Worlds
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.library import libmujoco
from mjcartpole.physics.load import load_model
from mjcartpole.physics.simulation import check_sane
from mjcartpole.task import CARTPOLE_V1, Task

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

    def __init__(self, world: World, fitted: Fitted | None = None) -> None:
        """Load the model of a world whose backend is not `unavailable`.

        A model that was `fitted` takes the place of the world; nothing disturbs that one.

        Raises:
            ModelError: The model cannot be used.
            ConfigError: A disturbance makes no sense for it.
        """
        backend, model, integrator, task, disturbances = world
        cartpole = load_model(model) if backend == "mujoco" else None
        self._worlds = Worlds(cartpole, integrator, task, NONE if fitted else disturbances, fitted)
        self._task, self._rules = task, _rules(task)
        size = self._worlds.size
        self._chunk = CHUNK_STEPS if cartpole is None else -(-CHUNK_STEPS // cartpole.substeps)
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
        env_rng: np.random.Generator,
        log: EpisodeLog,
        numbers: range,
        chance: Chance | None = None,
    ) -> Iterator[int]:
        """Do what `learn_episodes` does, chunk by chunk; yield how many episodes the log then has.

        The learner's table and generator are changed in place; `env_rng` draws the starting states,
        `chance` disturbances, where there are some. The log takes the episodes `numbers`, counted
        from 0, which decide what the schedules give; it holds those before.

        Raises:
            SimulationError: The physics diverged; names episode and step.
        """
        number = numbers.start
        while number < numbers.stop:
            self._scratch.finished[0] = number
            try:
                self._learn(learner, env_rng, log, range(number, numbers.stop), chance)
            finally:
                # A signal that came meanwhile is raised before `_run` can return anything.
                number = int(self._scratch.finished[0])
                log.extend_to(number)
            self._check(number)
            yield number

    def compile(
        self,
        learner: Learner,
        env_rng: np.random.Generator,
        log: EpisodeLog,
        chance: Chance | None = None,
    ) -> None:
        """Compile what `learn` runs, or load it from the cache, and models; nothing is learned."""
        self._worlds.prepare()
        self._learn(learner, env_rng, log, range(0), chance)

    def _learn(
        self,
        learner: Learner,
        env_rng: np.random.Generator,
        log: EpisodeLog,
        numbers: range,
        chance: Chance | None,
    ) -> None:
        kernel = kernels.learn_chunk(learner.method, self._task.reward)
        run: Callable[..., int] = functools.partial(_run, kernel)
        grid, left = _arrays(learner.discretizer.grid), self._chunk
        for first, last in self._worlds.parts(numbers.start, numbers.stop):
            arguments = (
                self._worlds.physics(chance, first),
                self._rules,
                grid,
                learner.p,
                learner.memory,
                (env_rng, learner.rng),
                (first, last, learner.episodes),
                left,
                log.storage,
                learner.visits,
                self._scratch,
            )
            run(*arguments)
            if self._worlds.vary:
                run = _for_these(kernel, arguments) if first == numbers.start else run
                left -= int(log.storage.steps[first]) if last > first else 0
            if self._scratch.finished[0] != last or left <= 0:
                return

    def play(
        self,
        policy: Policy,
        starts: np.random.Generator | npt.NDArray[np.float64],
        episodes: int,
        chance: Chance | None = None,
    ) -> EpisodeLog:
        """Play greedy episodes, as `play_episode` does.

        Starting states are drawn, or are the rows of an array; `chance` draws disturbances, where
        there are some.

        Raises:
            SimulationError: The physics diverged; names episode and step.
        """
        log = EpisodeLog(episodes)
        grid = _arrays(policy.discretizer.grid)
        common = (self._rules, grid, policy.tiles, policy.choices, starts)
        while len(log) < episodes:
            first, last = next(self._worlds.parts(len(log), episodes))
            number = _run(
                kernels.play_chunk(self._task.reward),
                self._worlds.physics(chance, first),
                *common,
                (first, last),
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
        assert self._worlds.cartpole is not None
        try:
            check_sane(tuple(state), self._worlds.cartpole.name)
        except SimulationError as error:
            raise in_episode(error, number, int(steps)) from error


def _rules(task: Task) -> Rules:
    return Rules(
        x_limit=float(task.x_limit),
        theta_limit=float(task.theta_limit),
        low=float(task.start_low),
        width=float(task.start_high - task.start_low),
        time_limit=task.time_limit,
        turns=task.turns,
    )


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


def _for_these(kernel: Callable[..., int], arguments: Sequence[object]) -> Callable[..., int]:
    """Return what a kernel is for arguments of these types: to find it takes longer than to run."""
    try:
        form: Callable[..., int] = kernel.get_overload(  # type: ignore[attr-defined]
            tuple(map(numba.typeof, arguments))
        )
    except KeyError:  # It runs without its cache.
        return functools.partial(_run, kernel)
    return form


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
