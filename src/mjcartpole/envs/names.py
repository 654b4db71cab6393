"""CartPole-v1's names for what a cart-pole has: read from the model, written into its document."""

import dataclasses
import difflib
from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np
from gymnasium import logger, spaces

from mjcartpole.envs.disturber import Disturber
from mjcartpole.envs.editable import Editable
from mjcartpole.envs.observations import Observation, observation_space
from mjcartpole.errors import ConfigError, MjCartPoleError, SettingError
from mjcartpole.physics.bodies import cart_bodies, mass_of, pole_bodies
from mjcartpole.physics.cartpole import CartPole
from mjcartpole.physics.edit.rescale import length_of
from mjcartpole.physics.parameters import forces_of, pole_of
from mjcartpole.physics.simulation import Simulation
from mjcartpole.physics.structure import directions
from mjcartpole.rules import number_of
from mjcartpole.task import Task, in_words

Numbers = float | tuple[float, ...]
"""A number, or one for each of several poles."""

Edits = Callable[[CartPole, Any], dict[str, object]]
"""From a cart-pole and what is set to the edits that do it."""

CLOSE: Final = 0.7
"""How alike a name is to one of CartPole-v1's that was meant, by difflib."""


class Number:
    """A number of the model, under the name that CartPole-v1 has for it.

    With several poles, what each pole has is a tuple.

    Attributes:
        name: CartPole-v1's.
        read: Finds it in a cart-pole.
        edits: The edits that set it to a value; None where it follows from others.
        how: What to do instead, if it cannot be set.
    """

    def __init__(
        self, read: Callable[[CartPole], Numbers], edits: Edits | None = None, how: str = ""
    ) -> None:
        self.name, self.read, self.edits, self.how = "", read, edits, how

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __get__(self, env: "CartPoleNames | None", owner: type | None = None) -> Any:  # noqa: ANN401
        if env is None:
            return self
        cartpole = env.shown_cartpole()
        try:
            return self.read(cartpole)
        except MjCartPoleError as error:
            raise SettingError(f"{self.name} of {cartpole.name} cannot be read: {error}") from error

    def __set__(self, env: "CartPoleNames", value: object) -> None:
        if self.edits is None:
            raise SettingError(f"{self.name} cannot be set: {self.how}")
        try:
            env.edit(self.edits(env.shown_cartpole(), value))
        except (MjCartPoleError, TypeError, ValueError) as error:
            raise ConfigError(f"{self.name} cannot be {value!r}: {error}") from error


def _per_pole(read: Callable[[CartPole, int], float]) -> Callable[[CartPole], Numbers]:
    def values(cartpole: CartPole) -> Numbers:
        found = tuple(read(cartpole, pole) for pole in range(cartpole.poles))
        return found[0] if cartpole.poles == 1 else found

    return values


def _edit(key: str, times: float = 1.0) -> Edits:
    return lambda cartpole, value: {key: times * float(value)}


def _edit_poles(key: str, times: float = 1.0) -> Edits:
    """Edits of each pole; of one, `pole.mass`, of several, `pole1.mass` and so on."""

    def edits(cartpole: CartPole, value: Any) -> dict[str, object]:  # noqa: ANN401 - any number
        if cartpole.poles == 1:
            return {f"pole.{key}": times * float(value)}
        if np.shape(value) != (cartpole.poles,):
            raise ConfigError(f"the model has {in_words(cartpole.poles)}, give one number each")
        return {f"pole{n}.{key}": times * float(each) for n, each in enumerate(value, start=1)}

    return edits


def _gravity(cartpole: CartPole) -> float:
    return float(0.0 - directions(cartpole).up @ cartpole.model.opt.gravity)


def _edit_gravity(cartpole: CartPole, value: Any) -> dict[str, object]:  # noqa: ANN401 - any number
    if directions(cartpole).up[2] != 1:
        raise ConfigError(
            f"up is not +z in this model; set all of its gravity, which is "
            f"{' '.join(f'{part:g}' for part in cartpole.model.opt.gravity)}, by "
            'edits={"option.gravity": "X Y Z"}'
        )
    return {"gravity": float(value)}


def _cart_mass(cartpole: CartPole) -> float:
    return mass_of(cartpole.model, cart_bodies(cartpole))


def _pole_mass(cartpole: CartPole, pole: int) -> float:
    return mass_of(cartpole.model, pole_bodies(cartpole, pole))


def _total_mass(cartpole: CartPole) -> float:
    return sum(_pole_mass(cartpole, pole) for pole in range(cartpole.poles)) + _cart_mass(cartpole)


def _half_length(cartpole: CartPole, pole: int) -> float:
    return length_of(cartpole, pole) / 2


def _first_moment(cartpole: CartPole, pole: int) -> float:
    found = pole_of(cartpole, pole)
    return float(found.mass * np.linalg.norm(found.com))


def _force(cartpole: CartPole) -> float:
    left, right = forces_of(cartpole)
    if left != -right:
        raise ConfigError(f"the actions push with {left:g} N and {right:g} N")
    return abs(right)


