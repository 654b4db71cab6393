"""Many cart-poles in motion: `mujoco.batch`, on as many threads as pay."""

import collections
import statistics
import time
from collections.abc import Sequence
from typing import Any, Final

import mujoco
import numpy as np
import numpy.typing as npt
from mujoco import batch as mujoco_batch

from mjcartpole.cores import available_cores
from mjcartpole.errors import ConfigError
from mjcartpole.integrator import Integrator, check_integrator
from mjcartpole.physics.cartpole import CartPole, Vector
from mjcartpole.physics.simulation import LARGEST_SANE, check_sane, gave_up, stepping_model

_SHARE: Final = 4
"""Physics steps per control step that are worth a thread of their own, at the least."""

_TRIAL: Final = 7
"""Control steps of a trial; the first two wake the threads, and do not count."""

_TRIAL_COST: Final = 1 / 50
"""What trials may cost: this part of the time."""


class BatchSimulation:
    """Many copies of a cart-pole, each moved as a `Simulation` moves one, to the last bit.

    How many threads pay depends on the size of the work and on what else the machine does: a
    thread that has to be woken, or to wait for a core, costs as much as a hundred steps. So the
    time decides: now and then the next few steps are made the other way, on one thread instead of
    all or on all instead of one, and the quicker way is kept. No bit depends on it.

    Attributes:
        cartpole: What is simulated.
        state: The states, float64, shape (n, 2 or more per row), one row
            `(x, x_dot, theta, theta_dot, …)` each: m, m/s, rad, rad/s. To be read; `put` sets them.
    """

    def __init__(
        self, cartpole: CartPole, n: int, integrator: Integrator = "gym", threads: int | None = None
    ) -> None:
        """Prepare n simulations, stepped by so many threads; None: by as many as pay.

        Raises:
            ConfigError: The integrator is unknown.
        """
        check_integrator(integrator)
        self.cartpole = cartpole
        self._arguments = (cartpole, n, integrator, threads)
        self._variants: list[CartPole] = []
        self._is_explicit, self._timestep = integrator == "gym", cartpole.timestep
        joints = len(cartpole.joints)
        # The same numbers as in the batch, side by side: what numpy is quick with.
        self.state = np.zeros((n, 2 * joints))
        self._positions, self._velocities = self.state[:, 0::2], self.state[:, 1::2]
        self._sizes = np.empty_like(self.state)
        self._moves = np.empty((n, joints))
        model = stepping_model(cartpole.model, integrator)
        self._is_remembering = _remembers_more_than_its_state(model)
        chosen = threads or _largest_crew(n, cartpole.substeps)
        self._use(mujoco_batch.Batch(model, n, chosen, self._is_remembering))
        self._fresh = self._batch.state[0].copy()
        self._other: mujoco_batch.Batch | None = None
        if threads is None and chosen > 1 and not self._is_remembering:
            self._other = mujoco_batch.Batch(model, n, 1)
        self._laps: collections.deque[float] = collections.deque(maxlen=_TRIAL - 2)
        self._until_choice, self._to_beat = _TRIAL, float("nan")

    def __getstate__(self) -> tuple[Any, ...]:
        """Return what a copy needs to go on bit-equal, on threads of its own."""
        if self._is_remembering:
            raise ConfigError(
                f"many {self.cartpole.name} cannot be copied: with plugins or sleeping bodies a "
                "model remembers more than its state; copy single environments instead"
            )
        return self._arguments, self._variants, self._batch.state.copy(), self.state.copy()

    def __setstate__(self, state: tuple[Any, ...]) -> None:
        arguments, variants, rows, states = state
        BatchSimulation.__init__(self, *arguments)
        if variants:
            self.set_models(variants)
        self._batch.state[...] = rows
        self.state[...] = states

    @property
    def threads(self) -> int:
        """How many threads step at present."""
        return int(self._batch.nthread)

    def set_models(self, cartpoles: Sequence[CartPole]) -> None:
        """Let each go on by a model of its own that differs by its numbers only."""
        integrator = self._arguments[2]
        made = {id(each): stepping_model(each.model, integrator) for each in cartpoles}
        self._variants = list(cartpoles)
        models = [made[id(each)] for each in cartpoles]
        for batch in filter(None, (self._batch, self._other)):
            batch.set_models(models)

    def apply(self, forces: Vector) -> None:
        """Apply forces to the carts until further ones come, N along the rail, shape (n,)."""
        self._applied[...] = forces

    def set_state(self, ids: npt.NDArray[np.intp] | slice, states: Vector) -> None:
        """Put some cart-poles into states, one row each; nothing of their past remains."""
        if self._is_remembering:
            everyone = np.arange(len(self.state))
            self._batch.reset(everyone[ids], stage=int(mujoco.mjtStage.mjSTAGE_NONE))
        else:
            # The row is all there is, and to copy it is a hundred times quicker than `reset`.
            self._batch.state[ids] = self._fresh
        for joint, (qpos, qvel) in enumerate(self._columns):
            qpos[ids], qvel[ids] = states[:, 2 * joint], states[:, 2 * joint + 1]
        self.state[ids] = states

    def step(self, controls: Vector) -> None:
        """Advance one control step, by controls of shape (n,).

        Raises:
            SimulationError: MuJoCo gave up on a model.
        """
        self._control[...] = controls
        started = time.perf_counter() if self._other else 0.0
        try:
            if self._is_explicit:
                self._explicit_euler()
            else:
                self._own_integrator()
        except mujoco_batch.SimulationError as error:
            raise gave_up(self.cartpole, error) from error
        if self._other:
            self._laps.append(time.perf_counter() - started)
            self._until_choice -= 1
            if not self._until_choice:
                self._choose(self._other)

    def sizes(self) -> Vector:
        """Return absolute values of `state`; the next call overwrites them.

        Raises:
            SimulationError: A state is NaN or beyond all bounds.
        """
        sizes = np.abs(self.state, out=self._sizes)
        # One look at the largest number finds NaN and infinity too.
        if not sizes.max() < LARGEST_SANE:
            index = int(np.flatnonzero(~(sizes < LARGEST_SANE).all(axis=1))[0])
            name = f"{self.cartpole.name} (environment {index} of {len(sizes)})"
            check_sane(tuple(self.state[index].tolist()), name)
        return sizes

    def _use(self, batch: mujoco_batch.Batch) -> None:
        """Step with this batch, through views of what is read and written in each step."""
        self._batch = batch
        qpos, qvel = batch.bind("qpos"), batch.bind("qvel")
        # The batch keeps one row per simulation; these are columns of it, shape (n,).
        self._columns = [(qpos[:, joint], qvel[:, joint]) for joint in self.cartpole.joints]
        self._control = batch.bind("ctrl")[:, 0]
        self._applied = batch.bind("qfrc_applied")[:, self.cartpole.slider]

    def _explicit_euler(self) -> None:
        """Move positions by the old velocities, velocities as MuJoCo says."""
        for _ in range(self.cartpole.substeps):
            np.multiply(self._velocities, self._timestep, out=self._moves)
            self._positions += self._moves
            self._batch.step()
            for joint, (qpos, qvel) in enumerate(self._columns):
                qpos[...] = self._positions[:, joint]
                self._velocities[:, joint] = qvel

    def _own_integrator(self) -> None:
        self._batch.step(nstep=self.cartpole.substeps)
        for joint, (qpos, qvel) in enumerate(self._columns):
            self._positions[:, joint], self._velocities[:, joint] = qpos, qvel

    def _choose(self, other: mujoco_batch.Batch) -> None:
        """Begin a trial of the other batch; or end one, and go on with the quicker of the two."""
        took = statistics.median(self._laps)
        is_trial = self._to_beat == self._to_beat
        if not is_trial or took > self._to_beat:
            other.state[...] = self._batch.state
            self._other = self._batch
            self._use(other)
        if is_trial:
            worse = min(max(1.0, took / self._to_beat), 100.0)
            self._until_choice, self._to_beat = int(_TRIAL * worse / _TRIAL_COST), float("nan")
        else:
            self._until_choice, self._to_beat = _TRIAL, took
        self._laps.clear()


def _largest_crew(n: int, substeps: int) -> int:
    """Return how many threads may have enough to do: all cores', but for few simulations."""
    return max(1, min(available_cores(), n, n * substeps // _SHARE))


def _remembers_more_than_its_state(model: mujoco.MjModel) -> bool:
    """Return whether a simulation needs an MjData: its state is not all there is."""
    remembering = int(mujoco.mjtEnableBit.mjENBL_SLEEP) | int(mujoco.mjtEnableBit.mjENBL_IPC)
    return bool(model.opt.enableflags & remembering) or model.nplugin > 0
