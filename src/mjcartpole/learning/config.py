"""Training configs: `TrainConfig`, all that decides a training, and its presets.

One place for each number: the command line's flags and their help are derived from this class, and
from the parameters of the learning method (see `methods/`).
"""

import dataclasses
import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Literal, Self

from mjcartpole.disturbances.disturbances import Disturbances
from mjcartpole.envs.backend import Backend, check_backend
from mjcartpole.errors import ConfigError, check_known
from mjcartpole.integrator import Integrator
from mjcartpole.learning.discretizer import Discretizer, is_finite
from mjcartpole.learning.methods import METHODS, method_named
from mjcartpole.learning.methods.parameters import Parameters
from mjcartpole.learning.presets import PRESETS
from mjcartpole.rewards import REWARDS, named
from mjcartpole.rule_changes import RuleChanges
from mjcartpole.rules import RULES
from mjcartpole.task import CARTPOLE_V1, N_ACTIONS, Task, for_each_pole, in_words, state_names

if TYPE_CHECKING:
    from mjcartpole.physics.cartpole import CartPole

MAX_SEED: Final = 2**128 - 1
"""A generator's state has as many bits."""

MAX_EPISODES: Final = 1_000_000_000
"""More than anybody waits for; the log of so many takes 13 GB."""

_MOST: Final = {"episodes": MAX_EPISODES, "log_every": MAX_EPISODES, "seed": MAX_SEED}

_GRID: Final = ("bins", "low", "high")
_DIMENSIONS: Final = len(state_names())

POOL: Final = 100
"""Models of a training in which they vary."""

DEFAULT_METHOD: Final = "q-learning"
"""The method of every preset that names no other."""