class CartPoleNames:
    """Reading says what the model has; setting edits its document and compiles it.

    What is set has its effect from the next reset, and is read at once. The two thresholds are no
    numbers of a model and hold from the next step.
    """

    observation_space: spaces.Space[Any]
    _task: Task
    _observation: Observation
    _model: Editable
    _simulation: Simulation | None
    disturber: Disturber | None = None
    """Adds disturbances; None where nothing is added."""
    _limits: tuple[float, float, float, float]
    _steps_after_end: list[int | None]

    gravity = Number(_gravity, _edit_gravity)
    """m/s^2, downwards."""

    masscart = Number(_cart_mass, _edit("cart.mass"))
    """kg, all that slides and does not turn."""

    masspole = Number(_per_pole(_pole_mass), _edit_poles("mass"))
    """kg, all that turns on the hinge."""

    total_mass = Number(_total_mass, how="it is masscart + masspole; set one of these")
    """kg."""

    length = Number(_per_pole(_half_length), _edit_poles("length", 2.0))
    """m, half the pole's length, as CartPole-v1 has it."""

    polemass_length = Number(
        _per_pole(_first_moment), how="it follows from masspole and length; set one of these"
    )
    """kg m, the pole's mass by the distance of its centre of mass from the hinge."""

    force_mag = Number(_force, _edit("force"))
    """N, push of an action, to either side."""

    tau = Number(
        lambda cartpole: cartpole.control_step,
        lambda cartpole, value: {"timestep": float(value) / cartpole.substeps},
    )
    """s, between two actions; it is made of as many physics steps as before."""

    @property
    def kinematics_integrator(self) -> str:
        """Who moves the state: "euler", or the file's own, of which "semi-implicit" is Euler.

        Setting one has its effect from the next reset.
        """
        return self._model.kinematics

    @kinematics_integrator.setter
    def kinematics_integrator(self, name: str) -> None:
        self._model.kinematics = name

    @property
    def x_threshold(self) -> float:
        """How far the cart may be from the middle, m."""
        return self._limits[1]

    @x_threshold.setter
    def x_threshold(self, limit: float) -> None:
        self._set_limits(number_of("x_threshold", limit, "m", is_limit=True), self._limits[3])

    @property
    def theta_threshold_radians(self) -> float:
        """How far a pole may lean, rad."""
        return self._limits[3]

    @theta_threshold_radians.setter
    def theta_threshold_radians(self, limit: float) -> None:
        angle = number_of("theta_threshold_radians", limit, "rad", is_limit=True)
        self._set_limits(self._limits[1], angle)

    def _set_limits(self, x: float, theta: float) -> None:
        self._limits = -x, x, -theta, theta
        # Narrower limits leave the space as it is: an episode may start beyond them.
        task = self._task
        farthest = max(x, task.x_limit), max(theta, task.theta_limit)
        rules = dataclasses.replace(task, x_limit=farthest[0], theta_limit=farthest[1])
        poles = self._model.base.poles
        space = observation_space(rules, poles, self._observation)
        self.observation_space = self.disturber.space(space) if self.disturber else space

    @property
    def task(self) -> Task:
        """The rules that the environment was made with."""
        return self._task

    @property
    def steps_beyond_terminated(self) -> int | None:
        """Steps after the one that ended the episode; None before it."""
        return self._steps_after_end[0]

    @steps_beyond_terminated.setter
    def steps_beyond_terminated(self, steps: int | None) -> None:
        self._steps_after_end[0] = steps

    def edit(self, edits: Mapping[str, object]) -> None:
        """Edit the model's document, with effect from the next reset.

        Args:
            edits: As `load_model` takes them; later ones are added to earlier ones.

        Raises:
            ConfigError: An edit makes no sense.
            ModelError: It makes the model one that cannot be used.
        """
        self._model.edit(edits)

    def shown_cartpole(self) -> CartPole:
        """The cart-pole whose numbers the names read: as it moves, or as it was set."""
        shown, simulation = self._model.shown, self._simulation
        if simulation is None or shown is not simulation.cartpole:
            return shown
        return dataclasses.replace(shown, model=simulation.model)


class FixedNames:
    """CartPole-v1's names of many environments: read only, since edits are made at the start.

    Where models vary there is one number for each environment.
    """

    cartpole: CartPole
    _task: Task

    @property
    def task(self) -> Task:
        """The rules that the environments were made with."""
        return self._task

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - any of several
        number = vars(CartPoleNames).get(name)
        if isinstance(number, Number):
            disturbers = self.__dict__.get("_disturbers")
            if disturbers is not None and disturbers.vary:
                return tuple(map(number.read, disturbers.cartpoles))
            return number.read(self.cartpole)
        if name in _LIMITS:
            return getattr(self._task, _LIMITS[name])
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")

    def __setattr__(self, name: str, value: object) -> None:
        own = name == "state" or name.startswith("_") or hasattr(type(self), name)
        if not own and difflib.get_close_matches(name, SETTABLE, n=1, cutoff=CLOSE):
            raise SettingError(
                f"{name} of many environments cannot be set; make them with "
                'edits={"pole.length": 1.5} and the like, which all of them get'
            )
        super().__setattr__(name, value)


_LIMITS: Final = {"x_threshold": "x_limit", "theta_threshold_radians": "theta_limit"}

SETTABLE: Final = (
    *(each.name for each in vars(CartPoleNames).values() if isinstance(each, Number)),
    "kinematics_integrator",
    "x_threshold",
    "theta_threshold_radians",
    "state",
)
"""The names that have an effect, or say why they have none, when they are set."""


def refuse_slip(name: str) -> None:
    """Say that setting an attribute of an environment has no effect.

    Raises:
        SettingError: It looks like a slip for a name that has one.
    """
    names = f"CartPole-v1's names are {', '.join(SETTABLE)}"
    if close := difflib.get_close_matches(name, SETTABLE, n=1, cutoff=CLOSE):
        raise SettingError(f"an environment has no {name!r}, did you mean {close[0]!r}? {names}")
    logger.warn(
        f"an environment has no {name!r}: nothing reads what was set. {names}; a model's other "
        "numbers are changed by edits={…}. A subclass or a wrapper may have names of its own"
    )
