"""State in, control in, state out: a cart-pole moved by MuJoCo, one control step at a time."""

import copy
from collections.abc import Callable, Iterator, Sequence

import mujoco
import numpy as np
import numpy.typing as npt

from mjcartpole import task
from mjcartpole.errors import ConfigError, SimulationError
from mjcartpole.integrator import Integrator, check_integrator
from mjcartpole.physics.cartpole import CartPole, Vector
from mjcartpole.physics.library import one_line

State = tuple[float, ...]
"""`(x, x_dot, theta, theta_dot)`: m, m/s, rad, rad/s; two more values for each further pole."""

LARGEST_SANE: float = mujoco.mjMAXVAL
"""MuJoCo calls a coordinate beyond this bad (1e10)."""

FARTHEST_SANE: float = 2 * LARGEST_SANE
"""Two values that differ by more are not both sane."""


class Simulation:
    """One cart-pole in motion.

    `gym` moves positions by the *old* velocities, `q_next = q + h v`, as CartPole-v1 does;
    velocities move by the acceleration that MuJoCo computes. `mujoco` leaves all to the
    integrator that the file names.

    Attributes:
        cartpole: What is simulated.
        model: The cart-pole's model as it is stepped (see `stepping_model`).
        data: MuJoCo's data; its qpos and qvel are the state.
        step: `step(control)` advances one control step and returns the new state as floats. It is
            a closure over the arrays, since looking them up costs as much as the physics.
        size: How many values a state has.
    """

    def __init__(self, cartpole: CartPole, integrator: Integrator = "gym") -> None:
        """Prepare a simulation; the state starts at the model's reference position.

        Raises:
            ConfigError: The integrator is unknown.
        """
        check_integrator(integrator)
        self._take(cartpole, integrator, mujoco.MjData(stepping_model(cartpole.model, integrator)))

    def _take(self, cartpole: CartPole, integrator: Integrator, data: mujoco.MjData) -> None:
        self.cartpole, self.integrator = cartpole, integrator
        self.model, self.data = data.model, data
        self.size = 2 * len(cartpole.joints)
        self._qpos, self._qvel = _floats(self.data.qpos), _floats(self.data.qvel)
        self._places = tuple(zip(range(0, self.size, 2), cartpole.joints, strict=True))
        self._timer = self.data.timer[int(mujoco.mjtTimer.mjTIMER_STEP)]
        make_step = _explicit_euler if integrator == "gym" else _own_integrator
        self.step: Callable[[float], State] = make_step(self.model, self.data, cartpole)

    def __getstate__(self) -> tuple[CartPole, Integrator, mujoco.MjData]:
        """Return what a copy needs to go on bit-equal: MuJoCo's data bring their model along."""
        return self.cartpole, self.integrator, self.data

    def __setstate__(self, state: tuple[CartPole, Integrator, mujoco.MjData]) -> None:
        self._take(*state)

    def __copy__(self) -> "Simulation":
        """Return a copy in the same state that moves on its own."""
        return copy.deepcopy(self)

    @property
    def state(self) -> Vector:
        """The state `(x, x_dot, theta, theta_dot, …)`, shape (size,), a copy."""
        return np.array(_state_of(self._qpos, self._qvel, self.cartpole.joints))

    @state.setter
    def state(self, state: npt.ArrayLike) -> None:
        """Put the cart-pole into a state, shape (size,); nothing of its past remains.

        Raises:
            ConfigError: The state has another shape.
        """
        values = np.asarray(state, dtype=np.float64)
        if values.shape != (self.size,):
            names = ", ".join(task.state_names(self.cartpole.poles))
            raise ConfigError(
                f"a state has {self.size} values ({names}), not the shape {values.shape}"
            )
        self.set_state(values.tolist())

    def set_state(self, state: Sequence[float]) -> None:
        """Put the cart-pole into a state given as plain floats, as the `state` setter does."""
        # Where steps were timed, mj_resetData words a report of the timers, as slowly as two
        # steps, for a log that is off. It clears the timers in any case.
        self._timer.number = 0
        mujoco.mj_resetData(self.model, self.data)
        for place, joint in self._places:
            self._qpos[joint], self._qvel[joint] = state[place], state[place + 1]

    def steps(self, states: Vector, controls: Vector) -> Vector:
        """Return the states after one control step from each of many, shape (n, size)."""
        after = np.empty_like(states)
        for index, control in self._each(states, controls):
            after[index] = self.step(control)
        return after

    def accelerations(self, states: Vector, controls: Vector) -> Vector:
        """Return MuJoCo's `(x_acc, theta_acc, …)` in each of many states, shape (n, size / 2).

        They are in m/s^2 and rad/s^2.
        """
        where = list(self.cartpole.joints)
        found = np.empty((len(states), len(where)))
        for index, control in self._each(states, controls):
            self.data.ctrl[0] = control
            mujoco.mj_forward(self.model, self.data)
            found[index] = self.data.qacc[where]
        return found

    def _each(self, states: Vector, controls: Vector) -> Iterator[tuple[int, float]]:
        """Put the cart-pole into one state after the other; yield its number and its control."""
        for index, (state, control) in enumerate(zip(states, controls.tolist(), strict=True)):
            self.state = state
            yield index, control