@dataclass(frozen=True, kw_only=True, repr=False)
class TrainConfig(RuleChanges):
    """All that decides a training. Equal configs give equal tables, bit for bit.

    The fields below are those of every training; beside them a config has the parameters of its
    method, under their own names.

    >>> TrainConfig(alpha=0.2).gamma
    0.98
    >>> TrainConfig(method="sarsa", epsilon=0.5)
    TrainConfig(method='sarsa', epsilon=0.5)
    """

    task: str = CARTPOLE_V1.name
    """The rules: limits, starting states, reward, time limit."""
    backend: Backend = "mujoco"
    """Who does the physics: mujoco, or gymnasium's own CartPole-v1."""
    model: str = "cartpole"
    """A shipped model's name or an MJCF file; backend mujoco only."""
    set: tuple[str, ...] = ()
    """Edits of the model, such as pole.length=1.5 or joint:hinge.damping=0.1."""
    own_timestep: bool = False
    """Let a control step be one physics step of the model's file, instead of 0.02 s."""
    integrator: Integrator = "gym"
    """gym: explicit Euler, as CartPole-v1; mujoco: the integrator that the model's file names."""
    method: str = DEFAULT_METHOD
    """How the table learns; each method has parameters of its own."""
    episodes: int = 1_000
    """Episodes to train; the method identify dreams them."""
    seed: int = 0
    """Seeds the environment and the learner."""
    bins: tuple[int, ...] = (1, 3, 6, 8)
    """Bins for x, x_dot, theta and theta_dot, such as 1,3,6,8; 1 ignores a dimension. With several
    poles the last two hold for each, here and below, unless two more are given for each."""
    low: tuple[float, ...] = (-2.4, -0.75, -0.2095, -1.5)
    """Lower ends of the bins' ranges; what lies outside belongs to the edge bins."""
    high: tuple[float, ...] = (2.4, 0.75, 0.2095, 1.5)
    """Upper ends of the bins' ranges."""
    mirror: bool | None = None
    """Learn of each state and action what their mirror images teach: left and right are alike. Left
    out: where model, rules and grid are so."""
    log_every: int = 100
    """Episodes per row of the printed table."""
    evaluate_every: int | None = None
    """Play greedy episodes after each so many of training, for evaluations.csv and the printed
    table; what is learned stays the same. With --until alone: a hundredth of all episodes."""
    until: float | None = None
    """Stop once the mean return of such greedy episodes reaches this, 475 for example."""

    if TYPE_CHECKING:

        def __init__(self, **values: Any) -> None: ...
        def __getattr__(self, name: str) -> Any: ...

    else:

        def __new__(cls, **values: Any) -> Self:
            """Make a config of the class that has the parameters of the method as well."""
            wanted = config_class(values.get("method", cls.method))
            if unknown := sorted(set(values) - set(wanted.fields())):
                raise ConfigError(
                    f"method {wanted.method!r} has no {', '.join(unknown)}; available: "
                    f"{', '.join(wanted.fields())}"
                )
            # Where that class is another one than `cls`, Python does not call its `__init__`.
            made = object.__new__(wanted)
            if not issubclass(wanted, cls):
                made.__init__(**values)
            return made

    def __reduce__(self) -> tuple[Any, ...]:
        return _from_values, (self.values(),)

    def __post_init__(self) -> None:
        for name in (*_GRID, "set"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        assert isinstance(self, Disturbances)
        Disturbances.__post_init__(self)
        edits = *self.set, *self.vary
        check_backend(
            self.backend, self.model, self.integrator, edits, own_timestep=self.own_timestep
        )
        self._take_rules()
        self._check_disturbances()
        if self.rules.continuous:
            raise ConfigError(f"a table chooses between two actions; {self.task} takes any push")
        self._check_counts()
        self._check_until()
        self._check_dimensions()
        assert isinstance(self, Parameters)
        self.check_parameters()
        _ = self.discretizer(self._most_poles)

    @classmethod
    def preset(cls, name: str, **changes: Any) -> "TrainConfig":
        """Return a preset's config with some fields changed.

        With another method than its own, a preset gives what that method has of it.

        Args:
            name: One of `PRESETS`.
            changes: Any field of the config.

        Raises:
            ConfigError: The preset or a field is unknown, or a value makes no sense.
        """
        check_known("preset", name, PRESETS)
        preset = {"method": DEFAULT_METHOD, **PRESETS[name]}
        method = changes.get("method", preset["method"])
        known = config_class(method).fields()
        return cls(**{each: preset[each] for each in preset if each in known} | changes)

    def __repr__(self) -> str:
        """What differs from the defaults; it evaluates to an equal config."""
        defaults = {field.name: field.default for field in dataclasses.fields(self)}
        defaults["method"] = DEFAULT_METHOD
        changed = [f"{n}={v!r}" for n, v in self.values().items() if v != defaults[n]]
        return f"TrainConfig({', '.join(changed)})"

    @classmethod
    def fields(cls) -> dict[str, Any]:
        """Return each field's type, by name."""
        return {field.name: field.type for field in dataclasses.fields(cls)}

    def values(self) -> dict[str, Any]:
        """Return each field's value, by name; `TrainConfig(**values)` is an equal config."""
        return {name: getattr(self, name) for name in self.fields()}

    @property
    def rules(self) -> Task:
        """The task itself, with what was changed of it.

        Raises:
            ConfigError: There is none of that name, or the changes make no sense.
        """
        return self.applied_to(CARTPOLE_V1)

    def stored(self) -> dict[str, Any]:
        """Return `values` as JSON has them, which has no infinity: that one is a text."""
        values = self.values()
        return {name: "inf" if values[name] == math.inf else values[name] for name in values}

    def load_model(self) -> "CartPole":
        """Load the model that the config names; for backend gym the reference, as it is drawn.

        Raises:
            ModelError: It cannot be used.
            ConfigError: An edit makes no sense.
        """
        from mjcartpole.physics.load import load_model  # noqa: PLC0415 - it imports MuJoCo

        return load_model(self.model, self.set, own_timestep=self.own_timestep)

    def discretizer(self, poles: int = 1) -> Discretizer:
        """Return the grid for a model with so many poles.

        >>> TrainConfig(bins=(1, 3, 6, 8)).discretizer(poles=2).bins
        (1, 3, 6, 8, 6, 8)

        Raises:
            ConfigError: The config was made for another number of poles.
        """
        wanted = len(state_names(poles))
        for name in _GRID:
            n = len(getattr(self, name))
            if n not in (_DIMENSIONS, wanted):
                also = f" or {wanted}" if wanted != _DIMENSIONS else ""
                raise ConfigError(
                    f"{name} has {n} values, and the model has {in_words(poles)}; "
                    f"give {_DIMENSIONS}{also} ({', '.join(state_names(poles))})"
                )
        bins, low, high = (for_each_pole(getattr(self, name), poles) for name in _GRID)
        n, tilings = self.observe_actions, getattr(self, "tilings", 1)
        return Discretizer(
            # Before the first action neither was chosen; that counts as 1.
            bins=(*bins, *(N_ACTIONS,) * n),
            low=(*low, *(-1.0,) * n),
            high=(*high, *(1.0,) * n),
            mirror=bool(self.mirror),
            tilings=tilings,
            interpolated=self.interpolated,
            actions=n,
        )

    @property
    def disturbances(self) -> Disturbances:
        """What is added to the task in training; models that vary come from a pool."""
        own = Disturbances.of(self)
        if own.vary and own.pool is None:
            return dataclasses.replace(own, pool=POOL)
        return own

    @property
    def evaluation_period(self) -> int | None:
        """Training episodes between two greedy evaluations; None where there are none."""
        if self.evaluate_every is None and self.until is not None:
            return max(1, self.episodes // 100)
        return self.evaluate_every

    @property
    def solved_at(self) -> float | None:
        """The mean greedy return that counts as solved: `until`, or else what the task says."""
        return self.rules.reward_threshold if self.until is None else self.until

    @property
    def _most_poles(self) -> int:
        return max(len(getattr(self, name)) for name in _GRID) // 2 - 1

    def _take_rules(self) -> None:
        """Keep the task's name, and of what is changed numbers and names: what JSON can hold."""
        rules = self.applied_to(CARTPOLE_V1)
        for name, value in self.changes.items():
            if value is not None or name in rules.changes:
                object.__setattr__(self, name, named(getattr(rules, RULES[name])))
        object.__setattr__(self, "task", rules.name)
        if callable(self.reward):
            raise ConfigError(
                f"a config holds the name of a reward ({', '.join(REWARDS)}), not a function; "
                "for one of your own, register_task a Task that has it"
            )

    def _check_dimensions(self) -> None:
        for name in _GRID:
            values = getattr(self, name)
            if len(values) < _DIMENSIONS or len(values) % 2:
                raise ConfigError(
                    f"{name} needs {_DIMENSIONS} values ({', '.join(state_names())}), and two "
                    f"more for each further pole, not {values}"
                )

    @property
    def disturbances_after(self) -> Disturbances:
        """What is added where the policy is evaluated: new models from the whole ranges."""
        return dataclasses.replace(Disturbances.of(self), widen=0)

    def _check_disturbances(self) -> None:
        own = Disturbances.of(self)
        own.check_apart(each.partition("=")[0].strip() for each in self.set)
        own.check_fits(self.rules)
        method = method_named(self.method)
        if self.observe_actions and (hasattr(method, "plan") or hasattr(method, "imagine")):
            raise ConfigError(
                f"method {self.method!r} learns from equations of the state, in which no action "
                "before is seen; take another method, or leave out observe_actions"
            )
        if self.observe_context:
            raise ConfigError(
                "a table has no bins for what varies; observe_context is for environments of other "
                "learners"
            )

    def _check_counts(self) -> None:
        counts = {"episodes": 1, "log_every": 1, "seed": 0, "evaluate_every": 1}
        for name, least in counts.items():
            value = getattr(self, name)
            if value is None and name == "evaluate_every":
                continue
            if type(value) is not int or value < least:
                raise ConfigError(f"{name} must be a whole number from {least} up, not {value!r}")
        for name, most in _MOST.items():
            if getattr(self, name) > most:
                raise ConfigError(f"{name} must be at most {most:,}; this one is larger")
        if (self.evaluate_every or 0) > self.episodes:
            raise ConfigError(
                f"evaluate_every must be at most {self.episodes:,}, the episodes that there are, "
                f"or nothing would be evaluated; not {self.evaluate_every:,}"
            )

    def _check_until(self) -> None:
        until, most = self.until, self.rules.most_return
        if until is None or (is_finite(until) and until <= most):
            return
        at_most = f" of at most {most:g}, the most that an episode of {self.task} returns"
        raise ConfigError(
            f"until must be a number{at_most if math.isfinite(most) else ''}, not {until!r}"
        )


@functools.cache
def config_class(method: str) -> type[TrainConfig]:
    """Return the dataclass of a training by a method: the fields of both.

    Raises:
        ConfigError: There is no such method.
    """
    made: type[TrainConfig] = dataclasses.make_dataclass(
        "TrainConfig",
        # The command line names what a literal can be.
        [("method", Literal[tuple(METHODS)], dataclasses.field(default=method))],
        bases=(Disturbances, method_named(method).Parameters, TrainConfig),
        namespace={
            "__doc__": TrainConfig.__doc__,
            "__module__": __name__,
            "__repr__": TrainConfig.__repr__,
            "__post_init__": TrainConfig.__post_init__,
        },
        frozen=True,
        kw_only=True,
        repr=False,
    )
    return made


def _from_values(values: Mapping[str, Any]) -> TrainConfig:
    return TrainConfig(**values)