def stepping_model(model: mujoco.MjModel, integrator: Integrator) -> mujoco.MjModel:
    """Return a copy of a model as it is stepped; changed options leave no value stale.

    MuJoCo answers a NaN by silently starting over from the reference position, a pole that
    stands by magic. That is switched off, so that the NaN can be seen and reported.

    It also looks for contacts and solves constraints where a model can have none, which is a
    quarter of the time of a step; switched off there, the same bits come sooner.
    """
    disable = mujoco.mjtDisableBit
    stepped = copy.copy(model)
    stepped.opt.disableflags |= int(disable.mjDSBL_AUTORESET)
    if nothing_can_touch(model):
        stepped.opt.disableflags |= int(disable.mjDSBL_CONTACT)
        if _nothing_else_constrains(model):
            stepped.opt.disableflags |= int(disable.mjDSBL_CONSTRAINT)
    if integrator == "gym":
        # Explicit Euler takes the acceleration as it is, so no implicit damping either.
        stepped.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
        stepped.opt.disableflags |= int(disable.mjDSBL_EULERDAMP)
    return stepped


def nothing_can_touch(model: mujoco.MjModel) -> bool:
    """Return whether no two geoms of a model can ever be in contact, wherever they are."""
    pairs = np.bitwise_and.outer(model.geom_contype, model.geom_conaffinity)
    return not (pairs.any() or model.npair or model.nflex)


def _nothing_else_constrains(model: mujoco.MjModel) -> bool:
    """Return whether a model has no equality, no limit and no dry friction."""
    constraints = (
        model.jnt_limited,
        model.dof_frictionloss,
        model.tendon_limited,
        model.tendon_frictionloss,
    )
    return not (model.neq or any(values.any() for values in constraints))


def _floats(array: Vector) -> "memoryview[float]":
    """Return a view of MuJoCo's array that reads and writes single floats several times faster."""
    return array.data.cast("B").cast("d")


def _explicit_euler(
    model: mujoco.MjModel, data: mujoco.MjData, cartpole: CartPole
) -> Callable[[float], State]:
    qpos, qvel, ctrl = _floats(data.qpos), _floats(data.qvel), _floats(data.ctrl)
    slider, hinge, joints = cartpole.slider, cartpole.hinges[0], cartpole.joints
    h, mj_step = float(model.opt.timestep), mujoco.mj_step

    def step(control: float) -> State:
        ctrl[0] = control
        x = qpos[slider] + h * qvel[slider]
        theta = qpos[hinge] + h * qvel[hinge]
        try:
            mj_step(model, data)
        except mujoco.FatalError as error:
            raise gave_up(cartpole, error) from error
        qpos[slider] = x
        qpos[hinge] = theta
        return x, qvel[slider], theta, qvel[hinge]

    def step_poles(control: float) -> State:
        ctrl[0] = control
        positions = [qpos[joint] + h * qvel[joint] for joint in joints]
        try:
            mj_step(model, data)
        except mujoco.FatalError as error:
            raise gave_up(cartpole, error) from error
        for joint, position in zip(joints, positions, strict=True):
            qpos[joint] = position
        return _state_of(qpos, qvel, joints)

    # One pole is the usual case; written out, it takes half the time.
    return _repeated(step if cartpole.poles == 1 else step_poles, cartpole.substeps)


def _repeated(step: Callable[[float], State], times: int) -> Callable[[float], State]:
    def several_steps(control: float) -> State:
        for _ in range(times - 1):
            step(control)
        return step(control)

    return step if times == 1 else several_steps


def _own_integrator(
    model: mujoco.MjModel, data: mujoco.MjData, cartpole: CartPole
) -> Callable[[float], State]:
    qpos, qvel, ctrl = _floats(data.qpos), _floats(data.qvel), _floats(data.ctrl)
    slider, hinge, substeps = cartpole.slider, cartpole.hinges[0], cartpole.substeps
    joints, is_one = cartpole.joints, cartpole.poles == 1
    mj_step = mujoco.mj_step

    def step(control: float) -> State:
        ctrl[0] = control
        try:
            mj_step(model, data, substeps)
        except mujoco.FatalError as error:
            raise gave_up(cartpole, error) from error
        if is_one:
            return qpos[slider], qvel[slider], qpos[hinge], qvel[hinge]
        return _state_of(qpos, qvel, joints)

    return step


def _state_of(
    qpos: "memoryview[float]", qvel: "memoryview[float]", joints: tuple[int, ...]
) -> State:
    return tuple([value for joint in joints for value in (qpos[joint], qvel[joint])])


def as_seen(simulation: Simulation, rules: task.Task) -> Callable[[float], State]:
    """Return steps that give what rules look at: of several poles the worst, without turns."""
    step, is_one = simulation.step, simulation.cartpole.poles == 1

    def turn(control: float) -> State:
        x, x_dot, theta, theta_dot = step(control)
        return x, x_dot, task.wrapped(theta), theta_dot

    def move_poles(control: float) -> State:
        return task.worst_pole(step(control))

    def turn_poles(control: float) -> State:
        return task.worst_pole(rules.seen(np.array(step(control))).tolist())

    if is_one:
        return turn if rules.turns else step
    return turn_poles if rules.turns else move_poles


def gave_up(cartpole: CartPole, error: Exception) -> SimulationError:
    """Return the error that says on which model MuJoCo gave up, and why."""
    return SimulationError(f"MuJoCo gave up on {cartpole.name}: {one_line(error)}")


def silence_mujoco() -> None:
    """Keep MuJoCo from printing warnings and from writing MUJOCO_LOG.TXT where a program runs.

    For programs, not for libraries: it holds for the whole process. Nothing is lost here, since a
    diverging simulation is a `SimulationError`.
    """
    mujoco.set_mju_user_warning(lambda message: None)


def check_sane(state: State, model_name: str) -> None:
    """Raise if a simulation has diverged.

    Raises:
        SimulationError: A value is NaN, infinite or beyond `LARGEST_SANE`.
    """
    if not all(-LARGEST_SANE < value < LARGEST_SANE for value in state):
        names = ", ".join(task.state_names(len(state) // 2 - 1))
        raise SimulationError(
            f"the simulation of {model_name} diverged: ({names}) = {state}; "
            "look for tiny masses, huge forces or a long timestep in the model"
        )
